"""Materials of a scene file, by `kind`."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Annotated, Any, Literal, Union

from pydantic import Field, create_model

from supple.materials.edges_and_volume import EdgesAndVolume
from supple.materials.material import Elastic, Material
from supple.materials.registry import ELASTIC_MATERIALS
from supple.scene_file.model import Model, NonNegative, Positive


def _kind(material: type[Elastic]) -> str:
    """A class's name as scene files write it: StableNeoHookean is stable_neo_hookean."""
    return re.sub(r"(?<=[a-z])(?=[A-Z])", "_", material.__name__).lower()


ELASTIC_KINDS = {_kind(material): material for material in ELASTIC_MATERIALS}


class _MaterialModel(Model):
    density: Positive = Field(default=1000.0, description="mass density at rest [kg/m^3]")
    damping: NonNegative = Field(default=0.0, description="Kelvin-Voigt damping time [s]")


class EdgesAndVolumeModel(_MaterialModel):
    """The classic XPBD body: springs along edges, one volume constraint per tetrahedron (XPBD only)."""

    kind: Literal["edges_and_volume"]
    edge_compliance: NonNegative = Field(default=0.0, description="of every edge [m/N]; 0 is rigid")
    volume_compliance: NonNegative = Field(default=0.0, description="of every tetrahedron [m^5/N]; 0 keeps the volume")

    def build(self) -> Material:
        return EdgesAndVolume(**self.model_dump(exclude={"kind"}))


class ElasticModel(_MaterialModel):
    """A hyperelastic material given by its engineering constants."""

    kind: str
    youngs: Positive = Field(description="Young's modulus [Pa]")
    poisson: float = Field(gt=-1.0, lt=0.5, description="Poisson's ratio, above -1 and below 0.5")
    integration: Literal["tets", "patches"] = Field(
        default="tets", description="strains of each tet, or means over patches, which do not lock (Implicit only)"
    )

    def build(self) -> Elastic:
        return ELASTIC_KINDS[self.kind](**self.model_dump(exclude={"kind"}))


def _elastic_model(kind: str) -> type[ElasticModel]:
    name = ELASTIC_KINDS[kind].__name__ + "Model"
    doc = (ELASTIC_KINDS[kind].__doc__ or "").partition("\n")[0]
    choice: Any = (Literal[kind], ...)  # pyright: ignore[reportInvalidTypeForm]
    return create_model(name, __base__=ElasticModel, __doc__=doc, __module__=__name__, kind=choice)


if TYPE_CHECKING:
    ElasticMaterialModel = ElasticModel
    MaterialModel = EdgesAndVolumeModel | ElasticModel
else:
    # Built from lists of models.
    _ELASTIC = tuple(_elastic_model(kind) for kind in ELASTIC_KINDS)
    ElasticMaterialModel = Annotated[Union[_ELASTIC], Field(discriminator="kind")]  # noqa: UP007
    MaterialModel = Annotated[Union[(EdgesAndVolumeModel, *_ELASTIC)], Field(discriminator="kind")]
