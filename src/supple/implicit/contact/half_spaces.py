"""Contact with half-spaces: exact planes, one contact for each vertex near a plane.

A plane is two of the solver's vertices, a point c and the tip c + L n of its normal (see `kinematic`). The distance of
a vertex x is d = (x - c) . n, and its derivatives by c and the tip couple bodies to a plane that moves.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from supple.contact.closest.pair_geometry import VERTEX_VERTEX
from supple.contact.collision_mesh.contact_surface import ContactSurface
from supple.contact.obstacle_vertices import ObstacleRange
from supple.contact.potentials.friction_energy import (
    Slips,
    add_friction_gradient,
    friction_energy,
    friction_hessian,
    renew_duals,
)
from supple.implicit.energies.potential import ContactPotential, FrictionPotential, HessianBlocks
from supple.numerics.sparse.couplings import Couplings

# A step keeps at least this share of every distance; the bound for triangles is conservative in the same way.
_KEEP = 0.1


@dataclass(frozen=True, eq=False)
class Planes:
    """All pairs of a surface vertex and a half-space that may touch.

    Attributes
    ----------
    vertices : (k,); areas : (k,) [m^2]; owner, obstacle : (k,) numbers of the body and of the scene's obstacle
    base, tip : (k,) the plane's two points, as vertices
    ranges : by obstacle
    dhat : [m]
    """

    vertices: NDArray[np.int32]
    areas: NDArray[np.float64]
    owner: NDArray[np.int32]
    obstacle: NDArray[np.int32]
    base: NDArray[np.int32]
    tip: NDArray[np.int32]
    ranges: dict[int, ObstacleRange]
    dhat: float

    @classmethod
    def of(
        cls,
        surface: ContactSurface,
        obstacles: tuple[ObstacleRange, ...],
        collide: NDArray[np.bool_],
        dhat: float,
    ) -> Planes:
        """Every body's surface vertices with every half-space that the body may touch."""
        half_spaces = [part for part in obstacles if part.is_plane]
        owner = surface.owner[: len(surface.vertices)]
        rows, which = [np.zeros(0, dtype=np.int64)], [np.zeros(0, dtype=np.int64)]
        for k, part in enumerate(half_spaces):
            bodies = np.flatnonzero(collide[: surface.body_count, surface.body_count + part.index])
            rows.append(np.flatnonzero(np.isin(owner, bodies)))
            which.append(np.full(len(rows[-1]), k))
        row, plane = np.concatenate(rows), np.concatenate(which)
        ends = np.array([part.vertices for part in half_spaces], dtype=np.int32).reshape(-1, 2)[plane]
        index = np.array([part.index for part in half_spaces], dtype=np.int32)[plane]
        return cls(
            vertices=surface.vertices[row],
            areas=surface.areas[row],
            owner=owner[row],
            obstacle=index,
            base=ends[:, 0],
            tip=ends[:, 1],
            ranges={part.index: part for part in half_spaces},
            dhat=dhat,
        )

    def distances(self, x: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """(k,) signed distances [m] and (k, 3) normals."""
        axis = x[self.tip] - x[self.base]
        normals = axis / np.linalg.norm(axis, axis=1)[:, None]
        return np.einsum("ij,ij->i", x[self.vertices] - x[self.base], normals), normals

    def largest_step(self, x: NDArray[np.float64], direction: NDArray[np.float64]) -> float:
        """Largest step along `direction` (n, 3), at most 1, that keeps a tenth of every vertex's distance.

        The distance times the length of the normal is a quadratic in the step.
        """
        if len(self.vertices) == 0:
            return 1.0
        r, dr = x[self.vertices] - x[self.base], direction[self.vertices] - direction[self.base]
        m, dm = x[self.tip] - x[self.base], direction[self.tip] - direction[self.base]
        heights = np.einsum("ij,ij->i", r, m)
        b = np.einsum("ij,ij->i", r, dm) + np.einsum("ij,ij->i", dr, m)
        a = np.einsum("ij,ij->i", dr, dm)
        c = (1.0 - _KEEP) * heights
        if not (np.isfinite(a).all() and np.isfinite(b).all()):
            return 0.0
        if (heights <= 0.0).any():
            return 0.0
        # Smallest positive root of a t^2 + b t + c with c > 0, without cancellation.
        root = np.full(len(c), np.inf)
        discriminant = b * b - 4.0 * a * c
        real = discriminant >= 0.0
        q = -0.5 * (b[real] + np.where(b[real] >= 0.0, 1.0, -1.0) * np.sqrt(discriminant[real]))
        with np.errstate(divide="ignore", invalid="ignore"):
            roots = np.stack([q / a[real], c[real] / q])
        roots[~(roots > 0.0)] = np.inf
        root[real] = roots.min(axis=0)
        return float(min(1.0, root.min()))

    def smallest_distance(self, x: NDArray[np.float64]) -> float:
        """[m]; infinite where there is no pair."""
        return float(self.distances(x)[0].min(initial=np.inf))


def barrier_terms(
    distances: NDArray[np.float64], dhat: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """dhat b(d^2 / dhat^2) and its first and second derivative by d, for 0 < d < dhat (see `barrier`)."""
    r = distances / dhat
    s = r * r
    log = np.log(s)
    first = -2.0 * (s - 1.0) * log - (s - 1.0) ** 2 / s
    second = -2.0 * log - 4.0 * (s - 1.0) / s + (s - 1.0) ** 2 / (s * s)
    return -dhat * (s - 1.0) ** 2 * log, 2.0 * r * first, (4.0 * s * second + 2.0 * first) / dhat


@dataclass(frozen=True, eq=False)
class PlaneBarrier(ContactPotential):
    """The barrier between vertices and half-spaces; stiffness : kappa [Pa]."""

    planes: Planes
    stiffness: float

    def value(self, x: NDArray[np.float64]) -> float:
        d, _ = self.planes.distances(x)
        if (d <= 0.0).any():
            return np.inf
        near = d < self.planes.dhat
        energy, _, _ = barrier_terms(d[near], self.planes.dhat)
        return self.stiffness * float(self.planes.areas[near] @ energy)

    def add_gradient(self, x: NDArray[np.float64], out: NDArray[np.float64]) -> None:
        p = self.planes
        d, normals = p.distances(x)
        near = (d < p.dhat) & (d > 0.0)
        size = (self.stiffness * p.areas[near] * barrier_terms(d[near], p.dhat)[1])[:, None]
        np.add.at(out, p.vertices[near], size * normals[near])
        by_base, by_tip = self._by_plane(x, near, d[near], normals[near])
        np.add.at(out, p.base[near], size * by_base)
        np.add.at(out, p.tip[near], size * by_tip)

    def add_hessian(self, x: NDArray[np.float64], out: HessianBlocks, project: bool) -> None:
        """Exact for the bodies' vertices; the coupling with the planes omits the rotation of the normal."""
        p = self.planes
        d, normals = p.distances(x)
        near = (d < p.dhat) & (d > 0.0)
        if not near.any():
            return
        k = self.stiffness * p.areas[near] * barrier_terms(d[near], p.dhat)[2]
        n = normals[near]
        np.add.at(out.vertices, p.vertices[near], k[:, None, None] * n[:, :, None] * n[:, None, :])
        by_base, by_tip = self._by_plane(x, near, d[near], n)
        rows = np.concatenate([p.vertices[near]] * 2)
        columns = np.concatenate([p.base[near], p.tip[near]])
        blocks = np.concatenate([k[:, None, None] * n[:, :, None] * by[:, None, :] for by in (by_base, by_tip)])
        out.couplings.append(Couplings(rows, columns, blocks))

    def _by_plane(
        self, x: NDArray[np.float64], near: NDArray[np.bool_], d: NDArray[np.float64], n: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Derivatives (k, 3) of the distances by the planes' two points."""
        p = self.planes
        length = np.linalg.norm(x[p.tip[near]] - x[p.base[near]], axis=1)[:, None]
        along = (x[p.vertices[near]] - x[p.base[near]] - d[:, None] * n) / length
        return -n - along, along


@dataclass(frozen=True, eq=False)
class PlaneFriction(FrictionPotential):
    """Lagged friction between vertices and half-spaces (see `friction`).

    Attributes
    ----------
    slips : of pairs of the solver's vertices: one near a plane, and a point of the plane
    reach : eps_v h [m], the displacement below which friction is static
    duals : (k, 3), see `Friction`
    """

    slips: Slips
    reach: float
    duals: NDArray[np.float64] = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "duals", np.zeros((len(self.slips.forces), 3)))

    def value(self, x: NDArray[np.float64]) -> float:
        return friction_energy(x, self.slips, self.reach)

    def add_gradient(self, x: NDArray[np.float64], out: NDArray[np.float64]) -> None:
        add_friction_gradient(x, self.slips, self.reach, out)

    def add_hessian(self, x: NDArray[np.float64], out: HessianBlocks, project: bool) -> None:
        """The matrix of a primal-dual step, positive semi-definite without projection."""
        out.couplings.append(friction_hessian(x, self.slips, self.reach, self.duals))

    def renew(self, x: NDArray[np.float64], direction: NDArray[np.float64]) -> None:
        renew_duals(x, direction, self.slips, self.reach, self.duals)


def plane_friction(
    barrier: PlaneBarrier,
    lagged: NDArray[np.float64],
    start: NDArray[np.float64],
    times: tuple[float, float],
    coefficients: NDArray[np.float64],
    reach: float,
) -> PlaneFriction | None:
    """Friction of the contacts at `lagged` (n, 3) over a step from `start`; None where there is none.

    Parameters
    ----------
    times : of the step's beginning and end [s]
    coefficients : (bodies, obstacles)
    """
    p = barrier.planes
    mu = coefficients[p.owner, p.obstacle] if len(p.owner) else np.zeros(0)
    d, normals = p.distances(lagged)
    near = np.flatnonzero((d < p.dhat) & (d > 0.0) & (mu > 0.0))
    if len(near) == 0:
        return None
    forces = mu[near] * barrier.stiffness * p.areas[near] * np.abs(barrier_terms(d[near], p.dhat)[1])
    sticking = start[p.vertices[near]].copy()
    for index, part in p.ranges.items():
        rows = p.obstacle[near] == index
        if rows.any():
            sticking[rows] = part.obstacle.carried(sticking[rows], *times) - part.targets(times[1])[0]
    pairs = np.full((len(near), 4), -1, dtype=np.int32)
    pairs[:, 0], pairs[:, 1] = p.vertices[near], p.base[near]
    kinds = np.full(len(near), VERTEX_VERTEX, dtype=np.int8)
    weights = np.tile([1.0, -1.0, 0.0, 0.0], (len(near), 1))
    return PlaneFriction(Slips(kinds, pairs, weights, normals[near], sticking, forces), reach)
