"""Motors of hinges and sliders: what drives the angle or the travel of a joint.

For a slider, the coordinate of a joint is its travel [m] and the effort of a motor is a force [N]; for a hinge, they
are an angle [rad] and a torque [N m]. A positive effort pushes the first body towards a larger coordinate.
"""

from __future__ import annotations

from abc import ABC
from dataclasses import dataclass, replace
from typing import Annotated, Any, ClassVar, cast

import numpy as np

from supple.errors import SceneError
from supple.kinds.kind import Kind
from supple.kinds.validators import NON_NEGATIVE, POSITIVE
from supple.scene.loads.over_time import OverTime, OverTimeOf, value_at

_SCRIPT = OverTimeOf(inputs=True)


class Motor(Kind, ABC):
    """The base class of motors.

    Attributes
    ----------
    max_force : largest effort [N], [N m]; None where it has no bound
    driven_by : the field with the target, or the effort, over time
    """

    driven_by: ClassVar[str] = "target"

    max_force: float | None = None

    @property
    def label(self) -> str:
        """The kind of this motor in messages."""
        return type(self).__name__

    @property
    def script(self) -> OverTime:
        """What drives it, over time: a target, or an effort."""
        return getattr(self, self.driven_by)

    def at(self, time: float) -> float:
        """The target, or the effort, at `time` [s].

        Raises
        ------
        SceneError : where a function of time gives no finite number.
        """
        return float(value_at(self.script, time, f"{self.label}: its function of time", ()))

    def scripted(self, script: OverTime) -> Motor:
        """The same motor with another script."""
        return replace(cast(Any, self), **{self.driven_by: script})

    def bounded(self, most: float) -> Motor:
        """The same motor with an effort of at most `most`."""
        most = most if self.max_force is None else min(self.max_force, most)
        return replace(cast(Any, self), max_force=most)


@dataclass(frozen=True, eq=False)
class PositionMotor(Motor):
    """Pulls the coordinate q to a target: the effort k (target - q) + d (rate of the target - rate of q).

    The rates are means over a time step. Angles count over all turns.

    Parameters
    ----------
    target : [m] or [rad]; a number, a `Curve`, or a function of time.
    stiffness : k [N/m] or [N m/rad], zero or more.
    damping : d [N s/m] or [N m s/rad], zero or more; not zero together with the stiffness.
    max_force : largest effort [N] or [N m]; None: no bound.

    Raises
    ------
    SceneError : where a value is of the wrong kind or out of range.
    """

    kind: ClassVar[str] = "position"

    target: Annotated[OverTime, _SCRIPT]
    stiffness: Annotated[float, NON_NEGATIVE]
    damping: Annotated[float, NON_NEGATIVE] = 0.0
    max_force: Annotated[float | None, POSITIVE] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.stiffness == 0.0 and self.damping == 0.0:
            raise SceneError(f"{self.label}: stiffness and damping are both zero, so that it has no effect; give one")


@dataclass(frozen=True, eq=False)
class VelocityMotor(Motor):
    """Gives the coordinate the rate `target` with the effort that is needed, up to `max_force`.

    With the target 0 it is a brake, or dry friction: it holds the coordinate until the load exceeds `max_force`. It
    stops at the limits of its joint.

    Parameters
    ----------
    target : [m/s] or [rad/s]; a number, a `Curve`, or a function of time.
    max_force : largest effort [N] or [N m]; None: no bound.

    Raises
    ------
    SceneError : where a value is of the wrong kind or out of range.
    """

    kind: ClassVar[str] = "velocity"

    target: Annotated[OverTime, _SCRIPT]
    max_force: Annotated[float | None, POSITIVE] = None


@dataclass(frozen=True, eq=False)
class ForceMotor(Motor):
    """An effort that is given.

    Parameters
    ----------
    force : [N] for a slider, a torque [N m] for a hinge; a number, a `Curve`, or a function of time.
    max_force : where the effort is cut off [N] or [N m]; None: it is not cut off.

    Raises
    ------
    SceneError : where a value is of the wrong kind or out of range.
    """

    kind: ClassVar[str] = "force"
    driven_by: ClassVar[str] = "force"

    force: Annotated[OverTime, _SCRIPT]
    max_force: Annotated[float | None, POSITIVE] = None

    def at(self, time: float) -> float:
        most = np.inf if self.max_force is None else self.max_force
        return float(np.clip(super().at(time), -most, most))


MOTORS: tuple[type[Motor], ...] = (PositionMotor, VelocityMotor, ForceMotor)
