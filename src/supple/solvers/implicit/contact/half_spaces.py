"""Contact with half-spaces: exact planes, one contact for each point near a plane.

A plane is two of the solver's vertices, a point and the tip of its normal (see `obstacle_vertices`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.contact.barrier.friction_energy import Slips
from supple.contact.barrier.plane_contacts import (
    add_plane_gradient,
    largest_plane_step,
    near_planes,
    plane_energy,
    plane_forces,
    plane_hessian,
)
from supple.contact.features.pair_geometry import VERTEX_VERTEX
from supple.contact.mesh.contact_mesh import ContactMesh
from supple.contact.mesh.obstacles import ObstacleRange
from supple.numerics.geometry.embedded_points import EmbeddedPoints, vertex_couplings
from supple.numerics.sparse.couplings import Couplings
from supple.solvers.implicit.contact.friction import Friction
from supple.solvers.implicit.energies.potential import ContactPotential, HessianBlocks

# A step keeps at least this share of every distance; the bound for triangles is conservative in the same way.
_KEEP = 0.1

# Rows of pairs, heights [m], normals, and the smallest height of all pairs [m]; see `near_planes`.
Near = tuple[NDArray[np.int32], NDArray[np.float64], NDArray[np.float64], float]


class Planes:
    """All pairs of a surface point and a half-space that may touch.

    Attributes
    ----------
    points : the surface's s points, then the two points of each plane
    pairs : (k, 3) a point, and the two points of its plane
    areas : (k,) [m^2]; owner, obstacle : (k,) numbers of the body and of the scene's obstacle
    ranges : by obstacle
    dhat : [m]
    """

    def __init__(
        self, mesh: ContactMesh, obstacles: tuple[ObstacleRange, ...], collide: NDArray[np.bool_], dhat: float
    ) -> None:
        """Every body's surface points with every half-space that the body may touch."""
        half_spaces = [part for part in obstacles if part.is_plane]
        s, own = len(mesh.points), mesh.points
        anchors = np.array([part.vertices for part in half_spaces], dtype=np.int32).reshape(-1)
        self.points = EmbeddedPoints(
            np.append(own.start, own.start[-1] + np.arange(1, len(anchors) + 1)).astype(np.int32),
            np.append(own.vertices, anchors),
            np.append(own.weights, np.ones(len(anchors))),
        )
        pairs, obstacle = [np.zeros((0, 3), dtype=np.int64)], [np.zeros(0, dtype=np.int64)]
        for k, part in enumerate(half_spaces):
            bodies = np.flatnonzero(collide[: mesh.body_count, mesh.body_count + part.index])
            rows = np.flatnonzero(np.isin(mesh.owner, bodies))
            pairs.append(np.column_stack([rows, np.full_like(rows, s + 2 * k), np.full_like(rows, s + 2 * k + 1)]))
            obstacle.append(np.full(len(rows), part.index))
        self.pairs = np.concatenate(pairs).astype(np.int32)
        self.areas = mesh.areas[self.pairs[:, 0]]
        self.owner = mesh.owner[self.pairs[:, 0]]
        self.obstacle = np.concatenate(obstacle).astype(np.int32)
        self.ranges = {part.index: part for part in half_spaces}
        self.dhat = dhat
        self._x: NDArray[np.float64] | None = None
        self._positions = np.zeros((0, 3))
        self._near: Near | None = None

    def __len__(self) -> int:
        return len(self.pairs)

    def positions(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Of the points, from those of all vertices x (n, 3), which must not change afterwards."""
        if x is not self._x:
            self._x, self._positions, self._near = x, self.points.positions(x), None
        return self._positions

    def near(self, x: NDArray[np.float64]) -> Near:
        """The pairs nearer than dhat at x (n, 3)."""
        positions, near = self.positions(x), self._near
        if near is None:
            self._near = near = near_planes(positions, self.pairs, self.dhat)
        return near

    def heights(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """(k,) signed distances of all pairs [m]."""
        return near_planes(self.positions(x), self.pairs, np.inf)[1]

    def smallest_distance(self, x: NDArray[np.float64]) -> float:
        """[m]; infinite where there is no pair."""
        return self.near(x)[3]

    def largest_step(self, x: NDArray[np.float64], direction: NDArray[np.float64]) -> tuple[float, int]:
        """Largest step along `direction` (n, 3), at most 1, that keeps a tenth of every point's distance.

        Returns
        -------
        step, row : of the pair that allows no more, -1 where there is none
        """
        if len(self) == 0:
            return 1.0, -1
        return largest_plane_step(self.positions(x), self.points.positions(direction), self.pairs, _KEEP)


@dataclass(frozen=True, eq=False)
class PlaneBarrier(ContactPotential):
    """The barrier between points and half-spaces; stiffness : kappa [Pa]."""

    planes: Planes
    stiffness: float

    def value(self, x: NDArray[np.float64]) -> float:
        p = self.planes
        return plane_energy(p.near(x), p.areas, p.dhat, self.stiffness)

    def forces(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """(m,) by which planes push the points that are near, along their normals [N]."""
        p = self.planes
        return plane_forces(p.near(x), p.areas, p.dhat, self.stiffness)

    def add_gradient(self, x: NDArray[np.float64], out: NDArray[np.float64]) -> None:
        p = self.planes
        near = p.near(x)
        if len(near[0]):
            gradient = np.zeros_like(p.positions(x))
            add_plane_gradient(p.positions(x), p.pairs, near, self.forces(x), gradient)
            p.points.add_forces(gradient, out)

    def add_hessian(self, x: NDArray[np.float64], out: HessianBlocks, project: bool) -> None:
        """Exact for the bodies' vertices; the coupling with the planes omits the rotation of the normal."""
        p = self.planes
        near = p.near(x)
        if len(near[0]):
            between = plane_hessian(p.positions(x), p.pairs, near, p.areas, p.dhat, self.stiffness)
            out.couplings.append(vertex_couplings(p.points, Couplings(*between)))


def plane_friction(
    barrier: PlaneBarrier,
    lagged: NDArray[np.float64],
    start: NDArray[np.float64],
    times: tuple[float, float],
    coefficients: NDArray[np.float64],
    reach: float,
) -> Friction | None:
    """Friction of the contacts at `lagged` (n, 3) over a step from `start`; None where there is none.

    Parameters
    ----------
    times : of the step's beginning and end [s]
    coefficients : (bodies, obstacles)
    reach : eps_v h [m]
    """
    p = barrier.planes
    if len(p) == 0:
        return None
    rows, _, normals, _ = p.near(lagged)
    forces = coefficients[p.owner[rows], p.obstacle[rows]] * barrier.forces(lagged)
    rough = np.flatnonzero(forces > 0.0)
    if len(rough) == 0:
        return None
    rows = rows[rough]
    # Positions relative to a point of the plane, if the points stuck to their planes during the step.
    sticking = p.points.positions(start)[p.pairs[rows, 0]]
    for index, part in p.ranges.items():
        on = p.obstacle[rows] == index
        if on.any():
            sticking[on] = part.obstacle.carried(sticking[on], *times) - part.targets(times[1])[0]
    count = len(rows)
    points = np.full((count, 4), -1, dtype=np.int32)
    points[:, :2] = p.pairs[rows, :2]
    kinds = np.full(count, VERTEX_VERTEX, dtype=np.int8)
    between = np.tile([1.0, -1.0, 0.0, 0.0], (count, 1))
    return Friction(p.points, Slips(kinds, points, between, normals[rough], sticking, forces[rough]), reach)
