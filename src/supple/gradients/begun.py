"""How loads and joints of a step depend on the positions where it begins, beyond inertia, damping and friction."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from supple.gradients.kept import Replay
from supple.model.joints.functions import derivatives
from supple.model.joints.laws import begin_step
from supple.model.loads.applied import MassLoad
from supple.model.loads.pressure import FollowerPressure, SweptTriangles
from supple.solvers.implicit.energies.joints import JointPotential

Floats = NDArray[np.float64]

# Of the size of what is moved: of a joint's function in its unit, of a triangle, of the smallest body.
_STEP = 1e-5


def add_by_joints(replay: Replay, forces: Floats, of_conditions: Floats, held: NDArray[np.int64], out: Floats) -> None:
    """Add what forces (n, 3), and derivatives by all values of `Replay.conditions`, give through the joints' laws.

    Laws begin from the values g of the functions where a step begins, and are affine in them.
    """
    joints, step = replay.joints, replay.posed.joints
    if joints is None or step is None or not len(joints.laws.table):
        return
    geometry, x = joints.geometry, replay.x
    before = replace(joints, time=replay.kept.before.time)
    here, adapts = before.coordinates(replay.kept.before.positions), joints.laws.table["adapts"]
    own = of_conditions[len(of_conditions) - len(held) :]

    def value(g: Floats) -> float:
        laws = joints.laws._replace(table=joints.laws.table.copy())
        begin_step(laws.table, laws.step[0], laws.given[0], g)
        multipliers = np.where(adapts, joints.law_multipliers, laws.table["multiplier"])
        pull = np.zeros_like(x)
        replace(joints, laws=laws, law_multipliers=multipliers).add_gradient(x, pull)
        return float(np.einsum("ij,ij->", pull, forces) - own @ laws.table["start"][held])

    by_g = np.zeros(len(here))
    for s in range(len(here)):
        e = np.zeros(len(here))
        e[s] = _STEP * geometry.units[s]
        by_g[s] = (value(here + e) - value(here - e)) / (2.0 * e[s])
    at = derivatives(geometry.functions, before.arguments(replay.kept.before.positions))
    JointPotential.add_by_vectors(geometry, by_g[:, None, None] * at.gradient, out)


def add_by_loads(replay: Replay, forces: Floats, out: Floats) -> None:
    """Add what forces (n, 3) give through pressures on open surfaces, and loads per mass that depend on the place."""
    system, start = replay.workspace.system, replay.kept.before.positions
    for load in system.loads:
        if isinstance(load, FollowerPressure):
            rows, p = load.triangles, load.pressure(replay.posed.middle)
            apart = np.arange(rows.size, dtype=np.int32).reshape(-1, 3)
            begin, end, way = start[rows.ravel()], replay.x[rows.ravel()], forces[rows.ravel()]
            e = _STEP * float(np.ptp(begin, axis=0).max())
            for corner in range(3):
                for axis in range(3):
                    sides = []
                    for sign in (1.0, -1.0):
                        moved, pull = begin.copy(), np.zeros_like(end)
                        moved[corner::3, axis] += sign * e
                        SweptTriangles(moved, end, apart).add_gradient(p, pull)
                        sides.append((pull * way).reshape(-1, 9).sum(axis=1))
                    np.add.at(out[:, axis], rows[:, corner], (sides[0] - sides[1]) / (2.0 * e))
    placed = [load for load in system.loads if isinstance(load, MassLoad)]
    if not placed:
        return
    e = _STEP * replay.workspace.diagonal
    for axis in range(3):
        sides = []
        for sign in (1.0, -1.0):
            moved, pull = start.copy(), np.zeros_like(start)
            moved[:, axis] += sign * e
            for load in placed:
                load.add_forces(moved, replay.posed.middle, pull)
            sides.append((pull * forces).sum(axis=1))
        out[:, axis] -= (sides[0] - sides[1]) / (2.0 * e)
