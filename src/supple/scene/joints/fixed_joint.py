"""A joint that allows no motion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from supple.scene.joints.conditions import Conditions
from supple.scene.joints.joint import Joint


@dataclass(frozen=True, eq=False)
class FixedJoint(Joint):
    """Two bodies that do not move against each other; see `Joint`.

    Raises
    ------
    SceneError : where a value is of the wrong kind, or both ends are one body.
    """

    kind: ClassVar[str] = "fixed"

    def conditions(self) -> Conditions:
        return Conditions(parallel=(0, 1, 2))
