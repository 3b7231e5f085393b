"""Laws of the generalized force Q of an actuator as a function of its coordinate s."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass


class ForceLaw(ABC):
    """A law at one time."""

    @abstractmethod
    def energy(self, s: float) -> float:
        """Minus the integral of Q [J]; +inf where s is not allowed."""

    @abstractmethod
    def force(self, s: float) -> float:
        """Q"""

    @abstractmethod
    def stiffness(self, s: float) -> float:
        """-dQ/ds, zero or more."""

    def renew(self, s: float) -> None:
        """Take the unknown of this law, where it has one, from the end of a Newton direction with the coordinate s."""
        return


class Law(ABC):
    """A law over time."""

    @abstractmethod
    def at(self, time: float, penalty: float) -> ForceLaw:
        """For the minimization of a step to `time` [s]; penalty : a stiffness that is large beside that of the body."""

    @abstractmethod
    def reached(self, time: float, s: float, mobility: float) -> float:
        """The force Q with which s ends at s + mobility Q, as the law says, at `time` [s].

        Parameters
        ----------
        s : without Q; mobility : above zero
        """


@dataclass(frozen=True)
class Constant(ForceLaw):
    """One force, whatever the coordinate; the energy is zero at `origin`."""

    Q: float
    origin: float

    def energy(self, s: float) -> float:
        return -self.Q * (s - self.origin)

    def force(self, s: float) -> float:
        return self.Q

    def stiffness(self, s: float) -> float:
        return 0.0


@dataclass(frozen=True)
class GivenForce(Law):
    """A force as a function of time; origin : where its energy is zero."""

    given: Callable[[float], float]
    origin: float

    def at(self, time: float, penalty: float) -> ForceLaw:
        return Constant(self.given(time), self.origin)

    def reached(self, time: float, s: float, mobility: float) -> float:
        return self.given(time)


@dataclass
class Held(ForceLaw):
    """s = target, by the method of multipliers: the energy k/2 (s - target)^2 - lambda (s - target).

    The multiplier is an unknown of the minimization and follows each Newton direction: lambda <- lambda - k (s -
    target) at its end. The error of the linear constraint then decreases with every iteration by a factor of about the
    body's stiffness over k.

    Source: Bertsekas, "Constrained Optimization and Lagrange Multiplier Methods" (1982), chapter 2.
    """

    target: float
    k: float
    multiplier: float = 0.0

    def energy(self, s: float) -> float:
        return (0.5 * self.k * (s - self.target) - self.multiplier) * (s - self.target)

    def force(self, s: float) -> float:
        return self.multiplier - self.k * (s - self.target)

    def stiffness(self, s: float) -> float:
        return self.k

    def renew(self, s: float) -> None:
        self.multiplier = self.force(s)


@dataclass(frozen=True)
class GivenValue(Law):
    """The coordinate as a function of time."""

    target: Callable[[float], float]

    def at(self, time: float, penalty: float) -> ForceLaw:
        return Held(self.target(time), penalty)

    def reached(self, time: float, s: float, mobility: float) -> float:
        return (self.target(time) - s) / mobility


@dataclass(frozen=True)
class Stretch(ForceLaw):
    """A cable of the stiffness k that is `length` long without tension: k/2 max(s - length, 0)^2."""

    k: float
    length: float

    def energy(self, s: float) -> float:
        return 0.5 * self.k * max(s - self.length, 0.0) ** 2

    def force(self, s: float) -> float:
        return -self.k * max(s - self.length, 0.0)

    def stiffness(self, s: float) -> float:
        return self.k if s > self.length else 0.0


@dataclass(frozen=True)
class ElasticCable(Law):
    """A cable with its length without tension as a function of time."""

    k: float
    length: Callable[[float], float]

    def at(self, time: float, penalty: float) -> ForceLaw:
        return Stretch(self.k, self.length(time))

    def reached(self, time: float, s: float, mobility: float) -> float:
        return -self.k * max(s - self.length(time), 0.0) / (1.0 + self.k * mobility)


@dataclass(frozen=True)
class GasPressure(ForceLaw):
    """p = c / V0 (V0 / V)^gamma - ambient, with c = n R T [J]."""

    c: float
    V0: float
    gamma: float
    ambient: float

    def energy(self, s: float) -> float:
        if s <= 0.0:
            return math.inf
        stretch, power = math.log(s / self.V0), 1.0 - self.gamma
        # (V / V0)^power - 1 over power, which becomes the logarithm for gamma = 1.
        expanded = math.expm1(power * stretch) / power if power else stretch
        return self.ambient * (s - self.V0) - self.c * expanded

    def force(self, s: float) -> float:
        return self.c / self.V0 * (self.V0 / s) ** self.gamma - self.ambient

    def stiffness(self, s: float) -> float:
        return self.gamma * self.c / (self.V0 * s) * (self.V0 / s) ** self.gamma


@dataclass(frozen=True)
class GivenGas(Law):
    """An ideal gas; c : time -> n R T [J] at the volume V0."""

    c: Callable[[float], float]
    V0: float
    gamma: float
    ambient: float

    def at(self, time: float, penalty: float) -> GasPressure:
        return GasPressure(self.c(time), self.V0, self.gamma, self.ambient)

    def reached(self, time: float, s: float, mobility: float) -> float:
        """By Newton's method for the volume v = s + mobility p(v), from below, where p is convex and falls."""
        law = self.at(time, 0.0)
        v = min(s, self.V0)
        v = v if v > 0.0 else 1e-6 * self.V0
        while s + mobility * law.force(v) < v:  # start below the solution
            v *= 0.5
        for _ in range(100):
            change = (s + mobility * law.force(v) - v) / (1.0 + mobility * law.stiffness(v))
            v += change
            if abs(change) <= 1e-13 * v:
                break
        return law.force(v)
