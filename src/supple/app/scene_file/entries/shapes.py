"""Shapes of a scene file, by `kind`."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from supple.app.scene_file.model import Count, Extents, Model, Positive
from supple.mesh import shapes
from supple.mesh.surface import SurfaceMesh
from supple.mesh.tetmesh import TetMesh

Divisions = Annotated[list[Count], Field(min_length=3, max_length=3)]


class BoxShapeModel(Model):
    """A box, centred at the origin, divided into a grid."""

    kind: Literal["box"]
    size: Extents = Field(default=[1.0, 1.0, 1.0], description="full edge lengths [m]")
    divisions: Divisions = Field(default=[4, 4, 4], description="cells along x, y and z")

    def build(self, order: int = 1) -> TetMesh:
        return shapes.box(self.size, self.divisions, order)

    def build_surface(self) -> SurfaceMesh:
        return shapes.box_surface(self.size, self.divisions)


class SphereShapeModel(Model):
    """A ball, centred at the origin."""

    kind: Literal["sphere"]
    radius: Positive = Field(default=0.5, description="[m]")
    edge_length: Positive | None = Field(default=None, description="mean edge [m]; default: a fifth of the radius")

    def build(self, order: int = 1) -> TetMesh:
        return shapes.sphere(self.radius, self.edge_length or 0.2 * self.radius, order)

    def build_surface(self) -> SurfaceMesh:
        return shapes.sphere_surface(self.radius, self.edge_length or 0.2 * self.radius)


class CylinderShapeModel(Model):
    """A cylinder along y, centred at the origin."""

    kind: Literal["cylinder"]
    radius: Positive = Field(default=0.5, description="[m]")
    height: Positive = Field(default=1.0, description="[m]")
    edge_length: Positive | None = Field(
        default=None, description="mean edge [m]; default: a fifth of the smaller of radius and height"
    )

    def build(self, order: int = 1) -> TetMesh:
        edge_length = self.edge_length or 0.2 * min(self.radius, self.height)
        return shapes.cylinder(self.radius, self.height, edge_length, order)

    def build_surface(self) -> SurfaceMesh:
        return shapes.cylinder_surface(
            self.radius, self.height, self.edge_length or 0.2 * min(self.radius, self.height)
        )


class SphericalShellShapeModel(Model):
    """A hollow ball."""

    kind: Literal["spherical_shell"]
    inner_radius: Positive = Field(default=0.3, description="[m]")
    outer_radius: Positive = Field(default=0.5, description="[m]")
    edge_length: Positive | None = Field(default=None, description="mean edge [m]; default: half of the wall")

    def build(self, order: int = 1) -> TetMesh:
        edge_length = self.edge_length or 0.5 * (self.outer_radius - self.inner_radius)
        return shapes.spherical_shell(self.inner_radius, self.outer_radius, edge_length, order)

    def build_surface(self) -> SurfaceMesh:
        return self.build().surface.compact()


class TorusShapeModel(Model):
    """A ring about the y axis."""

    kind: Literal["torus"]
    radius: Positive = Field(default=0.5, description="of the circle in the middle of the tube [m]")
    tube_radius: Positive = Field(default=0.2, description="of the tube [m]")
    edge_length: Positive | None = Field(default=None, description="mean edge [m]; default: 0.4 of the tube's radius")

    def build(self, order: int = 1) -> TetMesh:
        return shapes.torus(self.radius, self.tube_radius, self.edge_length or 0.4 * self.tube_radius, order)

    def build_surface(self) -> SurfaceMesh:
        return shapes.torus_surface(self.radius, self.tube_radius, self.edge_length or 0.4 * self.tube_radius)


class GummyBearShapeModel(Model):
    """The gummy bear."""

    kind: Literal["gummy_bear"]
    height: Positive = Field(default=1.0, description="[m]")
    edge_length: Positive | None = Field(default=None, description="mean edge [m]; default: 0.08 of the height")

    def build(self, order: int = 1) -> TetMesh:
        return shapes.gummy_bear(self.height, self.edge_length or 0.08 * self.height, order)


ShapeModel = Annotated[
    BoxShapeModel
    | SphereShapeModel
    | SphericalShellShapeModel
    | CylinderShapeModel
    | TorusShapeModel
    | GummyBearShapeModel,
    Field(discriminator="kind"),
]


class GummyBearSurfaceModel(Model):
    """The surface of the gummy bear, at any resolution."""

    kind: Literal["gummy_bear"]
    height: Positive = Field(default=1.0, description="[m]")
    resolution: Count = Field(default=64, description="its height in mean edges")

    def build_surface(self) -> SurfaceMesh:
        return shapes.gummy_bear_surface(self.height, self.resolution)


SurfaceShapeModel = Annotated[
    BoxShapeModel | SphereShapeModel | CylinderShapeModel | TorusShapeModel | GummyBearSurfaceModel,
    Field(discriminator="kind"),
]
