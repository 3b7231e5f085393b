"""Cables of a scene file."""

from __future__ import annotations

from pydantic import Field

from supple.app.scene_file.entries.loads import CurveModel, PointModel, over_time
from supple.app.scene_file.model import Model, Name, NonNegative, Number, Positive
from supple.scene.actuators.cable import Cable


class CableModel(Model):
    """A cable through points of bodies; give one of `length`, `tension` and `winch_speed`."""

    points: list[PointModel] = Field(min_length=2, description="fixed end, eyelets, winch")
    length: NonNegative | CurveModel | None = Field(default=None, description="without tension [m], or a curve")
    tension: NonNegative | CurveModel | None = Field(default=None, description="at the winch [N], or a curve")
    winch_speed: Number | CurveModel | None = Field(default=None, description="[m/s], or a curve; below 0: releases")
    stiffness: Positive | None = Field(default=None, description="with `length` and `winch_speed` [N/m]")
    friction: NonNegative = Field(default=0.0, description="coefficient at the eyelets")
    name: Name = Field(default="cable", description="in reports")

    def build(self) -> Cable:
        drives = {key: over_time(getattr(self, key), key) for key in ("length", "tension", "winch_speed")}
        points = [point.point() for point in self.points]
        return Cable(points, **drives, stiffness=self.stiffness, friction=self.friction, name=self.name)
