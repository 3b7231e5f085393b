"""Contact between surfaces of bodies and of triangle obstacles, over the substeps of a frame."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from supple.contact.mesh.obstacles import ObstaclePoses
from supple.contact.search.excluded_pairs import stitched_points
from supple.contact.search.point_inside import find_depths
from supple.contact.search.surfaces import ContactSurfaces
from supple.model.system import System
from supple.runtime.threads import threads_for
from supple.solvers.xpbd.contact.contact_rows import ContactRows, LoadedRows, choose_rows, push_rows
from supple.solvers.xpbd.contact.detection.edge_contacts import (
    find_edge_contacts,
    find_edge_passages,
    note_edge_passages,
)
from supple.solvers.xpbd.contact.detection.point_passages import find_point_passages, note_point_passages
from supple.solvers.xpbd.contact.detection.surface_contacts import find_contacts
from supple.solvers.xpbd.contact.detection.surface_lists import LEAST_REACH, SurfaceLists
from supple.solvers.xpbd.contact.memory import SurfaceMemory
from supple.solvers.xpbd.contact.movers import MovedPoints
from supple.solvers.xpbd.contact.sweeps.row_sweeps import PreparedRows, note_shares, prepare_rows, solve_rows
from supple.solvers.xpbd.rigid.bodies import RigidBodies

# Of the mean surface edge: the largest gap that is reported, and how far contacts may move a point in a substep, where
# edges are looked for.
NEAR, SLACK = 1.0, 0.05
# Sweeps over all contacts of a substep; see docs/theory/contact.md for the effect of more. The second number:
# where they are solved again because something has still passed through something.
SWEEPS, MORE_SWEEPS = 2, 4
# How often contacts are solved again because edges have passed through each other.
MOST_PASSAGES = 5
# Below this many active points, contacts are found before a second thread has started.
PARALLEL_FROM = 500


class SurfaceCollisions:
    """Points against triangles, and edges against edges. Lists of candidates are renewed when a point moved too far.

    `begin_step` sets all that substeps read, from its arguments alone.
    """

    def __init__(
        self,
        system: System,
        surfaces: ContactSurfaces,
        poses: ObstaclePoses,
        edge_length: float,
        rates: NDArray[np.float64],
        rigid: RigidBodies,
    ) -> None:
        self.surfaces = s = surfaces
        self.poses = poses
        self.edge_length = edge_length
        n, pieces = len(s.point_piece), len(s.closed)
        rest = np.concatenate([system.rest_points[s.rows], s.fixed_points])
        widest = float(np.diagonal(s.gaps).max(initial=0.0))
        self._stitched = stitched_points(system, s, poses)
        self._apart = np.ones((pieces, pieces), dtype=np.bool_)
        self._edge_rules = (s.point_piece, s.closed, s.gaps, s.friction, self._apart)
        self._slack = widest + SLACK * edge_length
        self._x, self._before = np.zeros((n, 3)), np.zeros((n, 3))
        # Where the substep began; `_before` also has the shifts that remove old overlaps.
        self._begun = np.zeros((n, 3))
        self._pieces = (s.point_piece, s.triangles, s.triangle_piece, s.closed, s.gaps, s.friction)
        self._predicted = np.zeros((n, 3))
        self._inverse_masses = s.inverse_masses.copy()
        self._moved = MovedPoints(s.embedded, len(s.fixed_points), rigid, self._inverse_masses)
        self._free_masses = self._inverse_masses.copy()
        self._movers, self._rigid = self._moved.movers, rigid
        # Number of points on rigid bodies.
        self.rigid_points = int(np.count_nonzero(self._movers.body >= 0))
        own = rates[s.embedded.vertices[s.embedded.start[:-1]]]
        self._points = (self._movers, np.concatenate([own, np.zeros(len(s.fixed_points))]))
        # How far gravity moves the prediction of rigid bodies [m/s^2]; see `begin_substep`.
        self._falling = np.where(self._movers.body >= 0, 1.0, 0.0)[:, None] * system.gravity
        self._lists = SurfaceLists(s, rest, edge_length, self._movers.body, self._stitched)
        self._rows = ContactRows()
        # The contacts between pieces that sleep.
        self._standing = LoadedRows.none()
        self._smallest = np.zeros(n)
        # Whether nothing had passed through anything after the last projection; whether it moved anything; how much it
        # changed a gap, at most [m].
        self.separated, self.moved, self.changed = True, False, 0.0
        # Of the last search: the rows of each kind that take part.
        self._chosen = [np.zeros(0, dtype=np.int64)] * 2
        self._prepared: list[PreparedRows | None] = [None] * 2
        # See `SurfaceMemory`.
        self._depth = np.zeros((2, n))
        self._entered = np.zeros(n, dtype=np.int32)
        self._dt = self._h = self._least_gap = 0.0

    def begin_step(
        self,
        x: NDArray[np.float64],
        v: NDArray[np.float64],
        time: float,
        dt: float,
        memory: SurfaceMemory | None,
        crossing: Iterable[tuple[int, int]],
        asleep: NDArray[np.bool_],
    ) -> None:
        """See `Collisions.begin_step`; `asleep` are the bodies (b,) that take no part."""
        s, owner = self.surfaces, self.surfaces.owner
        still = np.where(owner < len(asleep), asleep[np.minimum(owner, len(asleep) - 1)], True)
        self._lists.choose(s.allowed & ~(still[:, None] & still))
        self._inverse_masses[:] = np.where(still[s.point_piece], 0.0, self._free_masses)
        self._apart[:] = True
        for a, b in crossing:
            both = (owner[:, None] == a) & (owner == b)
            self._apart &= ~(both | both.T)
        bodies = len(self.surfaces.rows)
        self._dt, self._least_gap = dt, NEAR * self.edge_length
        self._moved.begin_step(asleep[self._rigid.numbers] | self._rigid.held)
        self._moved.take(x, self._x)
        self.surfaces.place_obstacles(self.poses, time, self._x)
        motions = np.zeros_like(self._x)
        self.surfaces.place_obstacles(self.poses, time + dt, motions)
        motions[bodies:] -= self._x[bodies:]
        self._moved.take(v * dt, motions)
        self._before[:] = self._x
        self._recall(memory, still[s.point_piece])
        if not still.all():
            if not self._lists.hold(self._depth.max(axis=0)):
                self._list(motions)
            self._lists.number(self._rows)
            self._lists.excursions[:] = 0.0

    def begin_substep(self, x: NDArray[np.float64], x_prev: NDArray[np.float64], h: float) -> bool:
        """See `Collisions.begin_substep`."""
        rows, self._h = self._rows, h
        self._moved.begin_substep()
        self._take(x, x_prev)
        self._predicted[:], self._begun[:] = self._x, self._before
        if len(self._rigid):
            # What rests on a point approaches it in every substep by its fall; this is not an impact.
            self._predicted -= h * h * self._falling
        if rows.loads:
            push_rows(self._x, self._before, self._movers, rows.described, h)
            self._settle()
            self._moved.give(self._x, self._before, x, x_prev)
        return rows.loads

    def project(
        self,
        x: NDArray[np.float64],
        x_prev: NDArray[np.float64],
        times: tuple[float, float],
        limit: float,
    ) -> tuple[int, float]:
        """Keep surfaces apart over the substep `times` = (beginning, end) [s]; returns what `solve_rows` does."""
        s, h = self.surfaces, times[1] - times[0]
        self._take(x, x_prev)
        s.place_obstacles(self.poses, times[1], self._x)
        s.place_obstacles(self.poses, times[0], self._before)
        self._begun[len(s.rows) :] = self._before[len(s.rows) :]
        self._predicted[len(s.rows) :] = self._x[len(s.rows) :]
        if self._lists.left(self._x, self._before):
            self._list((self._x - self._before) * (self._dt / h))
            self._lists.number(self._rows)
        contacts, smallest = 0, np.inf
        self.separated, self.moved = True, False
        self._look_near()
        self._rows.active[:] = False
        self._chosen = [chosen[:0] for chosen in self._chosen]
        if not self._lists.near and not self._rows.loads:
            return 0, np.inf
        # Obstacles come last because they cannot be moved.
        for kind, part in enumerate(((0, s.body_triangles), (s.body_triangles, len(s.triangles)))):
            if part[0] < part[1] and len(self._rows.keys):
                gap = self._find(kind, part, h)
                pushes, least = self._solve(kind, h, limit)
                for k in range(MOST_PASSAGES):
                    if not self._find_passages(kind, part, h):
                        break
                    # What was about to pass through is separated as an overlap is; otherwise it would remain that near.
                    pushes, _ = self._solve(kind, h, 0.0 if k else limit)
                    self.separated &= k < MOST_PASSAGES - 1
                contacts, smallest = contacts + pushes, min(smallest, gap, least)
        # Larger gaps in this frame are of no interest.
        self._least_gap = min(self._least_gap, smallest)
        if self.moved:
            self._moved.give(self._x, self._before, x, x_prev)
        return contacts, smallest

    def project_again(self, x: NDArray[np.float64], x_prev: NDArray[np.float64], h: float) -> int:
        """Project the contacts of the last search at positions that have changed since then; returns their number.

        Sweeps are more where something has passed through something: it takes many to push a pile apart.
        """
        self._take(x, x_prev)
        self.changed = 0.0
        sweeps = SWEEPS if self.separated else MORE_SWEEPS
        contacts = sum(self._solve(kind, h, 0.0, sweeps)[0] for kind in range(2))
        self._moved.give(self._x, self._before, x, x_prev)
        return contacts

    def check_separated(self, x: NDArray[np.float64]) -> None:
        """Take notice of what has passed through something in the substep that ends at x (n, 3) [m]."""
        self.separated = not self._passages(x).any()

    def passed(self, x: NDArray[np.float64]) -> NDArray[np.int64]:
        """(k, 2) the pieces of which one has passed through the other in the substep that ends at x (n, 3) [m]."""
        return np.argwhere(self._passages(x))

    def _passages(self, x: NDArray[np.float64]) -> NDArray[np.bool_]:
        self._moved.take(x, self._x)
        self._look_again()
        shapes, lists = (self._x, self._begun), self._lists
        passed = np.zeros_like(self._apart)
        if not self._lists.near:
            return passed
        note_point_passages(*shapes, lists.near.points, self._pieces, self._apart, self._stitched, passed)
        edges = (lists.pairs, lists.near.edges, lists.edges.arrays[0], self._edge_rules)
        note_edge_passages(*shapes, *edges, passed)
        return passed

    def component(self, labels: NDArray[np.integer]) -> NDArray[np.int64]:
        """(p,) the label of each piece, of the labels of all vertices; -1 for obstacles."""
        s = self.surfaces
        found = np.full(len(s.owner), -1, dtype=np.int64)
        found[s.point_piece[: len(s.rows)]] = labels[s.embedded.vertices[s.embedded.start[:-1]]]
        return found

    def forces(self) -> LoadedRows:
        """Copies of the contacts that push in the substep that was projected last."""
        return self._rows.loaded()

    @property
    def positions(self) -> NDArray[np.float64]:
        """(p, 3) of all points, as they were at the latest projection; a copy [m]."""
        return self._x.copy()

    def end_substep(self) -> None:
        """Keep the share of the forces with which the next substep begins."""
        if len(self._rows.keys):
            note_shares(self._before, self._predicted, self._points, self._rows.described, self._h)
        self._rows.keep()

    def _look_near(self) -> None:
        """Set which listed pairs come as near in this substep that contacts may still make them meet."""
        margin, memory = max(self._slack, self._least_gap), (self._depth, self._entered)
        self._lists.near.look(self._begun, self._x, margin, self._rows.forces, memory)

    def _look_again(self) -> None:
        """`_look_near`, where contacts have moved a point that far that this could change anything."""
        if self._lists.near.left(self._x, 0.5 * self._slack):
            self._look_near()

    def _take(self, x: NDArray[np.float64], x_prev: NDArray[np.float64]) -> None:
        self._moved.begin(x, x_prev, self._x, self._before)

    def _settle(self) -> None:
        self._moved.settle(self._x, self._before, self._predicted)

    def _solve(self, kind: int, h: float, limit: float, sweeps: int = SWEEPS) -> tuple[int, float]:
        """Project the chosen rows of one kind; returns how many push, and the smallest gap before the substep."""
        chosen, described = self._chosen[kind], self._rows.described
        if not len(chosen):
            return 0, np.inf
        self.moved = True
        prepared = self._prepared[kind] = self._prepared[kind] or prepare_rows(chosen, self._movers, described)
        places = (self._x, self._before, self._predicted, self._begun, self._movers)
        *found, changed = solve_rows(*places, chosen, described, prepared, h, limit, sweeps, self._depth[kind])
        self._settle()
        self.changed = max(self.changed, changed)
        return found[0], found[1]

    def _find_passages(self, kind: int, part: tuple[int, int], h: float) -> bool:
        """Let points and edges that have passed through something take part. Returns whether there are any."""
        s, described = self.surfaces, self._rows.described
        if self.moved:
            self._look_again()
        shapes, lists = (self._x, self._begun), self._lists
        points = (lists.near.points, self._pieces, self._apart, part, self._stitched)
        passed = find_point_passages(*shapes, *points, described, self._entered)
        edges = (lists.pairs, lists.near.edges, lists.edges.arrays[0], self._edge_rules)
        passed += find_edge_passages(*shapes, *edges, len(s.rows), kind, described)
        if passed:
            self._choose(kind, h)
        return passed > 0

    def _find(self, kind: int, part: tuple[int, int], h: float) -> float:
        """Find the contacts with the triangles of one part, of bodies (0) or of obstacles (1); the smallest gap [m]."""
        rows, lists = self._rows, self._lists
        bodies, near = len(self.surfaces.rows), self._least_gap
        described = rows.described
        smallest = np.inf
        rows.active[:] = False
        n_active = lists.near.lists[0]
        if n_active:
            shapes = (self._pieces, (self._depth[kind], self._entered, lists.complete))
            places, which = (self._x, self._before, lists.near.lists), (near, part, self._stitched)
            with threads_for(n_active, PARALLEL_FROM):
                find_contacts(*places, *shapes, *which, described, self._smallest)
            smallest = self._smallest[:n_active].min()
        if len(lists.edges.keys):
            which = (near, bodies, kind)
            found = (self._x, self._before, lists.pairs, lists.near.edges, lists.edges.arrays, self._edge_rules)
            smallest = min(smallest, find_edge_contacts(*found, *which, described))
        self._choose(kind, h)
        return float(smallest)

    def _choose(self, kind: int, h: float) -> None:
        places, first_obstacle = (self._x, self._before, self._movers), len(self.surfaces.rows)
        self._chosen[kind] = choose_rows(*places, self._rows.described, first_obstacle, kind, h)
        self._prepared[kind] = None

    def memory(self, x: NDArray[np.float64]) -> SurfaceMemory:
        """What the next step needs; `x` (n, 3) are the positions at the end of this one, after all contacts [m]."""
        s = self.surfaces
        positions = np.concatenate([s.embedded.positions(x), self._x[len(s.rows) :]])
        return SurfaceMemory(
            s.triangles[: s.body_triangles],
            positions,
            self._depth.copy(),
            self._entered.copy(),
            self._lists.excursions.copy(),
            self._rows.loaded().joined(self._standing),
        )

    def _recall(self, memory: SurfaceMemory | None, still: NDArray[np.bool_]) -> None:
        """Restore what `memory` holds of points that are still where they were, and find the overlaps of the others.

        Contacts between points (n,) that are `still` are standing.
        """
        s = self.surfaces
        self._entered[:], self._lists.excursions[:] = -1, 0.0
        known, loaded = 0, LoadedRows.none()
        if memory is not None:
            triangles = s.triangles[: s.body_triangles]
            known = memory.matching_points(triangles, self._x, LEAST_REACH * self.edge_length)
            self._entered[:known] = memory.entered[:known]
            self._lists.excursions[:known] = memory.excursions[:known]
            self._depth[:, :known] = memory.depth[:, :known]
            loaded = memory.loaded.chosen(np.asarray((memory.loaded.vertices < known).all(axis=1)))
        standing = np.asarray(still[loaded.vertices].all(axis=1))
        self._standing, loaded = loaded.chosen(standing), loaded.chosen(~standing)
        self._rows.restore(loaded, loaded.keys)
        if known < len(self._x):
            find_depths(s, self._x, self._depth)

    def _list(self, motions: NDArray[np.float64]) -> None:
        self._lists.renew(self._x, self._before, motions, self._depth.max(axis=0))
