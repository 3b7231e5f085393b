"""Contact between surfaces of bodies and of triangle obstacles, over the substeps of a frame."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.contact.obstacle_poses import ObstaclePoses
from supple.contact.search.boxes import boxes_of_pieces
from supple.contact.search.excluded_pairs import excluded_pairs
from supple.contact.search.point_inside import depths_inside
from supple.contact.search.point_lists import PairFinder
from supple.contact.search.reach import any_beyond_radii, mean_motions, search_radii
from supple.contact.search.stitch_masks import stitched_points
from supple.contact.search.surfaces import ContactSurfaces
from supple.system import System
from supple.xpbd.contact.memory import ContactMemory
from supple.xpbd.contact.surface_contacts import project_surfaces

# Of the mean surface edge: the least and the largest motion of a point that lists of candidates allow for, and the
# largest gap that is reported.
LEAST_REACH, MOST_REACH, NEAR = 0.1, 0.5, 1.0


class SurfaceCollisions:
    """Points against triangles. The lists of candidates are renewed when a point has moved too far.

    `begin_step` sets all that substeps read, from its arguments alone.
    """

    def __init__(self, system: System, surfaces: ContactSurfaces, poses: ObstaclePoses, edge_length: float) -> None:
        self.surfaces = s = surfaces
        self.poses = poses
        self.edge_length = edge_length
        n, pieces = len(s.point_piece), len(s.closed)
        rest = np.concatenate([system.rest_positions[s.rows], s.fixed_points])
        widest = float(np.diagonal(s.gaps).max(initial=0.0))
        excluded = excluded_pairs(s, rest, 2.0 * min(widest, 0.5 * edge_length))
        self._stitched = stitched_points(system, s, poses)
        self._rules = (s.allowed, *excluded)
        self._finder = PairFinder(n)
        self._x, self._before, self._gathered = np.zeros((n, 3)), np.zeros((n, 3)), np.zeros((n, 3))
        self._shapes = (self._x, s.point_piece, s.triangles, s.triangle_piece)
        self._pieces = (s.inverse_masses, s.point_piece, s.triangles, s.triangle_piece, s.closed, s.gaps, s.friction)
        self._far, self._near = np.zeros((n, 3)), np.zeros((n, 3))
        self._drifts = np.zeros((pieces + 1, 3))
        # Obstacles stand still, so that no motion is common to all points where there is one.
        self._all_share = len(s.fixed_points) == 0
        self._complete = np.zeros(n)
        self._gap = np.where(s.allowed, s.gaps, 0.0).max(axis=1)[s.point_piece]
        # See `ContactMemory`.
        self._depth = np.zeros((2, n))
        self._entered = np.zeros(n, dtype=np.int32)
        self._excursions = np.zeros(n)
        self._dt = 0.0

    def begin_step(
        self, x: NDArray[np.float64], v: NDArray[np.float64], time: float, dt: float, memory: ContactMemory | None
    ) -> None:
        """See `Collisions.begin_step`."""
        bodies = len(self.surfaces.rows)
        self._dt = dt
        np.take(x, self.surfaces.rows, axis=0, out=self._x[:bodies])
        self.surfaces.place_obstacles(self.poses, time, self._x)
        motions = np.zeros_like(self._x)
        self.surfaces.place_obstacles(self.poses, time + dt, motions)
        motions[bodies:] -= self._x[bodies:]
        motions[:bodies] = v[self.surfaces.rows] * dt
        self._before[:] = self._x
        self._recall(memory)
        self._gather(motions)
        self._excursions[:] = 0.0

    def project(
        self, x: NDArray[np.float64], x_prev: NDArray[np.float64], times: tuple[float, float], limit: float
    ) -> tuple[int, float]:
        """Keep surfaces apart over the substep `times` = (beginning, end) [s]; returns what `project_surfaces` does."""
        s, finder = self.surfaces, self._finder
        bodies = len(s.rows)
        np.take(x, s.rows, axis=0, out=self._x[:bodies])
        np.take(x_prev, s.rows, axis=0, out=self._before[:bodies])
        s.place_obstacles(self.poses, times[1], self._x)
        s.place_obstacles(self.poses, times[0], self._before)
        allowed = (self._far, self._near, s.point_piece, self._all_share, self._drifts)
        if any_beyond_radii(self._x, self._before, self._gathered, *allowed, self._excursions):
            self._gather((self._x - self._before) * (self._dt / (times[1] - times[0])))
        lists = (finder.n_active, finder.active, finder.starts, finder.triangles)
        scales = (limit, NEAR * self.edge_length)
        contacts, smallest = 0, np.inf
        # Obstacles come last because they cannot be moved.
        for kind, part in enumerate(((0, s.body_triangles), (s.body_triangles, len(s.triangles)))):
            if part[0] < part[1] and finder.n_active:
                memory = (self._depth[kind], self._entered, self._complete)
                found = project_surfaces(
                    self._x, self._before, lists, self._pieces, memory, scales, part, self._stitched
                )
                contacts, smallest = contacts + found[0], min(smallest, found[1])
        x[s.rows] = self._x[:bodies]
        x_prev[s.rows] = self._before[:bodies]
        return contacts, smallest

    def memory(self, x: NDArray[np.float64]) -> ContactMemory:
        """What the next step needs; `x` (n, 3) are the positions at the end of this one, after all contacts [m]."""
        s = self.surfaces
        positions = np.concatenate([x[s.rows], self._x[len(s.rows) :]])
        return ContactMemory(
            s.triangles[: s.body_triangles],
            positions,
            self._depth.copy(),
            self._entered.copy(),
            self._excursions.copy(),
        )

    def _recall(self, memory: ContactMemory | None) -> None:
        """Restore what `memory` holds of points that are still where they were, and find the overlaps of the others."""
        s = self.surfaces
        self._entered[:], self._excursions[:] = -1, 0.0
        known = 0
        if memory is not None:
            triangles = s.triangles[: s.body_triangles]
            known = memory.matching_points(triangles, self._x, LEAST_REACH * self.edge_length)
            self._entered[:known] = memory.entered[:known]
            self._excursions[:known] = memory.excursions[:known]
            self._depth[:, :known] = memory.depth[:, :known]
        if known < len(self._x):
            self._find_overlaps()

    def _gather(self, motions: NDArray[np.float64]) -> None:
        """List what may touch while no point moves farther than in a frame of these motions (n, 3) [m]."""
        s = self.surfaces
        mean_motions(motions, s.point_piece, self._all_share, self._drifts)
        scales = (LEAST_REACH * self.edge_length, MOST_REACH * self.edge_length)
        points = (self._x - self._before, self._excursions, s.point_piece)
        search_radii(motions, *points, self._drifts, scales, self._far, self._near)
        self._complete[:] = self._gap + LEAST_REACH * self.edge_length + self._depth.max(axis=0)
        self._far[:, 0] += self._complete
        self._near[:, 0] += self._complete
        self._finder.gather(self._shapes, (self._far, self._near), self._rules)
        self._gathered[:] = self._x

    def _find_overlaps(self) -> None:
        """Set how deep each point is inside other pieces, from positions alone."""
        s = self.surfaces
        boxes = np.empty((len(s.closed), 3)), np.empty((len(s.closed), 3))
        boxes_of_pieces(self._x, s.point_piece, np.zeros((len(self._x), 1)), *boxes)
        for kind, part in enumerate((slice(0, s.body_triangles), slice(s.body_triangles, None))):
            shapes = (self._x, s.point_piece, s.triangles[part], s.triangle_piece[part])
            depths_inside(shapes, s.closed, s.allowed, boxes, self._depth[kind])
