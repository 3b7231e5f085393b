"""Materials of a scene file, by `kind`."""

from __future__ import annotations

import re
from dataclasses import fields
from typing import TYPE_CHECKING, Annotated, Any, Literal, Union

from pydantic import Field, create_model

from supple.app.scene_file.model import Model, Name, NonNegative, Number, Positive, Vector
from supple.materials.edges_and_volume import EdgesAndVolume
from supple.materials.hyperelastic.by_law import ByLaw
from supple.materials.hyperelastic.holzapfel_gasser_ogden import HolzapfelGasserOgden
from supple.materials.hyperelastic.mooney_rivlin import MooneyRivlin
from supple.materials.hyperelastic.ogden import Ogden
from supple.materials.hyperelastic.yeoh import Yeoh
from supple.materials.j2_plastic import J2Plastic
from supple.materials.material import Elastic, Hyperelastic, Material
from supple.materials.own.energy_material import EnergyMaterial
from supple.materials.registry import ELASTIC_MATERIALS
from supple.materials.viscoelastic import Viscoelastic


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


class _ByLawModel(_MaterialModel):
    kind: str
    bulk: Positive = Field(description="bulk modulus K [Pa]")
    integration: Literal["tets", "patches"] = Field(
        default="tets", description="strains of each tet, or means over patches, which do not lock (Implicit only)"
    )

    def build(self) -> Hyperelastic:
        return BY_LAW_KINDS[self.kind](**self.model_dump(exclude={"kind"}))


class MooneyRivlinModel(_ByLawModel):
    """Mooney-Rivlin rubber (Implicit only)."""

    kind: Literal["mooney_rivlin"]
    c10: Number = Field(description="[Pa]; the shear modulus 2 (c10 + c01) must be above zero")
    c01: Number = Field(default=0.0, description="[Pa]")


class YeohModel(_ByLawModel):
    """Yeoh rubber (Implicit only)."""

    kind: Literal["yeoh"]
    c10: Positive = Field(description="[Pa]; half of the shear modulus")
    c20: Number = Field(default=0.0, description="[Pa]")
    c30: Number = Field(default=0.0, description="[Pa]")


class OgdenModel(_ByLawModel):
    """Ogden rubber (Implicit only)."""

    kind: Literal["ogden"]
    mu: list[Number] = Field(min_length=1, max_length=9, description="of every term [Pa]")
    alpha: list[Number] = Field(min_length=1, max_length=9, description="exponent of every term")


class HolzapfelGasserOgdenModel(_ByLawModel):
    """Tissue with families of fibres (Implicit only)."""

    kind: Literal["holzapfel_gasser_ogden"]
    c10: Positive = Field(description="of the ground [Pa]; half of its shear modulus")
    k1: NonNegative = Field(description="stiffness of the fibres [Pa]")
    k2: Positive = Field(description="how fast the fibres stiffen")
    kappa: float = Field(default=0.0, ge=0.0, le=1.0 / 3.0, description="dispersion of their directions, up to 1/3")
    directions: list[Vector] = Field(
        min_length=1, max_length=100, description="mean direction of each family at rest, in the mesh's coordinates"
    )


class EnergyMaterialModel(_ByLawModel):
    """A material with an energy that the file gives as a formula (Implicit only)."""

    kind: Literal["energy_material"]
    bulk: NonNegative = Field(default=0.0, description="bulk modulus K of K/2 (J - 1)^2, which is added [Pa]")
    psi: str = Field(max_length=4000, description="energy per rest volume [Pa], such as mu / 2 * (I1 * J**(-2/3) - 3)")
    of: Literal["invariants", "stretches"] = Field(
        default="invariants", description="whether psi is a formula of I1, I2 and J, or of s0, s1 and s2"
    )
    parameters: dict[Name, Number] = Field(default_factory=dict, description="values of other names in psi, by name")


class J2PlasticModel(_MaterialModel):
    """A metal that yields: J2 plasticity at finite strain (Implicit only)."""

    kind: Literal["j2_plastic"]
    youngs: Positive = Field(description="Young's modulus [Pa]")
    poisson: float = Field(gt=-1.0, lt=0.5, description="Poisson's ratio, above -1 and below 0.5")
    yield_stress: Positive = Field(description="at first yield [Pa]")
    hardening: NonNegative = Field(default=0.0, description="linear hardening [Pa]")
    saturation_stress: Positive | None = Field(default=None, description="at least yield_stress [Pa]; null: as that")
    saturation_rate: NonNegative = Field(default=0.0, description="of the exponential hardening")

    def build(self) -> Hyperelastic:
        return J2Plastic(**self.model_dump(exclude={"kind"}))


BY_LAW_KINDS: dict[str, type[ByLaw]] = {
    "mooney_rivlin": MooneyRivlin,
    "yeoh": Yeoh,
    "ogden": Ogden,
    "holzapfel_gasser_ogden": HolzapfelGasserOgden,
    "energy_material": EnergyMaterial,
}


def scene_file_line(material: ByLaw) -> str:
    """A rubber as a scene file has it, with the parameters of its class; density and damping are left out."""
    kind = next(kind for kind, each in BY_LAW_KINDS.items() if each is type(material))
    skipped = {field.name for field in fields(Material)} | {"integration"}
    values = {f.name: getattr(material, f.name) for f in fields(material) if f.name not in skipped}
    texts = [f"{key}: {list(value) if isinstance(value, tuple) else float(value)}" for key, value in values.items()]
    return f"{{kind: {kind}, {', '.join(texts)}}}"


def _elastic_model(kind: str) -> type[ElasticModel]:
    name = ELASTIC_KINDS[kind].__name__ + "Model"
    doc = (ELASTIC_KINDS[kind].__doc__ or "").partition("\n")[0]
    choice: Any = (Literal[kind], ...)  # pyright: ignore[reportInvalidTypeForm]
    return create_model(name, __base__=ElasticModel, __doc__=doc, __module__=__name__, kind=choice)


if TYPE_CHECKING:
    UnrelaxedModel = ElasticModel | _ByLawModel
else:
    # Built from lists of models.
    _UNRELAXED = (
        *(_elastic_model(kind) for kind in ELASTIC_KINDS),
        MooneyRivlinModel,
        YeohModel,
        OgdenModel,
        HolzapfelGasserOgdenModel,
        EnergyMaterialModel,
    )
    UnrelaxedModel = Annotated[Union[_UNRELAXED], Field(discriminator="kind")]  # noqa: UP007


class ViscoelasticModel(Model):
    """A hyperelastic material whose stress relaxes as a Prony series (Implicit only)."""

    kind: Literal["viscoelastic"]
    material: UnrelaxedModel = Field(
        description="hyperelastic, with density and damping: what is left after a long time"
    )
    prony: list[Annotated[list[Positive], Field(min_length=2, max_length=2)]] = Field(
        min_length=1, max_length=20, description="pairs: share of the shear modulus at once, and time [s]"
    )

    def build(self) -> Hyperelastic:
        return Viscoelastic(material=self.material.build(), prony=[(share, time) for share, time in self.prony])


if TYPE_CHECKING:
    ElasticMaterialModel = ElasticModel | _ByLawModel | J2PlasticModel | ViscoelasticModel
    MaterialModel = EdgesAndVolumeModel | ElasticModel | _ByLawModel | J2PlasticModel | ViscoelasticModel
else:
    _ELASTIC = (*_UNRELAXED, J2PlasticModel, ViscoelasticModel)
    ElasticMaterialModel = Annotated[Union[_ELASTIC], Field(discriminator="kind")]  # noqa: UP007
    MaterialModel = Annotated[Union[(EdgesAndVolumeModel, *_ELASTIC)], Field(discriminator="kind")]
