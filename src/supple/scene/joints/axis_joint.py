"""Joints with an axis and one coordinate: `HingeJoint` and `SliderJoint`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.kinds.validators import ANY_NUMBER, NON_NEGATIVE, POSITIVE, Direction, Limits, OneOf
from supple.scene.joints.joint import FREE, Conditions, Function, Joint
from supple.scene.joints.motors import MOTORS, Motor
from supple.scene.rotation import rotation_matrix


@dataclass(frozen=True, eq=False)
class AxisJoint(Joint):
    """A joint with one coordinate, which may be limited and driven.

    Parameters
    ----------
    axis : (3,) its direction in the world where the scene places everything, of any length [-]; it moves with the
        second.
    start : the coordinate where the scene places everything [rad] or [m].
    limits : the smallest and the largest coordinate, (low, high) [rad] or [m]; an end may be infinite. None: no limits.
    motor : `PositionMotor`, `VelocityMotor` or `ForceMotor`; None: it moves freely.
    damping : effort against each unit of its rate [N m s/rad] or [N s/m].
    friction : largest effort of dry friction [N m] or [N], which holds the joint until the load exceeds it.
    max_effort : largest effort of its motor [N m] or [N], beside the `max_force` of that motor; None: no bound.
    max_velocity : largest rate of its coordinate in both directions [rad/s] or [m/s], the mean over a step: a limit
        with any effort that is needed, as of the coordinate; None: no bound. Equilibria have no rates.
    """

    axis: Annotated[ArrayLike, Direction()] = (0.0, 0.0, 1.0)
    start: Annotated[float, ANY_NUMBER] = 0.0
    limits: Annotated[tuple[float, float] | None, Limits("exchange them, or use a FixedJoint")] = None
    motor: Annotated[Motor | None, OneOf(MOTORS, "PositionMotor(...) or another motor", Motor)] = None
    damping: Annotated[float, NON_NEGATIVE] = 0.0
    friction: Annotated[float, NON_NEGATIVE] = 0.0
    max_effort: Annotated[float | None, POSITIVE] = None
    max_velocity: Annotated[float | None, POSITIVE] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.max_effort is not None and self.motor is not None:
            object.__setattr__(self, "motor", self.motor.bounded(self.max_effort))


@dataclass(frozen=True, eq=False)
class HingeJoint(AxisJoint):
    """Two bodies that turn against each other about an axis; see `Joint` and `AxisJoint`.

    The coordinate is the angle [rad] by which the first has turned about the axis against the second, over all turns:
    limits and targets may be many turns away. At a start it is the one nearest to `start` of those between the limits.

    Raises
    ------
    SceneError : where a value is of the wrong kind or out of range, a point is missing, or both ends are one body.
    """

    kind: ClassVar[str] = "hinge"
    required: ClassVar[tuple[str, ...]] = ("point",)

    def motion_to_start(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        R, point = rotation_matrix(self.start * np.asarray(self.axis)), np.asarray(self.point)
        return R, point - R @ point

    def conditions(self) -> Conditions:
        angle = Function("angle", ("first.1", "second.1", "second.2"), self.limits or FREE)
        return Conditions(parallel=(0,), functions=(angle,), lines=("second.0",))


@dataclass(frozen=True, eq=False)
class SliderJoint(AxisJoint):
    """Two bodies that shift against each other along an axis, and do not turn; see `Joint` and `AxisJoint`.

    The coordinate is the travel [m] of the first along the axis against the second.

    Raises
    ------
    SceneError : where a value is of the wrong kind or out of range, or both ends are one body.
    """

    kind: ClassVar[str] = "slider"

    def motion_to_start(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        return np.eye(3), self.start * np.asarray(self.axis)

    def conditions(self) -> Conditions:
        travel = Function("product", ("apart", "second.0"), self.limits or FREE)
        across = [Function("product", ("apart", f"second.{k}"), vanishes=True) for k in (1, 2)]
        return Conditions(together=False, parallel=(0, 1, 2), functions=(travel, *across), lines=("second.0",))
