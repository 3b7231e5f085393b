"""Shapes of a scene file, by `kind`: their keys are arguments of the functions of this name in `supple.mesh.shapes`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, Literal

from pydantic import Field

from supple.app.scene_file.model import Count, Extents, Model, Positive
from supple.mesh import shapes
from supple.mesh.surface import SurfaceMesh
from supple.mesh.tetmesh import TetMesh

Divisions = Annotated[list[Count], Field(min_length=3, max_length=3)]

_DEFAULT_EDGES: dict[str, Callable[[Any], float]] = {
    "sphere": lambda shape: 0.2 * shape.radius,
    "cylinder": lambda shape: 0.2 * min(shape.radius, shape.height),
    "spherical_shell": lambda shape: 0.5 * (shape.outer_radius - shape.inner_radius),
    "torus": lambda shape: 0.4 * shape.tube_radius,
    "gummy_bear": lambda shape: 0.08 * shape.height,
}


class _Shape(Model):
    kind: str

    def build(self, order: int = 1) -> TetMesh:
        return getattr(shapes, self.kind)(**self._arguments(), order=order)

    def build_surface(self) -> SurfaceMesh:
        made = getattr(shapes, f"{self.kind}_surface", None)
        return self.build().surface.compact() if made is None else made(**self._arguments())

    def _arguments(self) -> dict[str, Any]:
        given = {key: getattr(self, key) for key in type(self).model_fields if key != "kind"}
        if "edge_length" in given and given["edge_length"] is None:
            given["edge_length"] = _DEFAULT_EDGES[self.kind](self)
        return given


class BoxShapeModel(_Shape):
    """A box, centred at the origin, divided into a grid."""

    kind: Literal["box"]
    size: Extents = Field(default=[1.0, 1.0, 1.0], description="full edge lengths [m]")
    divisions: Divisions = Field(default=[4, 4, 4], description="cells along x, y and z")


class SphereShapeModel(_Shape):
    """A ball, centred at the origin."""

    kind: Literal["sphere"]
    radius: Positive = Field(default=0.5, description="[m]")
    edge_length: Positive | None = Field(default=None, description="mean edge [m]; default: a fifth of the radius")


class CylinderShapeModel(_Shape):
    """A cylinder along y, centred at the origin."""

    kind: Literal["cylinder"]
    radius: Positive = Field(default=0.5, description="[m]")
    height: Positive = Field(default=1.0, description="[m]")
    edge_length: Positive | None = Field(
        default=None, description="mean edge [m]; default: a fifth of the smaller of radius and height"
    )


class SphericalShellShapeModel(_Shape):
    """A hollow ball."""

    kind: Literal["spherical_shell"]
    inner_radius: Positive = Field(default=0.3, description="[m]")
    outer_radius: Positive = Field(default=0.5, description="[m]")
    edge_length: Positive | None = Field(default=None, description="mean edge [m]; default: half of the wall")


class TorusShapeModel(_Shape):
    """A ring about the y axis."""

    kind: Literal["torus"]
    radius: Positive = Field(default=0.5, description="of the circle in the middle of the tube [m]")
    tube_radius: Positive = Field(default=0.2, description="of the tube [m]")
    edge_length: Positive | None = Field(default=None, description="mean edge [m]; default: 0.4 of the tube's radius")


class GummyBearShapeModel(_Shape):
    """The gummy bear."""

    kind: Literal["gummy_bear"]
    height: Positive = Field(default=1.0, description="[m]")
    edge_length: Positive | None = Field(default=None, description="mean edge [m]; default: 0.08 of the height")


class GummyBearSurfaceModel(_Shape):
    """The surface of the gummy bear, at any resolution."""

    kind: Literal["gummy_bear"]
    height: Positive = Field(default=1.0, description="[m]")
    resolution: Count = Field(default=64, description="its height in mean edges")


ShapeModel = Annotated[
    BoxShapeModel
    | SphereShapeModel
    | SphericalShellShapeModel
    | CylinderShapeModel
    | TorusShapeModel
    | GummyBearShapeModel,
    Field(discriminator="kind"),
]
SurfaceShapeModel = Annotated[
    BoxShapeModel | SphereShapeModel | CylinderShapeModel | TorusShapeModel | GummyBearSurfaceModel,
    Field(discriminator="kind"),
]
