"""Joints with an axis and one coordinate: `HingeJoint` and `SliderJoint`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from numpy.typing import ArrayLike

from supple.errors import SceneError
from supple.scene.joints.joint import Joint, checked_limits
from supple.scene.joints.motors import Motor
from supple.scene.values import non_negative, positive, unit_vector


@dataclass(frozen=True, eq=False)
class AxisJoint(Joint):
    """A joint with one coordinate, which may be limited and driven.

    Parameters
    ----------
    axis : (3,) its direction in the world where the scene places everything, of any length [-]; it moves with the
        second.
    limits : the smallest and the largest coordinate, (low, high) [rad] or [m]; an end may be infinite. None: no limits.
    motor : `PositionMotor`, `VelocityMotor` or `ForceMotor`; None: it moves freely.
    damping : effort against each unit of its rate [N m s/rad] or [N s/m].
    friction : largest effort of dry friction [N m] or [N], which holds the joint until the load exceeds it.
    max_effort : largest effort of its motor [N m] or [N], beside the `max_force` of that motor; None: no bound.
    max_velocity : largest rate of its coordinate in both directions [rad/s] or [m/s], the mean over a step: a limit
        with whatever effort that takes, as of the coordinate; None: no bound. Equilibria have no rates.
    """

    axis: ArrayLike = (0.0, 0.0, 1.0)
    limits: tuple[float, float] | None = None
    motor: Motor | None = None
    damping: float = 0.0
    friction: float = 0.0
    max_effort: float | None = None
    max_velocity: float | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "axis", unit_vector(self.axis, f"{self.label}: axis"))
        if self.limits is not None:
            object.__setattr__(self, "limits", checked_limits(self.limits, f"{self.label}: limits"))
        if self.motor is not None and not isinstance(self.motor, Motor):
            raise SceneError(f"{self.label}: motor is {self.motor!r}; give PositionMotor(...) or another motor")
        for key in ("damping", "friction"):
            object.__setattr__(self, key, non_negative(getattr(self, key), f"{self.label}: {key}"))
        if self.max_velocity is not None:
            object.__setattr__(self, "max_velocity", positive(self.max_velocity, f"{self.label}: max_velocity"))
        if self.max_effort is not None:
            object.__setattr__(self, "max_effort", positive(self.max_effort, f"{self.label}: max_effort"))
            if self.motor is not None:
                object.__setattr__(self, "motor", self.motor.bounded(self.max_effort))


@dataclass(frozen=True, eq=False)
class HingeJoint(AxisJoint):
    """Two bodies that turn against each other about an axis; see `Joint` and `AxisJoint`.

    The coordinate is the angle [rad] by which the first has turned about the axis against the second, over all turns:
    limits and targets may be many turns away. At a start it is the one nearest to zero of those between the limits.

    Raises
    ------
    SceneError : where a value is of the wrong kind or out of range, there is no point, or both ends are one body.
    """

    kind: ClassVar[str] = "hinge"
    needs_point: ClassVar[bool] = True


@dataclass(frozen=True, eq=False)
class SliderJoint(AxisJoint):
    """Two bodies that shift against each other along an axis, and do not turn; see `Joint` and `AxisJoint`.

    The coordinate is the travel [m] of the first along the axis against the second.

    Raises
    ------
    SceneError : where a value is of the wrong kind or out of range, or both ends are one body.
    """

    kind: ClassVar[str] = "slider"
