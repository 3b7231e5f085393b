"""Obstacles of a scene file, by `kind`."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from supple.scene.obstacles import Box, HalfSpace, Obstacle, Sphere, TriangleObstacle
from supple.scene_file.entries.mesh_sources import MeshStore, SurfaceModel
from supple.scene_file.entries.motions import KeyframesModel
from supple.scene_file.located import at
from supple.scene_file.model import Model, Name, NonNegative, Positive, Vector

Extents = Annotated[list[Positive], Field(min_length=3, max_length=3)]


class _ObstacleModel(Model):
    name: Name | None = Field(default=None, description="stands in messages and exports")
    friction: NonNegative = Field(default=0.0, description="Coulomb coefficient against every body")
    motion: KeyframesModel | None = Field(default=None, description="scripted motion; it stands still without it")

    def shared(self) -> dict[str, Any]:
        with at("motion"):
            motion = self.motion.build() if self.motion else None
        return {"name": self.name, "friction": self.friction, "motion": motion}


class HalfSpaceModel(_ObstacleModel):
    """Everything behind a plane: a floor, a wall."""

    kind: Literal["half_space"]
    point: Vector = Field(default=[0.0, 0.0, 0.0], description="a point of the plane [m]")
    normal: Vector = Field(default=[0.0, 1.0, 0.0], description="towards the free side")

    def build(self, meshes: MeshStore) -> Obstacle:
        return HalfSpace(point=self.point, normal=self.normal, **self.shared())


class BoxModel(_ObstacleModel):
    """A solid box, or a room that keeps bodies in."""

    kind: Literal["box"]
    center: Vector = Field(default=[0.0, 0.0, 0.0], description="[m]")
    size: Extents = Field(default=[1.0, 1.0, 1.0], description="full edge lengths [m]")
    rotation: Vector = Field(default=[0.0, 0.0, 0.0], description="rotation vector about the center [rad]")
    inside: bool = Field(default=False, description="true where bodies live inside")

    def build(self, meshes: MeshStore) -> Obstacle:
        return Box(center=self.center, size=self.size, rotation=self.rotation, inside=self.inside, **self.shared())


class SphereModel(_ObstacleModel):
    """A solid ball, or a bowl that keeps bodies in."""

    kind: Literal["sphere"]
    center: Vector = Field(default=[0.0, 0.0, 0.0], description="[m]")
    radius: Positive = Field(default=1.0, description="[m]")
    inside: bool = Field(default=False, description="true where bodies live inside")

    def build(self, meshes: MeshStore) -> Obstacle:
        return Sphere(center=self.center, radius=self.radius, inside=self.inside, **self.shared())


class TrianglesModel(_ObstacleModel):
    """A rigid triangle mesh: solid where it is closed, a two-sided sheet where it is open."""

    kind: Literal["triangles"]
    surface: SurfaceModel = Field(description="where it is at time 0 [m]")

    def build(self, meshes: MeshStore) -> Obstacle:
        with at("surface"):
            surface = meshes.surface(self.surface)
        return TriangleObstacle(surface=surface, **self.shared())


ObstacleModel = Annotated[HalfSpaceModel | BoxModel | SphereModel | TrianglesModel, Field(discriminator="kind")]
