"""Time integrators: each turns a step into the minimization of |x - x~|^2_M / (2 s) plus the potential energy.

With M a = -grad(energy), every method here is x = x~ + s a / p for a prediction x~ that is known at the start. The
forces of a act at the end of the step (p = 1), or at a place p of the way to it. The velocity at the end is
v = c (x - x^), and strain rates are c (E - E^) likewise.

Sources: Hairer, Wanner, "Solving Ordinary Differential Equations II" (1996), sections III.5 for BDF with variable
steps; Simo, Tarnow, Wong, "Exact energy-momentum conserving algorithms and symplectic schemes for nonlinear dynamics"
(1992), section 3, for Newmark's method with forces in the middle of a step.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from supple.errors import SolverError
from supple.model.state import State
from supple.model.system import System
from supple.scene.joints.axis_joint import AxisJoint
from supple.scene.joints.motors import VelocityMotor
from supple.solvers.implicit.energies.damping import StrainRate
from supple.solvers.implicit.energies.stitch_damping import Damper
from supple.solvers.implicit.stepping.conservation import Conservation


@dataclass(frozen=True, eq=False)
class Plan:
    """One step of an integrator.

    Attributes
    ----------
    scale : s [s^2]; None without inertia
    predicted : x~ (n, 3) [m]
    velocity : positions at the end (n, 3) -> velocities at the end [m/s]
    strain_rate : the damped elements -> their strain rate at the end as a function of the strain there
    memory : the data of this step that the next one needs
    place : p, where all forces but those of contact act, as a share of the step's way and time. The objective is
        multiplied by 1 / p, so that the Hessian of an energy enters it as it is (see `ActingWithin`)
    past : with the shares a and b of the last two states, x^ = a x_n - b x_(n-1) and x~ = x^ + sqrt(s) v^; the like of
        strains. The midpoint rule has other ones
    """

    scale: float | None
    predicted: NDArray[np.float64]
    velocity: Callable[[NDArray[np.float64]], NDArray[np.float64]]
    strain_rate: Callable[[Damper], StrainRate]
    memory: History | None = None
    place: float = 1.0
    past: tuple[float, float] = (1.0, 0.0)

    def motion(self, state: State) -> tuple[NDArray[np.float64], float]:
        """The velocities (n, 3) [m/s] where forces act, affine in the positions x there: at x_n, and their rate [1/s].

        A share p of the way, they are (1 - p) v_n + p v of that at the end. Zero without inertia.
        """
        if self.scale is None:
            return np.zeros_like(state.velocities), 0.0
        at_end = self.velocity(state.positions)
        return (1.0 - self.place) * state.velocities + self.place * at_end, 1.0 / float(np.sqrt(self.scale))

    @property
    def contact_weight(self) -> float:
        """Factor of contact energies in the objective. Contact acts at the end of a step in every method (Kane et al.,
        "Finite element analysis of nonsmooth contact", 1999)."""
        return 1.0 / self.place


@dataclass(frozen=True, eq=False)
class History:
    """The state before the last step, and the length of that step [s], for BDF2.

    lost : what steps lost since a flow began, and the work of that flow [J]; see `lost_in_flow`
    """

    positions: NDArray[np.float64]
    velocities: NDArray[np.float64]
    step: float
    lost: tuple[float, float] = (0.0, 0.0)


class Integrator(ABC):
    """A method; immutable.

    precise_below : length of a step [s] below which the default tolerance of velocities falls with its square, as the
        errors of the method do; that of a second-order method is less than that of backward Euler
    """

    name: str
    precise_below: ClassVar[float] = 1.0 / 15.0

    @property
    def without_history(self) -> Integrator | None:
        """The method for a step whose history is not that of a smooth solution; None where a step needs no history."""
        return None

    def refusal(self, system: System) -> str | None:
        """Why the method cannot simulate a system; None where it can."""
        return None

    def position_error(self, before: State, end: State) -> NDArray[np.float64] | None:
        """(n, 3) the leading error of the positions that a step from `before` adds [m]; None where it is not known."""
        return None

    @abstractmethod
    def plan(self, system: System, state: State, h: float) -> Plan:
        """A step of length h [s] from `state`."""

    def finish(self, plan: Plan, before: State, end: State, residual: NDArray[np.float64], at: Conservation) -> State:
        """The state after a planned step.

        Parameters
        ----------
        end : with the velocities of the plan
        residual : (n, 3) the forces that Newton's method left unbalanced [N]
        at : what the pieces of the system conserve
        """
        return end


@dataclass(frozen=True)
class BackwardEuler(Integrator):
    """x = x_n + h v, v = v_n + h a. First order, stable for every step, loses energy."""

    precise_below = 1.0 / 60.0

    name = "backward_euler"

    def position_error(self, before: State, end: State) -> NDArray[np.float64] | None:
        """h (v - v_n) / 2: what the second order, as BDF2 has it from the same history, adds."""
        return 0.5 * (end.time - before.time) * (end.velocities - before.velocities)

    def plan(self, system: System, state: State, h: float) -> Plan:
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

    @property
    def without_history(self) -> Integrator:
        return BackwardEuler()

    def position_error(self, before: State, end: State) -> NDArray[np.float64] | None:
        """2/9 h^3 of the third derivative of x, for equal steps, from the velocities of three times."""
        h = end.time - before.time
        if (past := _history(before, h)) is None:
            return BackwardEuler().position_error(before, end)
        w = h / past.step
        now, then = (end.velocities - before.velocities) / h, (before.velocities - past.velocities) / past.step
        third = 2.0 * (now - then) / (h + past.step)
        return (1.0 + w) ** 2 / (6.0 * w * (1.0 + 2.0 * w)) * h**3 * third

    def plan(self, system: System, state: State, h: float) -> Plan:
        if (past := _history(state, h)) is None:
            return BackwardEuler().plan(system, state, h)
        x, v = state.positions, state.velocities
        w = h / past.step
        # y + ... = (1 + w)/(1 + 2 w) h y': from the parabola through the last two values and the new one.
        one = (1.0 + w) ** 2 / (1.0 + 2.0 * w)
        two = w * w / (1.0 + 2.0 * w)
        b = h * (1.0 + w) / (1.0 + 2.0 * w)
        old_x = one * x - two * past.positions
        old_v = one * v - two * past.velocities

        def strain_rate(damped: Damper) -> StrainRate:
            return StrainRate(1.0 / b, one * damped.strains(x) - two * damped.strains(past.positions))

        return Plan(
            scale=b * b,
            predicted=old_x + b * old_v,
            velocity=lambda end: (end - old_x) / b,
            strain_rate=strain_rate,
            memory=History(x, v, h),
            past=(one, two),
        )


def _history(state: State, h: float) -> History | None:
    """What BDF2 needs for a step of h [s]; None where none exists that suits."""
    past = state.memory
    fits = isinstance(past, History) and h <= 2.0 * past.step and past.positions.shape == state.positions.shape
    return past if fits else None


@dataclass(frozen=True)
class Newmark(Integrator):
    """Newmark's method (beta = 1/4, gamma = 1/2) with forces taken in the middle of the step: the midpoint rule.

    x = x_n + h (v_n + v) / 2 and M (v - v_n) = h f((x_n + x) / 2). Second order. Keeps linear and angular momentum, and
    the energy of a linear system; what it adds to the energy of another one is limited, see `Conservation`. The
    mean of the forces at the two ends of the step, the trapezoidal rule, would turn free bodies: its forces do not act
    where the mean of the positions is.
    """

    name = "newmark"

    def refusal(self, system: System) -> str | None:
        if system.rigid_bodies:
            return (
                f"body {system.rigid_bodies[0].name!r}: Implicit(integrator='newmark') cannot simulate rigid bodies; "
                "use 'bdf2'"
            )
        if system.shells is not None or system.rods is not None:
            return (
                "Implicit: integrator='newmark' cannot simulate shells and rods; use 'bdf2', 'backward_euler' or "
                "'static'"
            )
        if system.laws.material.flowing_laws:
            return (
                "Implicit: integrator='newmark' cannot simulate Viscoelastic and J2Plastic, which flow to the end of a "
                "step; use 'backward_euler', 'bdf2' or 'static'"
            )
        return None

    def plan(self, system: System, state: State, h: float) -> Plan:
        x, v = state.positions, state.velocities
        half = x + 0.5 * h * v
        pinned = system.pinned_vertices

        def velocity(end: NDArray[np.float64]) -> NDArray[np.float64]:
            at_end = (end - half) * (2.0 / h)
            # A scripted vertex obeys no equation of motion: its velocity would alternate about that of the script.
            at_end[pinned] = (end[pinned] - x[pinned]) / h
            return at_end

        def strain_rate(damped: Damper) -> StrainRate:
            # The difference quotient over half a step belongs to its middle. The curvature of strains along v, half of
            # their second difference, moves the rate to its end.
            strains = damped.strains(x)
            curvature = 0.5 * (damped.strains(half) + damped.strains(x - 0.5 * h * v)) - strains
            return StrainRate(2.0 / h, strains - curvature)

        return Plan(scale=0.25 * h * h, predicted=x + h * v, velocity=velocity, strain_rate=strain_rate, place=0.5)

    def finish(self, plan: Plan, before: State, end: State, residual: NDArray[np.float64], at: Conservation) -> State:
        at.restore_momentum(before, end, residual)
        return replace(end, memory=at.limit_energy(before, end))


@dataclass(frozen=True)
class Static(Integrator):
    """No inertia, no damping: the step ends in equilibrium, at rest."""

    name = "static"

    def refusal(self, system: System) -> str | None:
        for joint in system.scene.joints:
            if isinstance(joint, AxisJoint) and isinstance(joint.motor, VelocityMotor):
                return (
                    f"{joint.label}: in an equilibrium nothing moves, and its motor has a velocity; give a "
                    "PositionMotor, or use another integrator"
                )
        return None

    def plan(self, system: System, state: State, h: float) -> Plan:
        x = state.positions
        nothing = StrainRate(0.0, np.zeros((0, 6)))
        return Plan(scale=None, predicted=x, velocity=np.zeros_like, strain_rate=lambda damped: nothing)


INTEGRATORS: dict[str, Integrator] = {method.name: method for method in (BackwardEuler(), BDF2(), Newmark(), Static())}


def integrator_of(choice: str | Integrator) -> Integrator:
    """An integrator by its name, or the one given.

    Raises
    ------
    SolverError : where none has that name.
    """
    if isinstance(choice, Integrator):
        return choice
    if choice not in INTEGRATORS:
        names = ", ".join(repr(name) for name in INTEGRATORS)
        raise SolverError(f"Implicit: integrator {choice!r} does not exist; there are {names}")
    return INTEGRATORS[choice]
