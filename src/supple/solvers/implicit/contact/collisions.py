"""Contacts at a point of the search for a minimum, and how far a step may go before anything touches."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.contact.barrier.barrier_energy import add_barrier_gradient, barrier_energy, barrier_hessian
from supple.contact.barrier.collision_rows import CollisionRows, write_collisions
from supple.contact.candidates import CandidateFinder
from supple.contact.ccd import Along, Kept
from supple.contact.features.contact_set import Found, contacts_at
from supple.contact.features.contacts import Contacts, KnownWeights
from supple.contact.features.half_spaces import HalfSpaces
from supple.contact.features.vertex_contacts import REACH
from supple.contact.mesh.contact_mesh import ContactMesh, intersects
from supple.contact.mesh.obstacles import ObstacleRange
from supple.numerics.geometry.embedded_points import vertex_couplings
from supple.solvers.implicit.energies.potential import ContactPotential, HessianBlocks


class Collisions:
    """Contacts between the triangles of a mesh, and with half-spaces; those at the latest positions are kept.

    Parameters
    ----------
    dhat : [m] contacts are pairs with gaps below this: distances less the offsets of `ContactMesh`.

    Attributes
    ----------
    floor : distance [m] below which steps keep nearly all of it; 0 but in linearizations
    half_spaces : has the points that contacts name, and their owners; finder : of what is near what
    """

    def __init__(self, mesh: ContactMesh, obstacles: tuple[ObstacleRange, ...], dhat: float) -> None:
        self.mesh = mesh
        self.half_spaces = HalfSpaces(mesh, obstacles)
        self.dhat = dhat
        self.floor = 0.0
        self.finder = CandidateFinder(mesh, REACH * dhat)
        self._x: NDArray[np.float64] | None = None
        self._points = np.zeros((0, 3))
        self._found: Found | None = None
        self._known = KnownWeights.none()

    def points(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """The points, those of half-spaces last, at x (n, 3), which must not change afterwards."""
        if x is not self._x:
            self._x, self._points, self._found = x, self.half_spaces.points.positions(x), None
        return self._points

    def at(self, x: NDArray[np.float64]) -> Contacts:
        """All contacts at x (n, 3)."""
        return self._at(x).contacts

    def smallest_distance(self, x: NDArray[np.float64]) -> float:
        """The smallest gap [m]; infinite where nothing is near, not positive behind a half-space or within offsets."""
        return self._at(x).least

    def forget_weights(self) -> None:
        """From now on, contacts have the weights that belong to where they are."""
        self._known, self._found = KnownWeights.none(), None

    def keep_weights(self, x: NDArray[np.float64]) -> None:
        """Contacts at x (n, 3) keep their weights wherever they go (see `KnownWeights`)."""
        found = self._at(x)
        known = self._known.with_more(found.new).with_planes(found.planes)
        if known is self._known:
            return
        # Weights that were all unknown are those of the contacts that were found; a plane's depends on what is known.
        same = not len(self._known.codes) and not len(found.planes)
        self._known, self._found = known, found._replace(new=KnownWeights.none()) if same else None

    @property
    def has_areas(self) -> bool:
        """Whether contacts have areas that depend on where they are: those with half-spaces do not."""
        return len(self._known.codes) > 0

    def settle_weights(self, x: NDArray[np.float64]) -> None:
        """Contacts keep the weights that belong to x (n, 3), whatever they had."""
        self.forget_weights()
        self.keep_weights(x)

    def _at(self, x: NDArray[np.float64]) -> Found:
        points, s = self.points(x), len(self.mesh.points)
        if self._found is None:
            near = self.finder.at(points[:s])
            pairs = near.vertex_triangle, near.edge_edge
            found = contacts_at(points[:s], self.mesh, *pairs, self._known, self.dhat)
            on_planes, least = self.half_spaces.contacts(points, self.dhat)
            if len(on_planes.kinds):
                found = found._replace(contacts=found.contacts.joined(on_planes))
            self._found = found._replace(least=min(found.least, least))
        return self._found

    def along(self, x: NDArray[np.float64], direction: NDArray[np.float64]) -> StepAlong:
        """How far everything may go from x (n, 3) along ways that are nowhere longer than `direction` (n, 3)."""
        points, way, s = self.points(x), self.half_spaces.points.positions(direction), len(self.mesh.points)
        return StepAlong(self, points, Along(self.finder, points[:s], way[:s], self.floor))

    def ahead(self, x: NDArray[np.float64], way: NDArray[np.float64], least: float) -> CollisionRows:
        """Rows of the pairs that collide while points go from x (n, 3) along `way` (s + 3 h, 3).

        least : gap [m] that a point keeps from a half-space, or it gets a row, where anything collides
        """
        points, s, mesh = self.points(x), len(self.mesh.points), self.mesh
        found = self.finder.find(points[:s], points[:s] + way[:s])
        pairs = mesh.triangles, mesh.edges, mesh.offsets, found.vertex_triangle, found.edge_edge
        rows, kept = CollisionRows.room(64), Kept(self.floor, self.finder.dhat)
        while (count := write_collisions(points[:s], way[:s], *pairs, kept, rows)) > len(rows.kinds):
            rows = CollisionRows.room(count)
        rows = rows.where(slice(count))
        if not count and self.half_spaces.largest_step(points, way)[0] == 1.0:
            return rows
        longest = float(np.sqrt(np.einsum("ij,ij->i", way, way).max(initial=0.0)))
        planes, _ = self.half_spaces.contacts(points, least + longest)
        on_planes = CollisionRows(
            planes.kinds,
            planes.points,
            planes.coefficients,
            planes.vectors / planes.distances[:, None],
            planes.gaps,
            planes.gaps,
        ).along(way)
        return rows.joined(on_planes.where(on_planes.ends < least))

    def intersect(self, x: NDArray[np.float64]) -> bool:
        """Whether any two triangles that may not cross do so at x."""
        return intersects(self.mesh, self.points(x)[: len(self.mesh.points)])


@dataclass(frozen=True, eq=False)
class StepAlong:
    """How far everything may go along ways from `points` (s + 3 h, 3); see `Along`."""

    collisions: Collisions
    points: NDArray[np.float64]
    surfaces: Along

    def largest_step(self, direction: NDArray[np.float64]) -> tuple[float, list[int]]:
        """How far along `direction` (n, 3), at most 1, nothing touches; the points of the pair that allows no more."""
        planes, s = self.collisions.half_spaces, len(self.collisions.mesh.points)
        way = planes.points.positions(direction)
        step, row = planes.largest_step(self.points, way)
        pair = [] if row < 0 else planes.tets[row, [3, 0]].tolist()
        if step > 0.0:
            limit = self.surfaces.largest_step(step * way[:s])
            step *= limit.step
            pair = list(limit.points) or pair
        return step, pair


# The barrier between bodies and obstacles: an energy that grows without bound as surfaces come together.
#
# E = sum_k a_k kappa dhat b(d_k^2 / dhat^2),  b(s) = -(s - 1)^2 ln s  for s < 1, else 0
#
# over the contacts k of `supple.contact.features` with areas a_k: kappa is a pressure, so that neither the
# fineness of the mesh nor the unit of length changes what it means.


@dataclass(frozen=True, eq=False)
class Barrier(ContactPotential):
    """Of the contacts that `collisions` finds.

    stiffness : kappa [Pa]; soft : distance below which it is quadratic [m]
    """

    collisions: Collisions
    stiffness: float
    soft: float = 0.0

    def value(self, x: NDArray[np.float64]) -> float:
        contacts = self.collisions.at(x)
        return barrier_energy(contacts, self.collisions.dhat, self.stiffness, self.soft) if len(contacts.kinds) else 0.0

    def add_gradient(self, x: NDArray[np.float64], out: NDArray[np.float64]) -> None:
        contacts = self.collisions.at(x)
        if len(contacts.kinds):
            forces = np.zeros_like(self.collisions.points(x))
            add_barrier_gradient(contacts, self.collisions.dhat, self.stiffness, forces, self.soft)
            self.collisions.half_spaces.points.add_forces(forces, out)

    def add_hessian(self, x: NDArray[np.float64], out: HessianBlocks, project: bool) -> None:
        contacts, points = self.collisions.at(x), self.collisions.points(x)
        if len(contacts.kinds):
            between = barrier_hessian(points, contacts, self.collisions.dhat, self.stiffness, project, self.soft)
            out.couplings.append(vertex_couplings(self.collisions.half_spaces.points, between))

    def add_model(
        self, x: NDArray[np.float64], gradient: NDArray[np.float64], hessian: HessianBlocks | None, project: bool
    ) -> float:
        # All at once is asked for where the search for the minimum goes on.
        self.collisions.keep_weights(x)
        return super().add_model(x, gradient, hessian, project)
