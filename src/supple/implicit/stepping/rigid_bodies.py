"""Rigid bodies in a step: the nearest rigid places, and how far from rigid the bodies are.

The midpoint rule makes bodies rigid in the middle of a step. Its ends are stretched by up to (w h)^2 / 8 at an angular
velocity w, and every second one: without damping, this motion stays. The end of each of its steps is therefore
projected to the nearest rigid place and to the rigid velocities with the same momentum and angular momentum.

Source: Hairer, Lubich, Wanner, "Geometric Numerical Integration" (2006), section IV.4 (projection keeps the order).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from supple.implicit.limits.step_limits import StepLimits
from supple.scene.rigid.pose import nearest_rigid, orthogonality_error
from supple.state import State
from supple.system import System


def make_rigid(system: System, x: NDArray[np.float64]) -> None:
    """Move the control points of every rigid body in x (n, 3) to the nearest rigid pose, in place."""
    for part in system.rigid_bodies:
        x[part.vertices] = nearest_rigid(system.rest_positions[part.vertices], x[part.vertices])


def projected(system: System, state: State, limits: StepLimits) -> State:
    """The state with rigid bodies rigid, in place and velocity; the same where surfaces are in the way.

    Momentum and angular momentum of every body are kept.
    """
    x, v = state.positions.copy(), state.velocities.copy()
    make_rigid(system, x)
    x[system.pinned_vertices] = state.positions[system.pinned_vertices]
    if limits.largest_step(state.positions, x - state.positions).step < 1.0 or not limits.allows(x):
        return state
    for part in system.rigid_bodies:
        rows = part.vertices
        r, center = state.positions[rows], x[rows].mean(axis=0)
        moment = np.cross(r - center, v[rows]).sum(axis=0)
        there = x[rows] - center
        inertia = np.einsum("ij,ij->", there, there) * np.eye(3) - there.T @ there
        v[rows] = v[rows].mean(axis=0) + np.cross(np.linalg.solve(inertia, moment), there)
    return replace(state, positions=x, velocities=v)


def orthogonality_errors(system: System, x: NDArray[np.float64]) -> dict[str, float]:
    """|F^T F - 1| of every rigid body at x (n, 3), by name."""
    return {
        part.name: orthogonality_error(system.rest_positions[part.vertices], x[part.vertices])
        for part in system.rigid_bodies
    }
