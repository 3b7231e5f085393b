"""Loads that do not change within a step, gravity among them, and their works."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.model.loads.applied import DeadLoad, MassLoad
from supple.model.loads.muscles import FibreTension
from supple.model.state import State
from supple.model.system import System
from supple.numerics.inner_product import inner


def works_of_loads(
    system: System, before: State, displacements: NDArray[np.float64], middle: float, end: float
) -> dict[str, float]:
    """The work of the loads that `total_forces` adds up, over displacements (n, 3) [m], by its name [J].

    Forces are those at `middle` [s], where the step's equations have them. The work of muscles is what their potential
    loses, in the mean of the activations at the beginning and at the `end` of the step [s], as that of growth: they may
    turn with their body in a step, over which the forces of its end would do work.
    """
    works: dict[str, float] = {}
    x = before.positions
    for load in system.loads:
        if isinstance(load, FibreTension):
            lost = [load.energy(x, time) - load.energy(x + displacements, time) for time in (before.time, end)]
            works[load.work] = works.get(load.work, 0.0) + 0.5 * sum(lost)
        if isinstance(load, (DeadLoad, MassLoad)):
            forces = np.zeros_like(x)
            load.add_forces(x, middle, forces)
            works[load.work] = works.get(load.work, 0.0) + inner(forces, displacements)
    return works


def total_forces(system: System, x: NDArray[np.float64], time: float) -> NDArray[np.float64]:
    """(n, 3) weight and sum of the loads on each vertex at `time` [N], without those that have a potential.

    Forces per mass that depend on the place are those at x (n, 3), where the step begins [m].
    """
    total = system.masses[:, None] * system.gravity
    for load in system.loads:
        if isinstance(load, (DeadLoad, MassLoad)):
            load.add_forces(x, time, total)
    return total
