"""Constraints of stitches: two for each stitch tet, as for a tet of a body; one for each spring.

Stitches are few. They are projected in sequence, after the bodies' own constraints, on one thread.

A spring is C = |d| - l with d = x_0 - (1 - t) x_1 - t x_2 and the compliance 1 / k (see `constraints_edges_volume`).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from supple.numerics.kernel_cache import njit
from supple.scene.stitches.elements import StitchTets
from supple.system import System
from supple.xpbd.constraints.stable_neo_hookean import BlocksOfTwo
from supple.xpbd.sweeps.compilation import FLAGS
from supple.xpbd.sweeps.segments import Segments


class StitchTetConstraints(BlocksOfTwo):
    """The tetrahedra of all soft vertex-triangle stitches."""

    called = "stitch tets"

    def __init__(self, system: System, inverse_masses: NDArray[np.float64]) -> None:
        tets: StitchTets = system.stitching.tets
        movable = np.flatnonzero((inverse_masses[tets.vertices] > 0.0).any(axis=1))
        damping, kind = np.unique(tets.damping[movable], return_inverse=True)
        super().__init__(
            (tets.vertices[movable], tets.rest_shape_inverse[movable], tets.rest_volumes[movable]),
            (tets.mu[movable], tets.lam[movable]),
            inverse_masses,
            _sequential(kind.reshape(-1)),
            damping,
        )


class StitchSpringConstraints:
    """The springs of all vertex-vertex and vertex-edge stitches."""

    def __init__(self, system: System, inverse_masses: NDArray[np.float64]) -> None:
        springs = system.stitching.springs
        movable = (inverse_masses[springs.vertices] > 0.0).any(axis=1)
        self.ends = np.ascontiguousarray(springs.vertices[movable])
        self.place = np.ascontiguousarray(springs.place[movable])
        self.rest = np.ascontiguousarray(springs.rest_lengths[movable])
        self.compliance = 1.0 / springs.stiffness[movable]
        self.damping = np.ascontiguousarray(springs.damping[movable])
        self.count = self.work = len(self.ends)
        self.damped = bool(self.damping.any())

    def project(self, points: NDArray[np.float64], h: float, parallel: bool) -> None:
        """See `ConstraintSet.project`."""
        _project_springs(points, self.ends, self.place, self.rest, self.compliance / h**2)

    def damp(self, points: NDArray[np.float64], previous: NDArray[np.float64], h: float, parallel: bool) -> None:
        """See `ConstraintSet.damp`."""
        for backwards in (False, True):
            _damp_springs(points, previous, self.ends, self.place, self.compliance / h**2, self.damping / h, backwards)


def stitch_constraints(
    system: System, inverse_masses: NDArray[np.float64]
) -> list[StitchTetConstraints | StitchSpringConstraints]:
    """The constraints that a system needs.

    Parameters
    ----------
    system : in the solver's numbering; inverse_masses : (n + a,) of its vertices and of its stitches' anchors [1/kg]
    """
    made = [StitchTetConstraints(system, inverse_masses), StitchSpringConstraints(system, inverse_masses)]
    return [constraints for constraints in made if constraints.count]


def _sequential(kind: NDArray[np.int64]) -> Segments:
    """One chunk, in which the constraints of a kind keep their order."""
    order = np.argsort(kind, kind="stable")
    starts = np.flatnonzero(np.diff(kind[order], prepend=-1))
    bounds = np.column_stack([starts, np.append(starts[1:], len(order))[: len(starts)]])
    return Segments(
        order, np.array([0, len(starts)]), np.ascontiguousarray(bounds, dtype=np.int64), kind[order][starts]
    )


@njit(error_model="numpy")
def _extension(x, i, j, k, t):
    s = 1.0 - t
    return (
        x[i, 0] - s * x[j, 0] - t * x[k, 0],
        x[i, 1] - s * x[j, 1] - t * x[k, 1],
        x[i, 2] - s * x[j, 2] - t * x[k, 2],
    )


@njit(error_model="numpy")
def _slope(points, i, j, k, t):
    """sum w |grad C|^2; where both ends of the edge are one vertex, its shares are added first."""
    if j == k:
        return points[i, 3] + points[j, 3]
    return points[i, 3] + (1.0 - t) * (1.0 - t) * points[j, 3] + t * t * points[k, 3]


@njit(error_model="numpy")
def _move(points, i, j, k, t, d, f):
    for a in range(3):
        points[i, a] += points[i, 3] * f * d[a]
        points[j, a] -= points[j, 3] * (1.0 - t) * f * d[a]
        points[k, a] -= points[k, 3] * t * f * d[a]


@njit(cache=True, fastmath=FLAGS, error_model="numpy")
def _project_springs(points, ends, place, rest, alpha):
    for c in range(len(ends)):
        i, j, k, t = ends[c, 0], ends[c, 1], ends[c, 2], place[c]
        d = _extension(points, i, j, k, t)
        length = math.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
        # Coinciding ends have no direction.
        if length > 0.0:
            _move(points, i, j, k, t, d, (rest[c] - length) / ((_slope(points, i, j, k, t) + alpha[c]) * length))


@njit(cache=True, fastmath=FLAGS, error_model="numpy")
def _damp_springs(points, previous, ends, place, alpha, gammas, backwards):
    for index in range(len(ends)):
        c = len(ends) - 1 - index if backwards else index
        gamma = 0.5 * gammas[c]
        if gamma == 0.0:
            continue
        i, j, k, t = ends[c, 0], ends[c, 1], ends[c, 2], place[c]
        d, before = _extension(points, i, j, k, t), _extension(previous, i, j, k, t)
        length = math.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
        if length > 0.0:
            grown = length - math.sqrt(before[0] ** 2 + before[1] ** 2 + before[2] ** 2)
            slope = _slope(points, i, j, k, t)
            _move(points, i, j, k, t, d, -gamma * grown / ((gamma * slope + alpha[c]) * length))
