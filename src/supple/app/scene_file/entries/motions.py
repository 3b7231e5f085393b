"""Keyframes of a scene file."""

from __future__ import annotations

from pydantic import Field

from supple.app.scene_file.model import Model, Number, Vector
from supple.scene.located import at
from supple.scene.motion import Keyframes


class KeyframesModel(Model):
    """Piecewise linear motion, constant before the first keyframe and after the last."""

    times: list[Number] = Field(min_length=1, description="strictly increasing [s]")
    displacements: list[Vector] | None = Field(default=None, description="one per time [m]")
    angles: list[Number] | None = Field(default=None, description="one per time [rad]")
    axis: Vector = Field(default=[0.0, 0.0, 1.0], description="axis of the angles")
    pivot: Vector = Field(default=[0.0, 0.0, 0.0], description="a point on that axis [m]")
    rotations: list[Vector] | None = Field(
        default=None, description="in place of angles: rotation vectors about the pivot, one per time [rad]"
    )


def built_motion(described: KeyframesModel | None) -> Keyframes | None:
    """The keyframes of the entry's key `motion`, if it has one."""
    with at("motion"):
        return Keyframes(**described.model_dump()) if described is not None else None
