"""Contact of one scene: pairs, distances, stiffness and friction."""

from __future__ import annotations

import logging
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.contact.barrier.barrier_energy import barrier_forces
from supple.contact.barrier.friction_energy import lagged_slips, sides
from supple.contact.ccd import Limit
from supple.contact.mesh.contact_mesh import ContactMesh, contact_mesh
from supple.contact.mesh.obstacles import ObstacleRange, obstacle_positions, with_obstacles
from supple.contact.start.start_error import raise_if_intersecting
from supple.errors import SolverError
from supple.model.stitched_points import stitched_state
from supple.model.system import System, initial_state
from supple.scene.contact_pairs import PairTable, pair_table
from supple.solvers.implicit.contact.collisions import Barrier, Collisions
from supple.solvers.implicit.contact.friction import Friction
from supple.solvers.implicit.contact.half_spaces import PlaneBarrier, Planes, plane_friction
from supple.solvers.implicit.contact.settings import IPCContact, Scales, largest_dhat, scales_of

logger = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class Barriers:
    """The normal contact of one step: between triangles, and with half-spaces."""

    triangles: Barrier
    planes: PlaneBarrier

    @property
    def terms(self) -> list[Barrier | PlaneBarrier]:
        return [self.triangles, self.planes] if len(self.planes.planes) else [self.triangles]


@dataclass(frozen=True, eq=False)
class ContactModel:
    """The part of contact that does not change from step to step.

    Attributes
    ----------
    table : which owners may touch, and their friction, bodies before obstacles
    """

    system: System
    obstacles: tuple[ObstacleRange, ...]
    mesh: ContactMesh
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
    ) -> list[Friction]:
        """Friction with the normal forces at `lagged` (n, 3), of a step from `start` between two times [s]."""
        if not self.coefficients.any():
            return []
        reach = self.scales.friction_velocity * (times[1] - times[0])
        between = self._friction_between(barriers.triangles, lagged, start, reach)
        bodies = self.mesh.body_count
        with_planes = plane_friction(barriers.planes, lagged, start, times, self.coefficients[:bodies, bodies:], reach)
        return [term for term in (between, with_planes) if term is not None]

    def _friction_between(
        self, barrier: Barrier, lagged: NDArray[np.float64], start: NDArray[np.float64], reach: float
    ) -> Friction | None:
        """Of triangles; None where there is none."""
        contacts = self.collisions.at(lagged)
        forces = barrier_forces(contacts, self.collisions.dhat, barrier.stiffness)
        began = self.mesh.points.positions(start)
        slips = lagged_slips(contacts, forces, began, self.mesh.owner, self.coefficients)
        return Friction(self.mesh.points, slips, reach) if len(slips.forces) else None

    def largest_step(self, x: NDArray[np.float64], direction: NDArray[np.float64]) -> tuple[float, str]:
        """How far along `direction` (n, 3), at most 1, nothing touches, and the names of what would touch."""
        step, row = self.planes.largest_step(x, direction)
        names = "" if row < 0 else self._names(self._plane_owners(row))
        if step == 0.0:
            return 0.0, names
        limit = self.collisions.largest_step(x, step * direction)
        return step * limit.step, self._names(self._owners(limit)) if limit.kind else names

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
        held_together = len(self.system.stitching) > 0 or len(self.system.welding) > 0
        apart = self.allows(x) and not self.collisions.intersect(x) and self.smallest_distance(x) > 0.0
        if held_together and apart:
            return
        raise_if_intersecting(self.system, x, time, self.table)
        if not apart:
            raise SolverError("the scene starts with surfaces that touch; move them apart, or give contact=None")

    def count(self, x: NDArray[np.float64]) -> int:
        """Number of contacts at x (n, 3)."""
        return len(self.collisions.at(x).distances) + len(self.planes.near(x)[0])

    def nearest(self, x: NDArray[np.float64]) -> str:
        """The names of the two things that are nearest to each other."""
        contacts, heights = self.collisions.at(x), self.planes.heights(x)
        between, above = contacts.distances.min(initial=np.inf), heights.min(initial=np.inf)
        if np.isinf(min(between, above)):
            return "two surfaces"
        if above < between:
            k = int(heights.argmin())
            return self._names(self._plane_owners(k))
        k = int(contacts.distances.argmin())
        return self._names(sorted({int(self.mesh.owner[side[k]]) for side in sides(contacts)}))

    def _owners(self, limit: Limit) -> list[int]:
        """Of the pair that limits a step."""
        mesh, (i, j) = self.mesh, limit.pair
        edges = limit.kind == "edge-edge"
        points = (mesh.edges[i, 0], mesh.edges[j, 0]) if edges else (i, mesh.triangles[j, 0])
        return sorted({int(mesh.owner[p]) for p in points})

    def _plane_owners(self, row: int) -> list[int]:
        """Of a pair of a point and a half-space."""
        return [int(self.planes.owner[row]), self.mesh.body_count + int(self.planes.obstacle[row])]

    def _names(self, owners: list[int]) -> str:
        kinds = [f"{'body' if k < self.mesh.body_count else 'obstacle'} {self.mesh.names[k]!r}" for k in owners]
        return kinds[0] + " and itself" if len(kinds) == 1 else " and ".join(kinds)


def contact_model(system: System, settings: IPCContact, shear_moduli: NDArray[np.float64]) -> ContactModel:
    """The model, whose `system` has the obstacles' vertices.

    Parameters
    ----------
    shear_moduli : (m,) of the tets [Pa]
    """
    extended, obstacles = with_obstacles(system)
    table = pair_table(system.scene)
    begun = stitched_state(extended, initial_state(system.scene)).positions
    placed = np.concatenate([begun, obstacle_positions(obstacles, 0.0)])
    mesh = contact_mesh(extended, obstacles, table.collide, placed)
    widest = largest_dhat(system)
    planes, collisions = Planes(mesh, obstacles, table.collide, widest), Collisions(mesh, widest)
    # A run that is continued keeps its dhat: what rests on something is nearer to it than at the start.
    gaps = []
    for start in system.start_states:
        there = stitched_state(extended, start).positions
        x = np.concatenate([there, obstacle_positions(obstacles, start.time)])
        heights = planes.heights(x)  # vertices behind a plane are an error that is found later
        gaps.append(min(collisions.smallest_distance(x), float(heights[heights > 0.0].min(initial=np.inf))))
    scales = scales_of(settings, system, shear_moduli, max(gaps, default=np.inf))
    return ContactModel(
        system=extended,
        obstacles=obstacles,
        mesh=mesh,
        collisions=Collisions(mesh, scales.dhat),
        planes=Planes(mesh, obstacles, table.collide, scales.dhat),
        table=table,
        scales=scales,
        friction_iterations=settings.friction_iterations,
    )
