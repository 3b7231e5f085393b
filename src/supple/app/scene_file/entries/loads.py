"""Loads of a scene file, by `kind`."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from supple.app.scene_file.entries.selections import InBoxModel
from supple.app.scene_file.model import Index, Model, Name, NonNegative, Number, Positive, Vector
from supple.scene.actuators.muscle import Muscle
from supple.scene.loads.body_force import BodyForce
from supple.scene.loads.growth import Growth
from supple.scene.loads.load import Load, Region
from supple.scene.loads.over_time import Curve
from supple.scene.loads.points import Point
from supple.scene.loads.spring import Spring
from supple.scene.loads.surface_loads import Pressure, Traction
from supple.scene.loads.tet_region import TetRegion
from supple.scene.located import at
from supple.scene.selection import InBox


class CurveModel(Model):
    """Piecewise linear values over time, constant before the first and after the last."""

    times: list[Number] = Field(min_length=1, description="strictly increasing [s]")
    values: list[Number] | list[Vector] = Field(min_length=1, description="one per time")


def over_time(value: Any, key: str) -> Any:
    """A `Curve` of a curve; a constant as it is. Errors get the key."""
    if isinstance(value, CurveModel):
        with at(key):
            return Curve(value.times, value.values)
    return value


class OnSurfaceModel(Model):
    """What acts on, or feels, a part of the surface of a body."""

    body: Name = Field(description="name of the body")
    box: InBoxModel | None = Field(default=None, description="triangles of the surface inside; without it, all")
    triangles: list[Index] | None = Field(default=None, min_length=1, description="instead of `box`: their numbers")
    name: Name | None = Field(default=None, description="used in messages")

    def region(self) -> Region:
        if self.box is None:
            return self.triangles
        with at("box"):
            return InBox(self.box.low, self.box.high)


class TractionModel(OnSurfaceModel):
    """A force per area at rest that keeps its direction."""

    kind: Literal["traction"]
    traction: Vector | CurveModel = Field(description="[N/m^2], or a curve")

    def build(self) -> Load:
        return Traction(self.body, over_time(self.traction, "traction"), self.region(), self.name)


class PressureModel(OnSurfaceModel):
    """A force per present area along the inward normal."""

    kind: Literal["pressure"]
    pressure: Number | CurveModel = Field(description="[Pa], or a curve")

    def build(self) -> Load:
        return Pressure(self.body, over_time(self.pressure, "pressure"), self.region(), self.name)


class BodyForceModel(Model):
    """A force per mass on one body, or on all."""

    kind: Literal["body_force"]
    force: Vector | CurveModel = Field(description="[N/kg], or a curve")
    body: Name | None = Field(default=None, description="name of the body; all without it")
    name: Name | None = Field(default=None, description="used in messages")

    def build(self) -> Load:
        return BodyForce(over_time(self.force, "force"), self.body, self.name)


class PointModel(Model):
    """A point of a body, or of the world."""

    alternatives = ("vertex", "place", "give the point by either `vertex` or `place`")

    body: Name | None = Field(default=None, description="without it, `place` is fixed in the world")
    vertex: Index | None = Field(default=None, description="a vertex of the body's mesh, from 0")
    place: Vector | None = Field(default=None, description="instead of `vertex`: in the coordinates of the mesh [m]")

    def point(self) -> Point:
        return self.body, self.place if self.vertex is None else self.vertex


class SpringModel(Model):
    """A spring between two points."""

    kind: Literal["spring"]
    first: PointModel
    second: PointModel
    stiffness: Positive = Field(description="[N/m]")
    rest_length: Number | CurveModel | None = Field(
        default=None, description="[m], or a curve; without it, the distance at the start"
    )
    name: Name | None = Field(default=None, description="used in messages")

    def build(self) -> Load:
        rest_length = over_time(self.rest_length, "rest_length")
        return Spring(self.first.point(), self.second.point(), self.stiffness, rest_length, self.name)


class ForceLengthModel(Model):
    """A force-length curve, linear between stretches and constant outside."""

    stretches: list[Positive] = Field(min_length=1, description="increasing")
    values: list[NonNegative] = Field(min_length=1, description="one per stretch")


class InTetsModel(Model):
    """What acts in tets of a body."""

    body: Name = Field(description="name of the body")
    box: InBoxModel | None = Field(default=None, description="tets inside; without it, all")
    tets: list[Index] | None = Field(default=None, min_length=1, description="instead of `box`: their numbers")
    name: Name | None = Field(default=None, description="used in messages")

    def region(self) -> TetRegion:
        if self.box is None:
            return self.tets
        with at("box"):
            return InBox(self.box.low, self.box.high)


class MuscleModel(InTetsModel):
    """Fibres that pull along their direction."""

    kind: Literal["muscle"]
    strength: Positive = Field(description="largest stress per area at rest [Pa]")
    direction: Vector = Field(description="of the fibres, in the coordinates of the mesh")
    activation: NonNegative | CurveModel = Field(default=1.0, description="from 0 to 1, or a curve")
    force_length: ForceLengthModel | None = Field(default=None, description="without it, 1 at all stretches")

    def build(self) -> Load:
        curve = None if self.force_length is None else (self.force_length.stretches, self.force_length.values)
        activation = over_time(self.activation, "activation")
        return Muscle(self.body, self.strength, self.direction, activation, self.region(), curve, self.name)


class GrowthModel(InTetsModel):
    """A stretch of the stress-free shape."""

    kind: Literal["growth"]
    stretch: Positive | CurveModel = Field(description="of lengths [-], or a curve")
    direction: Vector | None = Field(default=None, description="in the coordinates of the mesh; without it, all")

    def build(self) -> Load:
        return Growth(self.body, over_time(self.stretch, "stretch"), self.direction, self.region(), self.name)


LoadModel = Annotated[
    TractionModel | PressureModel | BodyForceModel | SpringModel | MuscleModel | GrowthModel,
    Field(discriminator="kind"),
]
