"""Points of rigid bodies that something is stitched to, as vertices of a solver.

They are vertices without mass that are welded to their body. So all that acts on vertices acts on them, stitches too,
and what solvers do with welded vertices passes it on to the body.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from supple.model.state import State
from supple.model.system import System

# Of the smallest mass of a vertex: some formulas divide by masses.
LIGHT = 1e-12


def with_stitched_points(system: System) -> System:
    """The system with these vertices after those of its bodies; where there are none, the given one."""
    nodes = system.stitching.apart
    if not len(nodes):
        return system
    effective = system.effective_masses
    light = np.full(len(nodes), LIGHT * float(system.masses[system.masses > 0.0].min()))
    return replace(
        system,
        rest_positions=with_rows(nodes.positions(system.rest_positions), system.rest_positions),
        masses=np.concatenate([system.masses, light]),
        effective_masses=None if effective is None else np.concatenate([effective, light]),
        components=np.concatenate([system.components, system.components[nodes.control[:, 0]]]),
        welding=system.welding.with_vertices(nodes.numbers, nodes.control, nodes.weights),
        stitching=system.stitching.with_rigid_vertices(),
    )


def with_rows(more: NDArray[np.float64], x: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n + k, 3) rows after x (n, 3)."""
    return np.concatenate([x, more]) if len(more) else x


def stitched_state(system: System, state: State) -> State:
    """A state of n vertices with those of `with_stitched_points`; where it has none, the given one."""
    own = system.stitching.rigid
    if not len(own):
        return state
    x, v = (with_rows(own.positions(values), values) for values in (state.positions, state.velocities))
    return replace(state, positions=x, velocities=v)
