"""The work of all forces in a step, as they act in its equations, over the displacements of the step.

With all terms of the objective, sum grad . (x - x_n) is what Newton's method left unbalanced on free vertices, and
what pins hold on the others. Terms of energies that bodies store, and of inertia, are not needed: what the forces give
to them is the sum of the works of all others. Actuators are left to the solver, which knows their generalized forces.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.model.energy_balance import add_works, dissipated_energy, work_of_growth
from supple.model.state import State
from supple.solvers.implicit.energies.loads.external_forces import works_of_loads
from supple.solvers.implicit.newton.minimize import Outcome
from supple.solvers.implicit.newton.objective import Objective
from supple.solvers.implicit.stepping.integrators import Plan
from supple.solvers.implicit.stepping.workspace import Workspace


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
    """The works by name, and that of the forces which Newton's method left over [J].

    Parameters
    ----------
    objective : whose minimum the outcome is; before : the state where the step begins
    internal : (k, 11) internal variables at the end; middle, time : of the loads, and of the end [s]
    """
    system, x, n = ws.system, outcome.end.positions, ws.bodies_end
    moved = x - before.positions
    moved[n:] = 0.0  # obstacles
    works = works_of_loads(system, before, moved, middle, time)
    end = State(time, x, before.velocities, internal=internal)
    add_works(works, work_of_growth(system, before, end))
    for term in objective.terms:
        if term.work is not None:
            gradient = np.zeros_like(x)
            term.add_gradient(x, gradient)
            add_works(works, {term.work: -plan.place * float(np.einsum("ij,ij->", gradient, moved))})
    left = plan.place * np.einsum("ij,ij->i", outcome.end.gradient, moved)
    held = system.pinned_vertices
    pins = float(left[held].sum())
    flowed = dissipated_energy(system.laws, before.internal) - dissipated_energy(system.laws, internal)
    add_works(works, ({"pins": pins} if system.scene.pins else {}) | ({"flow": flowed} if len(internal) else {}))
    return works, float(left.sum()) - pins
