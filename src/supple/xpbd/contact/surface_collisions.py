"""Contact between surfaces of bodies and of triangle obstacles, over the substeps of a frame."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from supple.contact.obstacle_poses import ObstaclePoses
from supple.contact.search.boxes import boxes_of_pieces
from supple.contact.search.excluded_pairs import excluded_pairs
from supple.contact.search.point_inside import depths_inside
from supple.contact.search.point_lists import PairFinder
from supple.contact.search.reach import any_beyond_radii, common_motions, search_radii
from supple.contact.search.stitch_masks import stitched_points
from supple.contact.search.surfaces import ContactSurfaces
from supple.system import System
from supple.xpbd.contact.contact_rows import ContactRows, LoadedRows, choose_rows, deactivate, push_rows
from supple.xpbd.contact.detection.edge_contacts import find_edge_contacts, find_edge_passages, note_edge_passages
from supple.xpbd.contact.detection.edge_pairs import EdgePairs
from supple.xpbd.contact.detection.near_pairs import NearPairs
from supple.xpbd.contact.detection.piece_runs import PieceRuns
from supple.xpbd.contact.detection.point_passages import find_point_passages, note_point_passages
from supple.xpbd.contact.detection.surface_contacts import find_contacts
from supple.xpbd.contact.detection.surface_edges import surface_edges
from supple.xpbd.contact.memory import SurfaceMemory
from supple.xpbd.contact.movers import MovedPoints
from supple.xpbd.contact.sweeps.prepared_rows import PreparedRows, prepare_rows
from supple.xpbd.contact.sweeps.row_sweeps import note_shares, solve_rows
from supple.xpbd.rigid.bodies import RigidBodies

# Of the mean surface edge: the least and the largest motion of a point that lists of candidates allow for, and the
# largest gap that is reported.
LEAST_REACH, MOST_REACH, NEAR = 0.05, 0.2, 1.0
# The largest motion of points of rigid bodies, whose lists are short: one body that is too fast makes all lists new.
RIGID_REACH = 0.6
# Of the mean surface edge: how far contacts may move a point in a substep, where edges are looked for.
SLACK = 0.05
# Sweeps over all contacts of a substep; see docs/xpbd_contact.md for what more of them would change. The second number:
# where they are solved again because something has still passed through something.
SWEEPS, MORE_SWEEPS = 2, 4
# How often contacts are solved again because edges have passed through each other.
MOST_PASSAGES = 5
# Points of each piece from which its motion as a rigid body is found in a substep.
ENOUGH_POINTS = 64
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
        excluded = excluded_pairs(s, rest, 2.0 * min(widest, 0.5 * edge_length))
        self._stitched = stitched_points(system, s, poses)
        self._allowed = s.allowed.copy()
        self._rules = (self._allowed, *excluded)
        self._apart = np.ones((pieces, pieces), dtype=np.bool_)
        self._edge_rules = (s.point_piece, s.closed, s.gaps, s.friction, self._apart)
        self._slack = widest + SLACK * edge_length
        edges = surface_edges(s, rest)
        self._edges = EdgePairs(edges, s, rest, self._stitched)
        self._near_pairs = NearPairs(n, s.triangles, self._edges.arrays[0])
        self._finder = PairFinder(~edges.blunt)
        self._x, self._before, self._gathered = np.zeros((n, 3)), np.zeros((n, 3)), np.zeros((n, 3))
        # Where the substep began; `_before` also has the shifts that remove old overlaps.
        self._begun = np.zeros((n, 3))
        self._shapes = (self._x, s.point_piece, s.triangles, s.triangle_piece)
        self._pieces = (s.point_piece, s.triangles, s.triangle_piece, s.closed, s.gaps, s.friction)
        self._predicted = np.zeros((n, 3))
        self._inverse_masses = s.inverse_masses.copy()
        self._moved = MovedPoints(s.embedded, len(s.fixed_points), rigid, self._inverse_masses)
        self._free_masses = self._inverse_masses.copy()
        self._movers, self._rigid = self._moved.movers, rigid
        own = rates[s.embedded.vertices[s.embedded.start[:-1]]]
        self._points = (self._movers, np.concatenate([own, np.zeros(len(s.fixed_points))]))
        # How far gravity moves the prediction of rigid bodies [m/s^2]; see `begin_substep`.
        self._falling = np.where(self._movers.body >= 0, 1.0, 0.0)[:, None] * system.gravity
        self._runs = PieceRuns(self._finder, n, s.triangle_piece)
        self._rows = ContactRows()
        # The contacts between pieces that sleep.
        self._standing = LoadedRows.none()
        self._smallest = np.zeros(n)
        # Whether nothing had passed through anything after the last projection; whether it moved anything; how much it
        # changed a gap, at most [m].
        self.parted, self.moved, self.changed = True, False, 0.0
        # Of the last search: the rows of each kind that take part.
        self._chosen = [np.zeros(0, dtype=np.int64)] * 2
        self._prepared: list[PreparedRows | None] = [None] * 2
        self._far, self._near = np.zeros((n, 3)), np.zeros((n, 3))
        self._common = np.zeros((pieces + 1, 3)), np.zeros((pieces, 3)), np.zeros((pieces, 3, 3))
        # Obstacles stand still, so that no motion is common to all points where there is one.
        self._all_share = len(s.fixed_points) == 0
        self._each = max(1, int(np.bincount(s.point_piece).min(initial=n)) // ENOUGH_POINTS)
        self._complete = np.full(n, -1.0)
        self._listed = np.zeros_like(s.allowed)
        self._most_reach = np.where(self._movers.body >= 0, RIGID_REACH, MOST_REACH) * edge_length
        self._gap = np.where(s.allowed, s.gaps, 0.0).max(axis=1)[s.point_piece]
        # See `SurfaceMemory`.
        self._depth = np.zeros((2, n))
        self._entered = np.zeros(n, dtype=np.int32)
        self._excursions = np.zeros(n)
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
        np.logical_and(s.allowed, ~(still[:, None] & still), out=self._allowed)
        self._edges.choose(self._allowed)
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
            if self._covers():
                self._number()
            else:
                self._gather(motions, False)
            self._excursions[:] = 0.0

    def begin_substep(self, x: NDArray[np.float64], x_prev: NDArray[np.float64], h: float) -> bool:
        """See `Collisions.begin_substep`."""
        rows, self._h = self._rows, h
        self._moved.begin_substep()
        self._moved.take(x, self._predicted)
        self._moved.take(x_prev, self._begun)
        if len(self._rigid):
            # What rests on a point approaches it in every substep by its fall; this is no impact.
            self._predicted -= h * h * self._falling
        if rows.loads:
            self._take(x, x_prev)
            push_rows(self._x, self._before, self._movers, rows.described, h)
            self._settle()
            self._give(x, x_prev)
        return rows.loads

    def project(
        self,
        x: NDArray[np.float64],
        x_prev: NDArray[np.float64],
        times: tuple[float, float],
        limit: float,
        parallel: bool,
    ) -> tuple[int, float]:
        """Keep surfaces apart over the substep `times` = (beginning, end) [s]; returns what `solve_rows` does."""
        s, h = self.surfaces, times[1] - times[0]
        self._take(x, x_prev)
        s.place_obstacles(self.poses, times[1], self._x)
        s.place_obstacles(self.poses, times[0], self._before)
        self._begun[len(s.rows) :] = self._before[len(s.rows) :]
        self._predicted[len(s.rows) :] = self._x[len(s.rows) :]
        allowed = (self._far, self._near, s.point_piece, self._all_share, self._each, self._common)
        if any_beyond_radii(self._x, self._before, self._gathered, *allowed, self._excursions):
            self._gather((self._x - self._before) * (self._dt / h), parallel)
        contacts, smallest = 0, np.inf
        self.parted, self.moved = True, False
        self._look_near()
        deactivate(self._rows.active)
        self._chosen, self._prepared = [chosen[:0] for chosen in self._chosen], [None] * 2
        if not self._near_pairs and not self._rows.loads:
            return 0, np.inf
        # Obstacles come last because they cannot be moved.
        for kind, part in enumerate(((0, s.body_triangles), (s.body_triangles, len(s.triangles)))):
            if part[0] < part[1] and len(self._rows.keys):
                gap = self._find(kind, part, h, parallel)
                pushes, least = self._solve(kind, h, limit)
                for k in range(MOST_PASSAGES):
                    if not self._find_passages(kind, part, h):
                        break
                    # What was about to pass through is parted as an overlap is; otherwise it would remain that near.
                    pushes, _ = self._solve(kind, h, 0.0 if k else limit)
                    self.parted &= k < MOST_PASSAGES - 1
                contacts, smallest = contacts + pushes, min(smallest, gap, least)
        # Larger gaps in this frame are of no interest.
        self._least_gap = min(self._least_gap, smallest)
        if self.moved:
            self._give(x, x_prev)
        return contacts, smallest

    def project_again(self, x: NDArray[np.float64], x_prev: NDArray[np.float64], h: float) -> int:
        """Project the contacts of the last search at positions that have changed since then; returns their number.

        Sweeps are more where something has passed through something: it takes many to push a pile apart.
        """
        self._take(x, x_prev)
        self.changed = 0.0
        sweeps = SWEEPS if self.parted else MORE_SWEEPS
        contacts = sum(self._solve(kind, h, 0.0, sweeps)[0] for kind in range(2))
        self._give(x, x_prev)
        return contacts

    def check_parted(self, x: NDArray[np.float64]) -> None:
        """Take notice of what has passed through something in the substep that ends at x (n, 3) [m]."""
        self.parted = not self._passages(x).any()

    def passed(self, x: NDArray[np.float64]) -> NDArray[np.int64]:
        """(k, 2) the pieces of which one has passed through the other in the substep that ends at x (n, 3) [m]."""
        return np.argwhere(self._passages(x))

    def _passages(self, x: NDArray[np.float64]) -> NDArray[np.bool_]:
        self._moved.take(x, self._x)
        self._look_again()
        shapes, near = (self._x, self._begun), self._near_pairs
        passed = np.zeros_like(self._apart)
        note_point_passages(*shapes, near.points, self._pieces, self._apart, self._stitched, passed)
        note_edge_passages(*shapes, self._pairs, near.edges, self._edges.arrays[0], self._edge_rules, passed)
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
        note_shares(self._before, self._predicted, self._points, self._rows.described, self._h)
        self._rows.keep()

    def _look_near(self) -> None:
        """Set which listed pairs come as near in this substep that contacts may still make them meet."""
        margin, memory = max(self._slack, self._least_gap), (self._depth, self._entered)
        self._near_pairs.look(self._begun, self._x, margin, self._rows.forces, memory)

    def _look_again(self) -> None:
        """`_look_near`, where contacts have moved a point that far that this could change anything."""
        if self._near_pairs.left(self._x, 0.5 * self._slack):
            self._look_near()

    def _take(self, x: NDArray[np.float64], x_prev: NDArray[np.float64]) -> None:
        self._moved.begin(x, x_prev, self._x, self._before)

    def _settle(self) -> None:
        self._moved.settle(self._x, self._before, self._predicted)

    def _give(self, x: NDArray[np.float64], x_prev: NDArray[np.float64]) -> None:
        self._moved.give(self._x, self._before, x, x_prev)

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
        near = self._near_pairs
        points = (self._x, self._begun, near.points, self._pieces, self._apart, part, self._stitched)
        passed = find_point_passages(*points, described, self._entered)
        found = (self._x, self._begun, self._pairs, near.edges, self._edges.arrays[0], self._edge_rules)
        passed += find_edge_passages(*found, len(s.rows), kind, described)
        if passed:
            self._choose(kind, h)
        return passed > 0

    def _find(self, kind: int, part: tuple[int, int], h: float, parallel: bool) -> float:
        """Find the contacts with the triangles of one part, of bodies (0) or of obstacles (1); the smallest gap [m]."""
        s, rows = self.surfaces, self._rows
        bodies, near = len(s.rows), self._least_gap
        described = rows.described
        smallest = np.inf
        deactivate(rows.active)
        lists = self._near_pairs.lists
        n_active = lists[0]
        if n_active:
            shapes = (self._pieces, (self._depth[kind], self._entered, self._complete))
            several = parallel and n_active >= PARALLEL_FROM
            places, which = (self._x, self._before, lists), (near, part, self._stitched)
            find_contacts[several](*places, *shapes, *which, described, self._smallest)
            smallest = self._smallest[:n_active].min()
        if len(self._edges.keys):
            which = (near, bodies, kind)
            found = (self._x, self._before, self._pairs, self._near_pairs.edges, self._edges.arrays, self._edge_rules)
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
            self._excursions.copy(),
            self._rows.loaded().joined(self._standing),
        )

    def _recall(self, memory: SurfaceMemory | None, still: NDArray[np.bool_]) -> None:
        """Restore what `memory` holds of points that are still where they were, and find the overlaps of the others.

        Contacts between points (n,) that are `still` are standing.
        """
        s = self.surfaces
        self._entered[:], self._excursions[:] = -1, 0.0
        known, loaded = 0, LoadedRows.none()
        if memory is not None:
            triangles = s.triangles[: s.body_triangles]
            known = memory.matching_points(triangles, self._x, LEAST_REACH * self.edge_length)
            self._entered[:known] = memory.entered[:known]
            self._excursions[:known] = memory.excursions[:known]
            self._depth[:, :known] = memory.depth[:, :known]
            loaded = memory.loaded.chosen(np.asarray((memory.loaded.vertices < known).all(axis=1)))
        standing = np.asarray(still[loaded.vertices].all(axis=1))
        self._standing, loaded = loaded.chosen(standing), loaded.chosen(~standing)
        self._rows.restore(loaded, loaded.keys)
        if known < len(self._x):
            self._find_overlaps()

    def _gather(self, motions: NDArray[np.float64], parallel: bool) -> None:
        """List what may touch while no point moves farther than in a frame of these motions (n, 3) [m]."""
        s = self.surfaces
        common_motions(self._x, motions, s.point_piece, self._all_share, 1, self._common)
        scales = (LEAST_REACH * self.edge_length, self._most_reach)
        points = (self._x - self._before, self._excursions, s.point_piece)
        search_radii(self._x, motions, *points, self._common, scales, self._far, self._near)
        together = self._allowed | self._allowed.T
        alone = np.diagonal(together).astype(int) == together.sum(axis=1)
        # No list depends on how far these move.
        self._far[alone[s.point_piece], 2] = np.inf
        self._near[~np.diagonal(together)[s.point_piece], 2] = np.inf
        self._complete[:] = self._gap + LEAST_REACH * self.edge_length + self._depth.max(axis=0)
        self._far[:, 0] += self._complete
        self._near[:, 0] += self._complete
        self._finder.gather(self._shapes, (self._far, self._near), self._rules)
        self._gathered[:] = self._x
        self._runs.renew()
        near = (self._finder.starts, self._finder.triangles)
        self._edges.renew(self._x, (self._far[:, 1], self._near[:, 1]), self._gap, near, parallel)
        self._listed[:] = self._allowed
        self._number()

    def _covers(self) -> bool:
        """Whether the lists of an earlier step still hold what may touch, until a point has moved too far."""
        deep = self._complete < self._gap + LEAST_REACH * self.edge_length + self._depth.max(axis=0)
        return not deep.any() and np.array_equal(self._listed, self._allowed)

    def _number(self) -> None:
        """Give the listed pairs their rows."""
        # Keys of points come before keys of edges.
        self._rows.renew(np.concatenate([self._runs.keys, self._edges.keys]))
        self._pairs = self._edges.numbered(np.searchsorted(self._rows.keys, self._edges.keys))
        lists = self._runs.lists(np.searchsorted(self._rows.keys, self._runs.keys))
        self._near_pairs.renew(lists, self._pairs)

    def _find_overlaps(self) -> None:
        """Set how deep each point is inside other pieces, from positions alone."""
        s = self.surfaces
        boxes = np.empty((len(s.closed), 3)), np.empty((len(s.closed), 3))
        boxes_of_pieces(self._x, s.point_piece, np.zeros((len(self._x), 1)), *boxes)
        for kind, part in enumerate((slice(0, s.body_triangles), slice(s.body_triangles, None))):
            shapes = (self._x, s.point_piece, s.triangles[part], s.triangle_piece[part])
            depths_inside(shapes, s.closed, s.allowed, boxes, self._depth[kind])
