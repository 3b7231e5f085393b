"""Motors of hinges and sliders: what drives the angle or the travel of a joint.

For a slider, the coordinate of a joint is its travel [m] and the effort of a motor is a force [N]; for a hinge, they
are an angle [rad] and a torque [N m]. A positive effort pushes the first body towards a larger coordinate.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np

from supple.errors import SceneError
from supple.scene.loads.over_time import OverTime, checked_over_time, value_at
from supple.scene.values import non_negative, positive


class Motor(ABC):
    """The base class of motors.

    Attributes
    ----------
    max_force : largest effort [N], [N m]; None where it has no bound
    """

    max_force: float | None = None

    @property
    def label(self) -> str:
        """The kind of this motor in messages."""
        return type(self).__name__

    @property
    @abstractmethod
    def script(self) -> OverTime:
        """What drives it, over time: a target, or an effort."""

    def at(self, time: float) -> float:
        """The target, or the effort, at `time` [s].

        Raises
        ------
        SceneError : where a function of time gives no finite number.
        """
        return float(value_at(self.script, time, f"{self.label}: its function of time", ()))

    @abstractmethod
    def scripted(self, script: OverTime) -> Motor:
        """The same motor with another script."""

    def bounded(self, most: float) -> Motor:
        """The same motor with an effort of at most `most`."""
        most = most if self.max_force is None else min(self.max_force, most)
        return replace(cast(Any, self), max_force=most)

    def _check_max_force(self) -> None:
        if self.max_force is not None:
            object.__setattr__(self, "max_force", positive(self.max_force, f"{self.label}: max_force"))


@dataclass(frozen=True, eq=False)
class PositionMotor(Motor):
    """Pulls the coordinate q to a target: the effort k (target - q) + d (rate of the target - rate of q).

    The rates are means over a time step. Angles count over all turns.

    Parameters
    ----------
    target : [m] or [rad]; a number, a `Curve`, or a function of time [s].
    stiffness : k [N/m] or [N m/rad], zero or more.
    damping : d [N s/m] or [N m s/rad], zero or more; not zero together with the stiffness.
    max_force : largest effort [N] or [N m]; None: no bound.

    Raises
    ------
    SceneError : where a value is of the wrong kind or out of range.
    """

    target: OverTime
    stiffness: float
    damping: float = 0.0
    max_force: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "target", checked_over_time(self.target, f"{self.label}: target", ()))
        for key in ("stiffness", "damping"):
            object.__setattr__(self, key, non_negative(getattr(self, key), f"{self.label}: {key}"))
        if self.stiffness == 0.0 and self.damping == 0.0:
            raise SceneError(f"{self.label}: stiffness and damping are both zero, so that it has no effect; give one")
        self._check_max_force()

    @property
    def script(self) -> OverTime:
        return self.target

    def scripted(self, script: OverTime) -> Motor:
        return replace(self, target=script)


@dataclass(frozen=True, eq=False)
class VelocityMotor(Motor):
    """Gives the coordinate the rate `target` with whatever effort that takes, up to `max_force`.

    With the target 0 it is a brake, or dry friction: it holds the coordinate until the load exceeds `max_force`. It
    stops at the limits of its joint.

    Parameters
    ----------
    target : [m/s] or [rad/s]; a number, a `Curve`, or a function of time [s].
    max_force : largest effort [N] or [N m]; None: no bound.

    Raises
    ------
    SceneError : where a value is of the wrong kind or out of range.
    """

    target: OverTime
    max_force: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "target", checked_over_time(self.target, f"{self.label}: target", ()))
        self._check_max_force()

    @property
    def script(self) -> OverTime:
        return self.target

    def scripted(self, script: OverTime) -> Motor:
        return replace(self, target=script)


@dataclass(frozen=True, eq=False)
class ForceMotor(Motor):
    """An effort that is given.

    Parameters
    ----------
    force : [N] for a slider, a torque [N m] for a hinge; a number, a `Curve`, or a function of time [s].
    max_force : where the effort is cut off [N] or [N m]; None: nowhere.

    Raises
    ------
    SceneError : where a value is of the wrong kind or out of range.
    """

    force: OverTime
    max_force: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "force", checked_over_time(self.force, f"{self.label}: force", ()))
        self._check_max_force()

    def at(self, time: float) -> float:
        most = np.inf if self.max_force is None else self.max_force
        return float(np.clip(super().at(time), -most, most))

    @property
    def script(self) -> OverTime:
        return self.force

    def scripted(self, script: OverTime) -> Motor:
        return replace(self, force=script)
