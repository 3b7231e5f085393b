"""A joint that allows rotations about all axes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from supple.errors import SceneError
from supple.scene.joints.joint import Joint, checked_limits
from supple.scene.values import positive, unit_vector

# The swing has no direction at zero and at half a turn: limits stay away from them.
_SWINGS = (0.01, np.pi - 0.01)


@dataclass(frozen=True, eq=False)
class BallJoint(Joint):
    """Two bodies that share a point and turn about it; see `Joint`.

    Parameters
    ----------
    axis : (3,) a direction in the world where the scene places everything, of any length [-]; the first has it, and the
        second. None: there is no limit.
    max_swing : the largest angle between the two, from 0.01 to pi - 0.01 [rad]: the axis of the first stays in a cone
        about that of the second. The coordinate is this angle.
    twist_limits : the smallest and the largest turn of the first about the axis against the second (low, high), between
        -pi + 0.01 and pi - 0.01 [rad]; the swing follows the turn. None: turns about the axis are free.

    Raises
    ------
    SceneError : where a value is of the wrong kind, there is no point, both ends are one body, or only one of `axis`
        and `max_swing` is given, or `twist_limits` without them.
    """

    kind: ClassVar[str] = "ball"
    needs_point: ClassVar[bool] = True

    axis: ArrayLike | None = None
    max_swing: float | None = None
    twist_limits: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if (self.axis is None) != (self.max_swing is None):
            raise SceneError(f"{self.label}: a limit needs both axis and max_swing; give both, or none")
        if self.axis is None or self.max_swing is None:
            if self.twist_limits is not None:
                raise SceneError(f"{self.label}: twist_limits need axis and max_swing, without which there is no twist")
            return
        object.__setattr__(self, "axis", unit_vector(self.axis, f"{self.label}: axis"))
        object.__setattr__(self, "max_swing", positive(self.max_swing, f"{self.label}: max_swing"))
        if not _SWINGS[0] <= self.max_swing <= _SWINGS[1]:
            raise SceneError(
                f"{self.label}: max_swing is {self.max_swing:g} rad; give one from {_SWINGS[0]:g} to {_SWINGS[1]:.4g}"
            )
        if self.twist_limits is not None:
            low, high = checked_limits(self.twist_limits, f"{self.label}: twist_limits")
            if max(-low, high) > _SWINGS[1]:
                raise SceneError(
                    f"{self.label}: twist_limits are ({low:g}, {high:g}); give two from {-_SWINGS[1]:.4g} to "
                    f"{_SWINGS[1]:.4g}"
                )
            object.__setattr__(self, "twist_limits", (low, high))
