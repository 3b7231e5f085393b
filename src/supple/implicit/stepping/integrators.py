"""Time integrators: each turns a step into the minimization of |x - x~|^2_M / (2 s) plus the potential energy.

With M a = -grad(energy) at the end of the step, every method here is x = x~ + s a for a prediction x~ that is known at
the start. The velocity at the end is v = c (x - x^), and strain rates are c (E(x) - E^) likewise.

Sources: Hairer, Wanner, "Solving Ordinary Differential Equations II" (1996), sections III.5 for BDF with variable
steps; Hughes, "The Finite Element Method" (2000), section 9.1 for Newmark's method.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.errors import SolverError
from supple.implicit.energies.damping import Strained, StrainRate
from supple.state import State
from supple.system import System


@dataclass(frozen=True, eq=False)
class Plan:
    """One step of an integrator.

    Attributes
    ----------
    scale : s [s^2]; None where there is no inertia
    predicted : x~ (n, 3) [m]
    velocity : positions at the end (n, 3) -> velocities at the end [m/s]
    strain_rate : the damped elements -> their strain rate at the end as a function of the strain there
    contact_weight : factor of the contact energies. The force s a of the trapezoidal rule counts a half at either end;
        contact acts at the end alone, and twice (Kane et al., "Finite element analysis of nonsmooth contact", 1999)
    memory : the data of this step that the next one needs
    """

    scale: float | None
    predicted: NDArray[np.float64]
    velocity: Callable[[NDArray[np.float64]], NDArray[np.float64]]
    strain_rate: Callable[[Strained], StrainRate]
    memory: History | None = None
    contact_weight: float = 1.0


@dataclass(frozen=True, eq=False)
class History:
    """The state before the last step, and the length of that step [s], for BDF2."""

    positions: NDArray[np.float64]
    velocities: NDArray[np.float64]
    step: float


# The acceleration (n, 3) [m/s^2] of a state, for integrators that need it at the start of a step.
Acceleration = Callable[[State], NDArray[np.float64]]


class Integrator(ABC):
    """A method; immutable."""

    name: str

    @abstractmethod
    def plan(self, system: System, state: State, h: float, acceleration: Acceleration) -> Plan:
        """A step of length h [s] from `state`."""


@dataclass(frozen=True)
class BackwardEuler(Integrator):
    """x = x_n + h v, v = v_n + h a. First order, stable for every step, loses energy."""

    name = "backward_euler"

    def plan(self, system: System, state: State, h: float, acceleration: Acceleration) -> Plan:
        x, v = state.positions, state.velocities
        return Plan(
            scale=h * h,
            predicted=x + h * v,
            velocity=lambda end: (end - x) / h,
            strain_rate=lambda damped: StrainRate(1.0 / h, damped.strains(x)),
            memory=History(x, v, h),
        )


@dataclass(frozen=True)
class BDF2(Integrator):
    """Backward differences over two steps, whose lengths may differ: second order, stable, loses little energy.

    Takes a step of backward Euler where the state has no history, or where the last step was less than half as long:
    the method is stable up to a ratio of 1 + sqrt(2).
    """

    name = "bdf2"

    def plan(self, system: System, state: State, h: float, acceleration: Acceleration) -> Plan:
        past = state.memory
        if not isinstance(past, History) or h > 2.0 * past.step or past.positions.shape != state.positions.shape:
            return BackwardEuler().plan(system, state, h, acceleration)
        x, v = state.positions, state.velocities
        w = h / past.step
        # y + ... = (1 + w)/(1 + 2 w) h y': from the parabola through the last two values and the new one.
        one = (1.0 + w) ** 2 / (1.0 + 2.0 * w)
        two = w * w / (1.0 + 2.0 * w)
        b = h * (1.0 + w) / (1.0 + 2.0 * w)
        old_x = one * x - two * past.positions
        old_v = one * v - two * past.velocities

        def strain_rate(damped: Strained) -> StrainRate:
            return StrainRate(1.0 / b, one * damped.strains(x) - two * damped.strains(past.positions))

        return Plan(
            scale=b * b,
            predicted=old_x + b * old_v,
            velocity=lambda end: (end - old_x) / b,
            strain_rate=strain_rate,
            memory=History(x, v, h),
        )


@dataclass(frozen=True)
class Newmark(Integrator):
    """The trapezoidal rule (beta = 1/4, gamma = 1/2): second order, keeps the energy of a linear system exactly."""

    name = "newmark"

    def plan(self, system: System, state: State, h: float, acceleration: Acceleration) -> Plan:
        x, v = state.positions, state.velocities
        s = 0.25 * h * h
        half = x + 0.5 * h * v
        pinned = system.pinned_vertices

        def velocity(end: NDArray[np.float64]) -> NDArray[np.float64]:
            at_end = (end - half) * (2.0 / h)
            # A scripted vertex obeys no equation of motion: the trapezoidal rule would let its velocity ring.
            at_end[pinned] = (end[pinned] - x[pinned]) / h
            return at_end

        def strain_rate(damped: Strained) -> StrainRate:
            return StrainRate(2.0 / h, damped.strains(x) + 0.5 * h * damped.strain_rates(x, v))

        return Plan(
            scale=s,
            predicted=x + h * v + s * acceleration(state),
            velocity=velocity,
            strain_rate=strain_rate,
            contact_weight=2.0,
        )


@dataclass(frozen=True)
class Static(Integrator):
    """No inertia, no damping: the step ends in equilibrium, at rest."""

    name = "static"

    def plan(self, system: System, state: State, h: float, acceleration: Acceleration) -> Plan:
        x = state.positions
        nothing = StrainRate(0.0, np.zeros((0, 6)))
        return Plan(scale=None, predicted=x, velocity=np.zeros_like, strain_rate=lambda damped: nothing)


INTEGRATORS: dict[str, Integrator] = {method.name: method for method in (BackwardEuler(), BDF2(), Newmark(), Static())}


def integrator_of(choice: str | Integrator) -> Integrator:
    """An integrator by its name, or the one given.

    Raises
    ------
    SolverError : where there is none of that name.
    """
    if isinstance(choice, Integrator):
        return choice
    if choice not in INTEGRATORS:
        names = ", ".join(repr(name) for name in INTEGRATORS)
        raise SolverError(f"Implicit: there is no integrator {choice!r}; there are {names}")
    return INTEGRATORS[choice]
