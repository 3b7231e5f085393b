"""A joint that allows rotations about all axes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from supple.errors import SceneError
from supple.kinds.forms import POSITIVE, Direction, Limits
from supple.scene.joints.conditions import Conditions, Function
from supple.scene.joints.joint import Joint

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
    required: ClassVar[tuple[str, ...]] = ("point",)

    axis: Annotated[ArrayLike | None, Direction()] = None
    max_swing: Annotated[float | None, POSITIVE] = None
    twist_limits: Annotated[tuple[float, float] | None, Limits()] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if (self.axis is None) != (self.max_swing is None):
            raise SceneError(f"{self.label}: a limit needs both axis and max_swing; give both, or none")
        if self.axis is None or self.max_swing is None:
            if self.twist_limits is not None:
                raise SceneError(f"{self.label}: twist_limits need axis and max_swing, without which there is no twist")
            return
        check_swing(self.max_swing, self.label)
        low, high = self.twist_limits or (0.0, 0.0)
        if max(-low, high) > _SWINGS[1]:
            raise SceneError(
                f"{self.label}: twist_limits are ({low:g}, {high:g}); give two from {-_SWINGS[1]:.4g} to "
                f"{_SWINGS[1]:.4g}"
            )

    def conditions(self) -> Conditions:
        if self.max_swing is None:
            return Conditions()
        functions = [Function("cosine", ("first.0", "second.0"), (0.0, self.max_swing))]
        if self.twist_limits is not None:
            functions.append(Function("twist", ("first.1", "second.1", "second.2", "first.2"), self.twist_limits))
        return Conditions(functions=tuple(functions))


def check_swing(max_swing: float, label: str) -> None:
    """Raise `SceneError` where the largest swing is near zero or half a turn [rad]."""
    if not _SWINGS[0] <= max_swing <= _SWINGS[1]:
        raise SceneError(f"{label}: max_swing is {max_swing:g} rad; give one from {_SWINGS[0]:g} to {_SWINGS[1]:.4g}")
