"""Joints without motors: ball, fixed, planar and universal (Cardan's, or Hooke's) joints."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import SceneError
from supple.kinds.validators import POSITIVE, Direction, Limits
from supple.scene.joints.joint import Conditions, Function, Joint

# The swing has no direction at zero and at half a turn: limits stay away from them.
_SWINGS = (0.01, np.pi - 0.01)


@dataclass(frozen=True, eq=False)
class BallJoint(Joint):
    """Two bodies that share a point and turn about it; see `Joint`.

    Parameters
    ----------
    axis : (3,) a direction in the world where the scene places everything, of any length [-]; the first has it, and the
        second. None: without a limit.
    max_swing : the largest angle between the two, from 0.01 to pi - 0.01 [rad]: the axis of the first stays in a cone
        about that of the second. The coordinate is this angle.
    twist_limits : the smallest and the largest turn of the first about the axis against the second (low, high), between
        -pi + 0.01 and pi - 0.01 [rad]; the swing follows the turn. None: turns about the axis are free.

    Raises
    ------
    SceneError : where a value is of the wrong kind, a point is missing, both ends are one body, or only one of `axis`
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
                raise SceneError(f"{self.label}: twist_limits need axis and max_swing, which define the twist")
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


@dataclass(frozen=True, eq=False)
class PlanarJoint(Joint):
    """Two bodies of which one shifts in a plane of the other and turns about the plane's normal; see `Joint`.

    Parameters
    ----------
    axis : (3,) the normal of the plane in the world where the scene places everything, of any length [-]; it moves with
        the second.

    Raises
    ------
    SceneError : where a value is of the wrong kind, or both ends are one body.
    """

    kind: ClassVar[str] = "planar"

    axis: Annotated[ArrayLike, Direction()] = (0.0, 0.0, 1.0)

    def conditions(self) -> Conditions:
        height = Function("product", ("apart", "second.0"), vanishes=True)
        return Conditions(together=False, parallel=(0,), functions=(height,), lines=("second.0",))


@dataclass(frozen=True, eq=False)
class UniversalJoint(Joint):
    """Two bodies that share a point and two perpendicular axes about which they turn; see `Joint`.

    Each axis moves with one of the bodies, and they stay perpendicular. No other turn is free: the joint carries the
    torque about the normal of both axes, as between two shafts.

    Parameters
    ----------
    axis : (3,) the axis that moves with the first, in the world where the scene places everything, of any length [-].
    second_axis : (3,) the axis that moves with the second, perpendicular to the other there, of any length [-].
    max_swing : the largest angle between the shafts, the normals of both axes on the two bodies, from 0.01 to
        pi - 0.01 [rad]. The coordinate is this angle. None: no limit, and no coordinate.

    Raises
    ------
    SceneError : where a value is of the wrong kind or out of range, a point is missing, both ends are one body, or the
        axes are not perpendicular.
    """

    kind: ClassVar[str] = "universal"
    required: ClassVar[tuple[str, ...]] = ("point",)

    axis: Annotated[ArrayLike, Direction()] = (1.0, 0.0, 0.0)
    second_axis: Annotated[ArrayLike, Direction()] = (0.0, 0.0, 1.0)
    max_swing: Annotated[float | None, POSITIVE] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        cosine = float(np.dot(np.asarray(self.axis), np.asarray(self.second_axis)))
        if abs(cosine) > 1e-9:
            raise SceneError(
                f"{self.label}: axis and second_axis are at {np.degrees(np.arccos(cosine)):.6g} degrees; give "
                "perpendicular ones"
            )
        if self.max_swing is not None:
            check_swing(self.max_swing, self.label)

    def axes(self) -> NDArray[np.float64]:
        first, second = np.asarray(self.axis), np.asarray(self.second_axis)
        return np.array([first, second, np.cross(first, second)])

    def conditions(self) -> Conditions:
        functions = [Function("product", ("first.0", "second.1"), vanishes=True)]
        if self.max_swing is not None:
            functions.append(Function("cosine", ("first.2", "second.2"), (0.0, self.max_swing)))
        return Conditions(functions=tuple(functions), lines=("first.0", "second.1"))
