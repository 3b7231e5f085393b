"""The work of all forces in a step, as they act in its equations, over the displacements of the step.

With all terms of the objective, sum grad . (x - x_n) is what Newton's method left unbalanced on free vertices, and
what pins hold on the others. Terms of energies that bodies store, and of inertia, are not needed: what the forces give
to them is the sum of the works of all others. Actuators are left to the solver, which knows their generalized forces.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from supple.model.diagnostics import measure
from supple.model.energy_balance import (
    NUMERICAL,
    add_works,
    completed_works,
    dissipated_energy,
    work_of_growth,
    works_of_actuators,
)
from supple.model.state import State
from supple.numerics.inner_product import inner
from supple.solvers.implicit.energies.loads.external_forces import works_of_loads
from supple.solvers.implicit.newton.minimize import Outcome
from supple.solvers.implicit.newton.objective import Objective
from supple.solvers.implicit.stepping.integrators import Plan
from supple.solvers.implicit.stepping.workspace import Workspace

# The energy that a step makes: what its states gained beyond the works of all forces.
#
# BDF2 extrapolates the velocity from those of the last two steps. In a smooth motion each step loses a little energy:
# with the extrapolated velocity, the kinetic energy of Dahlquist's G-norm,
#
# 1/4 |v|^2 + 1/4 |2 v - v_old|^2,
#
# changes by the work of the forces, less a square. After a blow it contains the velocities before it, and a part of the
# energy that the blow took comes back in the next steps without a work.
#
# Source: Hairer, Wanner, "Solving Ordinary Differential Equations II" (1996), section V.6 (G-stability of BDF2).


# Of the kinetic energy at the end of a step: what may be made. A linear oscillator makes none at any step.
_ALLOWED = 0.03
# Of the velocities that Newton's method leaves open at its tolerance: below their energy, nothing is judged.
_SPEEDS = 10.0


def makes_energy(
    before: State,
    after: State,
    works: Mapping[str, float],
    residual: float,
    actuators: Sequence[NDArray[np.float64]],
    open_speed: float,
    ws: Workspace,
) -> bool:
    """Whether a step made more energy than its method makes in a smooth motion.

    Parameters
    ----------
    before, after : with the obstacles' vertices; works, residual : see `works_of_step`
    actuators : generalized forces (p,) of each; open_speed : Newton's tolerance over the length of the step [m/s]
    """
    system = ws.system
    parts = [(each.parts(after.positions), each.parts(before.positions)) for each in system.actuators]
    driven = [force * (now - then) for force, (now, then) in zip(actuators, parts, strict=True)]
    end = measure(system, after)
    change = end.energy - measure(system, before).energy
    made = completed_works({**works, **works_of_actuators(system, driven)}, residual, change)[NUMERICAL]
    mass = float(system.masses[: ws.bodies_end].sum())
    return made > _ALLOWED * end.kinetic_energy + 0.5 * mass * (_SPEEDS * open_speed) ** 2


def works_of_step(
    objective: Objective,
    outcome: Outcome,
    before: State,
    internal: NDArray[np.float64],
    plan: Plan,
    middle: float,
    time: float,
    ws: Workspace,
) -> tuple[dict[str, float], float]:
    """The works by name, and that of the forces that remain after Newton's method [J].

    Parameters
    ----------
    objective : whose minimum the outcome is; before : the state where the step begins
    internal : (k, 11) internal variables at the end; middle, time : of the loads, and of the end [s]
    """
    system, x, n = ws.system, outcome.end.positions, ws.bodies_end
    moved = x - before.positions
    of_obstacles = moved[n:].copy()
    moved[n:] = 0.0
    works = works_of_loads(system, before, moved, middle, time)
    end = State(time, x, before.velocities, internal=internal)
    add_works(works, work_of_growth(system, before, end))
    for term in objective.terms:
        if term.work is not None:
            gradient = np.zeros_like(x)
            term.add_gradient(x, gradient)
            add_works(works, {term.work: -plan.place * inner(gradient, moved)})
    if ws.stitches is not None and of_obstacles.any():
        gradient = np.zeros_like(x)
        acted = before.positions + plan.place * (x - before.positions)
        ws.stitches.at(middle).add_gradient(acted, gradient)
        add_works(works, {"anchors": inner(gradient[n:], of_obstacles)})
    left = plan.place * np.einsum("ij,ij->i", system.welding.reduced(outcome.end.gradient), moved)
    held = system.pinned_vertices
    pins = float(left[held].sum())
    flowed = dissipated_energy(system.laws, before.internal) - dissipated_energy(system.laws, internal)
    add_works(works, ({"pins": pins} if system.scene.pins else {}) | ({"flow": flowed} if len(internal) else {}))
    return works, float(left.sum()) - pins
