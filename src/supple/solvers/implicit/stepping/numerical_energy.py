"""The energy that a step makes: what its states gained beyond the works of all forces.

BDF2 extrapolates the velocity from those of the last two steps. In a smooth motion each step loses a little energy:
with the extrapolated velocity, the kinetic energy of Dahlquist's G-norm,

    1/4 |v|^2 + 1/4 |2 v - v_old|^2,

changes by the work of the forces, less a square. After a blow it contains the velocities before it, and a part of the
energy that the blow took comes back in the next steps without a work.

Source: Hairer, Wanner, "Solving Ordinary Differential Equations II" (1996), section V.6 (G-stability of BDF2).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from supple.model.diagnostics import measure
from supple.model.energy_balance import NUMERICAL, completed_works, works_of_actuators
from supple.model.state import State
from supple.solvers.implicit.stepping.workspace import Workspace

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
