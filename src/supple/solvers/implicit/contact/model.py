"""Contact of one scene: pairs, distances, stiffness and friction."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from supple.contact.barrier.barrier_energy import barrier_forces
from supple.contact.barrier.friction_energy import lagged_slips, sides
from supple.contact.candidates import distances
from supple.contact.features.pair_geometry import EDGE_EDGE, VERTEX_TRIANGLE
from supple.contact.mesh.contact_mesh import ContactMesh, contact_mesh
from supple.contact.mesh.obstacles import ObstacleRange, obstacle_positions, with_obstacles
from supple.contact.passing import Passing
from supple.contact.start.start_error import raise_if_intersecting
from supple.errors import SolverError
from supple.model.stitched_points import stitched_state
from supple.model.system import System, initial_state
from supple.numerics.joined_sets import unite
from supple.scene.contact_pairs import PairTable, pair_table
from supple.solvers.implicit.contact.collisions import Barrier, Collisions
from supple.solvers.implicit.contact.friction import Friction, Press
from supple.solvers.implicit.contact.settings import IPCContact, Scales, largest_dhat, scales_of

logger = logging.getLogger(__name__)


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
    table: PairTable
    scales: Scales
    friction_iterations: int | None
    direct_way: Passing

    @property
    def coefficients(self) -> NDArray[np.float64]:
        """(p, p) of friction."""
        return self.table.friction

    @property
    def searches(self) -> int:
        """How many have been made."""
        return self.collisions.finder.searches + self.direct_way.searches

    def frictions(
        self,
        barrier: Barrier,
        lagged: NDArray[np.float64],
        start: NDArray[np.float64],
        duration: float,
    ) -> list[Friction]:
        """Friction with the normal forces at `lagged` (n, 3) of a barrier, of a step from `start`; empty without any.

        duration : of the step [s]
        """
        if not self.coefficients.any():
            return []
        points, contacts = self.collisions.half_spaces, self.collisions.at(lagged)
        forces = barrier_forces(contacts, self.scales.dhat, barrier.stiffness, barrier.soft)
        begun = points.points.positions(start)
        slips, rough = lagged_slips(contacts, forces, begun, points.owner, self.coefficients)
        if not len(rough):
            return []
        weights = slips.forces / forces[rough] * barrier.stiffness * contacts.weights[rough]
        press = Press(contacts.gaps[rough], weights, self.scales.dhat, barrier.soft, rough)
        return [Friction(points.points, slips, self.scales.friction_velocity * duration, press)]

    def largest_step(self, x: NDArray[np.float64], direction: NDArray[np.float64]) -> tuple[float, list[int]]:
        """How far along `direction` (n, 3), at most 1, nothing touches, and two points of what would touch."""
        return self.collisions.along(x, direction).largest_step(direction)

    def vertices(self, points: Sequence[int] | NDArray[np.int32]) -> NDArray[np.int32]:
        """The vertices that points are combinations of."""
        return self.collisions.half_spaces.points.taken(np.asarray(points)).vertices

    def clusters(self, x: NDArray[np.float64], pieces: NDArray[np.int32]) -> NDArray[np.int32]:
        """(n,) the same number for vertices of the `pieces` (n,) that touch each other at x (n, 3)."""
        points, contacts = self.collisions.half_spaces, self.collisions.at(x)
        one, other = sides(contacts.kinds, contacts.points)
        between = np.maximum(points.owner[one], points.owner[other]) < self.mesh.body_count
        piece = pieces[points.points.vertices[points.points.start[:-1]]]
        root = np.arange(int(pieces.max(initial=0)) + 2, dtype=np.int32)
        unite(one[between], other[between], piece, root)
        return root[pieces]

    def allows(self, x: NDArray[np.float64]) -> bool:
        """Whether every vertex is in front of every plane."""
        return self.collisions.smallest_distance(x) > 0.0

    def passing(self, begin: NDArray[np.float64], end: NDArray[np.float64]) -> str | None:
        """The names of two things that pass each other on the direct way between places (n, 3); see `Passing`."""
        points = self.direct_way.between(*(self.mesh.points.positions(x) for x in (begin, end)))
        return None if points is None else self.names(points)

    def smallest_distance(self, x: NDArray[np.float64]) -> float:
        """Of anything that may touch, less the offsets of `ContactMesh`, where it is below dhat [m]; else infinite."""
        nearest = self.collisions.smallest_distance(x)
        return nearest if nearest < self.scales.dhat else np.inf

    def raise_if_intersecting(self, x: NDArray[np.float64], time: float) -> None:
        """Raise where surfaces intersect or touch, or bodies are inside of something solid, at x (n, 3).

        Raises
        ------
        SceneError, SolverError : where they are not apart; names the pair and the place.
        """
        held_together = len(self.system.stitching.seams()) > 0 or len(self.system.welding) > 0
        apart = self.allows(x) and not self.collisions.intersect(x)
        if held_together and apart:
            return
        raise_if_intersecting(self.system, x, time, self.table)
        if not apart and self.mesh.offsets.any() and not self.collisions.intersect(x):
            missing = f"{max(-self.collisions.smallest_distance(x), 0.0):.2g} m"
            raise SolverError(
                f"{self.nearest(x)} are nearer at the start than the thickness of shells and rods, by {missing}; move "
                "them apart, make shells and rods thinner, or give contact=None"
            )
        if not apart:
            raise SolverError("the scene starts with surfaces that touch; move them apart, or give contact=None")

    def count(self, x: NDArray[np.float64]) -> int:
        """Number of contacts at x (n, 3)."""
        return len(self.collisions.at(x).distances)

    def nearest(self, x: NDArray[np.float64]) -> str:
        """The names of the two things that are nearest to each other."""
        points, mesh = self.collisions.points(x), self.mesh
        near = self.collisions.finder.at(points[: len(mesh.points)])
        on_planes, _ = self.collisions.half_spaces.contacts(points, np.inf)
        gaps, ends = [on_planes.gaps], [np.column_stack(sides(on_planes.kinds, on_planes.points))]
        for kind, pairs in ((VERTEX_TRIANGLE, near.vertex_triangle), (EDGE_EDGE, near.edge_edge)):
            first = pairs[:, 0] if kind == VERTEX_TRIANGLE else mesh.edges[pairs[:, 0], 0]
            both = (mesh.triangles if kind == VERTEX_TRIANGLE else mesh.edges)[pairs[:, 1], 0]
            apart = distances(points, kind, mesh.triangles, mesh.edges, pairs)
            gaps.append(apart - mesh.offsets[first] - mesh.offsets[both])
            ends.append(np.column_stack([first, both]))
        least = np.concatenate(gaps)
        return self.names(np.concatenate(ends)[int(least.argmin())].tolist()) if len(least) else "two surfaces"

    def names(self, points: Sequence[int]) -> str:
        """Of the owners of two points."""
        mesh, owners = self.mesh, sorted({int(self.collisions.half_spaces.owner[p]) for p in points})
        kinds = [f"{'body' if k < mesh.body_count else 'obstacle'} {mesh.names[k]!r}" for k in owners]
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
    # A run that is continued keeps its dhat: what rests on something is nearer to it than at the start. What collides
    # since its stitches have broken does not change it.
    whole = replace(extended, stitching=replace(extended.stitching, separated=extended.stitching.separated[:0]))
    begun_mesh = contact_mesh(whole, obstacles, table.collide, placed) if len(extended.stitching.separated) else mesh
    collisions = Collisions(begun_mesh, obstacles, widest)
    gaps = []
    for start in system.start_states:
        there = stitched_state(extended, start).positions
        x = np.concatenate([there, obstacle_positions(obstacles, start.time)])
        gaps.append(collisions.smallest_distance(x))  # vertices behind a plane are an error that is found later
    scales = scales_of(settings, system, shear_moduli, max(gaps, default=np.inf))
    return ContactModel(
        system=extended,
        obstacles=obstacles,
        mesh=mesh,
        collisions=Collisions(mesh, obstacles, scales.dhat),
        table=table,
        scales=scales,
        friction_iterations=settings.friction_iterations,
        direct_way=Passing(mesh, mesh.points.positions(extended.rest_positions)),
    )
