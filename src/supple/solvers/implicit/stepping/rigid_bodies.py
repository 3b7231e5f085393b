"""Rigid bodies in a step: the nearest rigid places, how far from rigid bodies are, and the ends of midpoint steps.

The midpoint rule makes a body without joints rigid in the middle of a step; for others see `MidpointJoints`. At the
end it would be stretched by up to (w h)^2 / 8 at an angular velocity w, and every second end: without damping, this
motion would stay. The end is therefore replaced by a rigid place x with the rigid velocities v that have the angular
momentum L of the end, such that the second half of the step mirrors the first one. With the middle y, from which the
rule left the velocities u at the end, relative to the center of mass and with equal masses:

    sum y x (v - 2 (x - y) / h) = sum y x (u - (x_end - x_start) / h),    sum x x v = L.

Both sides are the moment of the forces in half a step. Without forces the step is then its own inverse for -h. A method
of this kind keeps the energy of a free body up to an error of second order that does not grow.

Source: Hairer, Lubich, Wanner, "Geometric Numerical Integration" (2006), sections V.4.1 (symmetric projection) and
VII.5 (discrete rigid bodies).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from supple.model.state import State
from supple.model.system import System
from supple.scene.rigid.pose import nearest_rigid, orthogonality_error
from supple.scene.rotation import rotation_matrix
from supple.solvers.implicit.step_limits import StepLimits

# Each round divides the error by about w h; changes of the angle below this are round-off.
_MOST_ROUNDS = 60
_ROUNDED = 1e-15
# Of |F^T F - 1| at the end of a step: beyond it a body is no longer rigid.
_MOST_STRAINED = 0.01


def with_rigid_bodies(
    system: System, start: NDArray[np.float64], end: NDArray[np.float64], place: float
) -> NDArray[np.float64]:
    """The end (n, 3) of a step from `start`, moved so that bodies are rigid where forces are taken.

    Parameters
    ----------
    place : where that is, from 0 at the start to 1 at the end; those with joints and welds always are at the end
    """
    linked = system.linked_bodies
    for part in system.rigid_bodies:
        rows = part.vertices
        share = 1.0 if part in linked else place
        there = start[rows] + share * (end[rows] - start[rows])
        end[rows] += (nearest_rigid(system.rest_positions[rows], there) - there) / share
    return end


def rigid_ends(system: System, before: State, end: State, limits: StepLimits) -> State:
    """The end of a midpoint step with rigid bodies rigid, in place and velocity; the given one where surfaces touch.

    Those with joints and welds are rigid there already. Momentum and angular momentum of every body are kept.
    """
    x, v = end.positions.copy(), end.velocities.copy()
    h = end.time - before.time
    pinned = system.pinned_vertices
    for part in (part for part in system.rigid_bodies if part not in system.linked_bodies):
        rows = part.vertices
        rest, start = system.rest_positions[rows], before.positions[rows]
        if np.isin(pinned, np.arange(rows.start, rows.stop)).any():
            continue
        center, velocity = x[rows].mean(axis=0), v[rows].mean(axis=0)
        spin = np.cross(x[rows] - center, v[rows]).sum(axis=0)
        middle = 0.5 * (start + x[rows])
        arms = middle - middle.mean(axis=0)
        impulse = np.cross(arms, v[rows] - (x[rows] - start) / h).sum(axis=0)
        y = nearest_rigid(rest, middle)
        there, moving = _mirrored(y - y.mean(axis=0), spin, impulse, h)
        x[rows], v[rows] = center + there, velocity + moving
    way = x - end.positions
    if not np.isfinite(way).all() or limits.largest_step(end.positions, way).step < 1.0 or not limits.allows(x):
        return end
    return replace(end, positions=x, velocities=v)


def strained(system: System, end: State) -> str:
    """What is wrong where a rigid body is not rigid at the end of a midpoint step, because of surfaces in its way."""
    errors = orthogonality_errors(system, end.positions)
    name = max(errors, key=errors.__getitem__)
    if errors[name] <= _MOST_STRAINED:
        return ""
    return (
        f"surfaces are in the way of the rigid pose of body {name!r}, whose |F^T F - 1| is {errors[name]:.2g}; take a "
        "shorter step, or 'backward_euler' or 'bdf2'"
    )


def _mirrored(
    y: NDArray[np.float64], spin: NDArray[np.float64], impulse: NDArray[np.float64], h: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Places and velocities (4, 3) at the end; see the module.

    Parameters
    ----------
    y : (4, 3) in the middle, relative to the center; spin : L over the mass of one point; impulse : of forces, likewise
    """
    inverse = np.linalg.inv(_inertia(y))
    turn, x, v = 0.5 * h * inverse @ spin, y, np.zeros_like(y)
    for _ in range(_MOST_ROUNDS):
        x = y @ rotation_matrix(turn).T
        v = np.cross(np.linalg.solve(_inertia(x), spin), x)
        change = 0.5 * h * inverse @ (np.cross(y, v - (2.0 / h) * (x - y)).sum(axis=0) - impulse)
        turn = turn + change
        if np.abs(change).max() <= _ROUNDED:
            break
    return x, v


def _inertia(r: NDArray[np.float64]) -> NDArray[np.float64]:
    """(3, 3) of points (4, 3) of mass one."""
    return np.einsum("ij,ij->", r, r) * np.eye(3) - r.T @ r


def orthogonality_errors(system: System, x: NDArray[np.float64]) -> dict[str, float]:
    """|F^T F - 1| of every rigid body at x (n, 3), by name."""
    return {
        part.name: orthogonality_error(system.rest_positions[part.vertices], x[part.vertices])
        for part in system.rigid_bodies
    }
