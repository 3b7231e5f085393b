"""Internal variables of materials that flow, backwards through a step: F_i of a step follows from that before and F."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from supple.gradients.kept import Replay
from supple.materials.laws.internal import inverse_flow
from supple.numerics.deformation import deformation_gradients
from supple.solvers.implicit.energies.law_elasticity import element_forces

Floats = NDArray[np.float64]

# Of entries of F and F_i^-1, which are near 1.
_STEP = 1e-6


def add_by_end(replay: Replay, by_internal: Floats, out: Floats) -> None:
    """Add to `out` (n, 3) what derivatives (k, 11) by the internal variables at the end of a step give to its end."""
    laws = replay.posed.grown.laws
    if laws is None:
        return
    internal, h = replay.kept.before.internal, replay.kept.h
    for tets, flow, rows in laws.flowing:
        B = np.ascontiguousarray(tets.B @ inverse_flow(internal[rows]))
        F = deformation_gradients(replay.x, tets.tets, B)

        def value(F: Floats, flow=flow, rows=rows, tets=tets) -> Floats:
            F = np.ascontiguousarray(F.reshape(-1, 3, 3))
            return (by_internal[rows] * flow.advanced(F, tets.parameters, internal[rows], h)).sum(axis=1)

        by_F = _by_entries(value, F.reshape(-1, 9), 9).reshape(-1, 3, 3)
        forces = np.empty((len(F), 4, 3))
        element_forces(np.ascontiguousarray(by_F), B, np.ones(len(F)), forces)
        np.add.at(out, tets.tets, forces)


def by_begin(replay: Replay, forces: Floats, by_internal: Floats) -> Floats:
    """(k, 11) derivatives by the internal variables at the beginning, of forces (n, 3) on a step's equations, and of
    what derivatives (k, 11) by those at its end give."""
    laws, internal, h = replay.posed.grown.laws, replay.kept.before.internal, replay.kept.h
    out = np.zeros_like(internal)
    if laws is None:
        return out
    for tets, flow, rows in laws.flowing:

        def value(z: Floats, flow=flow, rows=rows, tets=tets) -> Floats:
            B = np.ascontiguousarray(tets.B @ inverse_flow(z))
            F = deformation_gradients(replay.x, tets.tets, B)
            p = np.ascontiguousarray(flow.step_parameters(tets.parameters, z, h))
            P = flow.step_law.models(F, p, False, False)[1]
            along = deformation_gradients(forces, tets.tets, B)
            total = tets.volumes * np.einsum("eij,eij->e", P, along)
            return total + (by_internal[rows] * flow.advanced(F, tets.parameters, z, h)).sum(axis=1)

        out[rows] = _by_entries(value, internal[rows], 10)
        out[rows, 10] += by_internal[rows, 10]  # what was dissipated acts on nothing
    return out


def _by_entries(value: Callable[[Floats], Floats], z: Floats, count: int) -> Floats:
    """The derivatives of values (k,), each by its own row of z, by the first `count` columns."""
    out = np.zeros_like(z)
    for c in range(count):
        sides = []
        for sign in (1.0, -1.0):
            moved = z.copy()
            moved[:, c] += sign * _STEP
            sides.append(value(moved))
        out[:, c] = (sides[0] - sides[1]) / (2.0 * _STEP)
    return out
