"""Contact of one scene: pairs, distances, stiffness and friction."""

from __future__ import annotations

import logging
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.contact.collision_mesh.collisions import Collisions
from supple.contact.collision_mesh.contact_surface import ContactSurface
from supple.contact.obstacle_vertices import ObstacleRange
from supple.contact.start.start_error import raise_if_intersecting
from supple.errors import SolverError
from supple.implicit.contact.barrier import Barrier
from supple.implicit.contact.friction import Friction, friction
from supple.implicit.contact.half_spaces import PlaneBarrier, PlaneFriction, Planes, plane_friction
from supple.implicit.contact.scales import Scales
from supple.scene.contact_pairs import PairTable
from supple.system import System

logger = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class Barriers:
    """The normal contact of one step: between triangles, and with half-spaces."""

    triangles: Barrier
    planes: PlaneBarrier

    @property
    def terms(self) -> list[Barrier | PlaneBarrier]:
        return [self.triangles, self.planes] if len(self.planes.planes.vertices) else [self.triangles]


@dataclass(frozen=True, eq=False)
class ContactModel:
    """The part of contact that does not change from step to step.

    Attributes
    ----------
    table : which owners may touch, and their friction, bodies before obstacles
    """

    system: System
    obstacles: tuple[ObstacleRange, ...]
    surface: ContactSurface
    collisions: Collisions
    planes: Planes
    table: PairTable
    scales: Scales
    friction_iterations: int | None

    @property
    def coefficients(self) -> NDArray[np.float64]:
        """(p, p) of friction."""
        return self.table.friction

    def barriers(self, stiffness: float) -> Barriers:
        """The normal contact with a stiffness [Pa]."""
        return Barriers(Barrier(self.collisions, stiffness), PlaneBarrier(self.planes, stiffness))

    def frictions(
        self,
        barriers: Barriers,
        lagged: NDArray[np.float64],
        start: NDArray[np.float64],
        times: tuple[float, float],
    ) -> list[Friction | PlaneFriction]:
        """Friction with the normal forces at `lagged` (n, 3), of a step from `start` between two times [s]."""
        if not self.coefficients.any():
            return []
        h = times[1] - times[0]
        slow = self.scales.friction_velocity
        terms: list[Friction | PlaneFriction] = []
        between = friction(barriers.triangles, lagged, start, self.coefficients, slow * h)
        if between is not None:
            terms.append(between)
        bodies = self.surface.body_count
        on_planes = self.coefficients[:bodies, bodies:]
        with_planes = plane_friction(barriers.planes, lagged, start, times, on_planes, slow * h)
        if with_planes is not None:
            terms.append(with_planes)
        return terms

    def largest_step(self, x: NDArray[np.float64], direction: NDArray[np.float64]) -> float:
        """How far along `direction` (n, 3), at most 1, nothing touches."""
        step = self.planes.largest_step(x, direction)
        if step == 0.0:
            return 0.0
        return step * self.collisions.largest_step(x, step * direction)

    def allows(self, x: NDArray[np.float64]) -> bool:
        """Whether every vertex is in front of every plane."""
        return self.planes.smallest_distance(x) > 0.0

    def smallest_distance(self, x: NDArray[np.float64]) -> float:
        """Between anything that may touch, where it is below dhat [m]; else infinite."""
        nearest = min(self.planes.smallest_distance(x), self.collisions.smallest_distance(x))
        return nearest if nearest < self.scales.dhat else np.inf

    def raise_if_intersecting(self, x: NDArray[np.float64], time: float) -> None:
        """Raise where surfaces intersect or touch, or bodies are inside of something solid, at x (n, 3).

        Raises
        ------
        SceneError, SolverError : where they are not apart; names the pair and the place.
        """
        stitching = self.system.stitching
        apart = self.allows(x) and not self.collisions.intersect(x) and self.smallest_distance(x) > 0.0
        if len(stitching) and apart:
            return
        raise_if_intersecting(self.system, x, time, self.table)
        if not apart:
            raise SolverError("the scene starts with surfaces that touch; move them apart, or give contact=None")

    def count(self, x: NDArray[np.float64]) -> int:
        """Number of contacts at x (n, 3): pairs nearer than dhat."""
        return len(self.collisions.at(x)) + int((self.planes.distances(x)[0] < self.scales.dhat).sum())

    def nearest(self, x: NDArray[np.float64]) -> str:
        """The names of the two things that are nearest to each other."""
        best, names = np.inf, "two surfaces"
        found = self.collisions.at(x)
        mesh, points = self.surface.mesh, self.collisions.points(x)
        for k in range(len(found)):
            contact = found[k]
            squared = contact.compute_distance(points, mesh.edges, mesh.faces)
            if squared < best:
                owners = {int(self.surface.owner[v]) for v in contact.vertex_ids(mesh.edges, mesh.faces) if v >= 0}
                best, names = squared, self._names(sorted(owners))
        if len(self.planes.vertices):
            distances, _ = self.planes.distances(x)
            k = int(distances.argmin())
            if distances[k] ** 2 < best:
                names = self._names([self.planes.owner[k], self.surface.body_count + self.planes.obstacle[k]])
        return names

    def _names(self, owners: list[int]) -> str:
        kinds = [f"{'body' if k < self.surface.body_count else 'obstacle'} {self.surface.names[k]!r}" for k in owners]
        return kinds[0] + " and itself" if len(kinds) == 1 else " and ".join(kinds)
