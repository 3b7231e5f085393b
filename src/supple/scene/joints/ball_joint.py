"""A joint that allows all rotations."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from supple.scene.joints.joint import Joint


@dataclass(frozen=True, eq=False)
class BallJoint(Joint):
    """Two bodies that share a point and turn about it freely; see `Joint`.

    Raises
    ------
    SceneError : where a value is of the wrong kind, there is no point, or both ends are one body.
    """

    kind: ClassVar[str] = "ball"
    needs_point: ClassVar[bool] = True
