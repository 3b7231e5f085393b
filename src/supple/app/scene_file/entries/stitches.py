"""Stitches of a scene file, by `kind`."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from supple.app.scene_file.model import Index, Model, Name, NonNegative, Positive
from supple.scene.stitches.registry import STITCHES
from supple.scene.stitches.stitch import Stitch

PairList = Annotated[list[Annotated[list[Index], Field(min_length=2, max_length=2)]], Field(min_length=1)]
PerPair = Positive | Annotated[list[Positive], Field(min_length=1)]
Lengths = NonNegative | Annotated[list[NonNegative], Field(min_length=1)]


class _StitchModel(Model):
    kind: str
    first: Name = Field(description="the body whose vertices are stitched")
    second: Name = Field(description="a body, soft or rigid, or an obstacle of triangles")
    max_distance: Positive | None = Field(
        default=None, description="stitch all pairs nearer than this at the start [m]"
    )
    pairing: Literal["closest", "all"] = Field(
        default="closest", description="partners of a vertex: the closest, or all within max_distance"
    )
    damping: NonNegative = Field(default=0.0, description="Kelvin-Voigt time [s]")
    name: Name | None = Field(default=None, description="used in messages")

    def build(self) -> Stitch:
        return STITCHES[self.kind](**self.model_dump(exclude={"kind"}))


class SoftVertexTriangleModel(_StitchModel):
    """Soft tetrahedra between vertices and triangles. Give `pairs` or `max_distance`; `youngs` and `poisson`, or `mu`
    and `lam`."""

    kind: Literal["soft_vertex_triangle"]
    pairs: PairList | None = Field(default=None, description="[vertex of the first, surface triangle of the second]")
    youngs: PerPair | None = Field(default=None, description="Young's modulus [Pa]; one, or one per pair")
    poisson: PerPair | None = Field(default=None, description="Poisson's ratio, below 0.5; one, or one per pair")
    mu: PerPair | None = Field(default=None, description="instead of `youngs`: Lamé parameter mu [Pa]")
    lam: PerPair | None = Field(default=None, description="instead of `poisson`: Lamé parameter lambda [Pa]")
    min_separate_distance: PerPair | None = Field(
        default=None,
        description="smallest distance at rest [m]; one, or one per pair; null: 1 % of the mean edge",
    )


class _SpringModel(_StitchModel):
    stiffness: PerPair = Field(description="of each spring [N/m]; one, or one per pair")
    rest_length: Lengths | None = Field(default=None, description="[m]; default: the distance at the start")


class VertexVertexModel(_SpringModel):
    """Springs between vertices."""

    kind: Literal["vertex_vertex"]
    pairs: PairList | None = Field(default=None, description="[vertex of the first, vertex of the second]")


class VertexEdgeModel(_SpringModel):
    """Springs from vertices to points of edges."""

    kind: Literal["vertex_edge"]
    pairs: PairList | None = Field(default=None, description="[vertex of the first, surface edge of the second]")


StitchModel = Annotated[SoftVertexTriangleModel | VertexVertexModel | VertexEdgeModel, Field(discriminator="kind")]
