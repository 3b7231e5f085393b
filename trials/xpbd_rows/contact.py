"""Contact in the substeps of a frame: rows at x_n, their solution, and the guarantee."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.contact.mesh.obstacles import ObstaclePoses
from supple.numerics.adjacency import adjacency
from supple.numerics.mat3 import dot, row, subtract
from supple.runtime.kernel_cache import njit
from supple.solvers.xpbd.assessment.findings import tangled_bodies
from supple.solvers.xpbd.contact.response_rates import response_rates
from supple.solvers.xpbd.contact.settings import XPBDContact
from supple.solvers.xpbd.frame.substep_limits import restore
from supple.solvers.xpbd.integration import update_velocities
from supple.solvers.xpbd.workspace import XPBDWorkspace
from trials.xpbd_rows import admit as guarantee
from trials.xpbd_rows import tets as volumes
from trials.xpbd_rows.admit import Cuts, Marks, Movers
from trials.xpbd_rows.bodies import Bodies, describe, place_nodes, take_twists
from trials.xpbd_rows.lists import Lists
from trials.xpbd_rows.rows import Rows, detect, is_last_shape, no_walls
from trials.xpbd_rows.shapes import RowShapes, Walls
from trials.xpbd_rows.solve import keep_impulses, push_kept, solve
from trials.xpbd_rows.surface import row_surface
from trials.xpbd_rows.tets import Tets

# Of the mean edge: the gap between surfaces; of the gap: that from simple shapes, and how far nodes may go beyond what
# was expected of them when rows were found.
GAP, SKIN, SLACK = 0.05, 0.01, 0.25
# Of the mean edge: how much of a lack of gap is taken back in a frame.
RECOVERED = 0.05
# Of the gap: what the last sweep over the rows may change; the most sweeps.
RESIDUAL, MOST_SWEEPS = 0.02, 8
# The same of rigid bodies, which nothing else corrects: of the fall in a substep, and the most sweeps.
RIGID_RESIDUAL, MOST_RIGID_SWEEPS = 0.1, 60
# How often tets that lose too much volume are projected in turn with rows, and the share of what the guard asks for
# at which that ends. Tets are cut inside of their body so that they keep the last share.
MOST_PROJECTIONS, ENOUGH, KEEP_INSIDE = 10, 0.7, 0.3


@dataclass
class RowCounts:
    """What happened in the substeps of a frame: see `XPBDDetails`; `crushed` substeps in which nothing could help."""

    substeps: int = 0
    rows: int = 0
    sweeps: int = 0
    residual: float = 0.0
    projections: int = 0
    pairs_cut: int = 0
    inside_cut: int = 0
    cut: int = 0
    crushed: int = 0
    late: int = 0


class RowContact:
    """The contact of a scene on the nodes (N, 4) of its solver, whose first rows are the workspace's `extended`."""

    def __init__(self, ws: XPBDWorkspace, settings: XPBDContact | None) -> None:
        system = ws.system
        n, edge = len(system.masses), ws.collisions.edge_length
        self.ws, self.edge = ws, edge
        self.gap = settings.thickness if settings is not None and settings.thickness is not None else GAP * edge
        self.surface = surface = row_surface(system, ws.rigid, len(system.stitching.anchors), settings, edge)
        count = surface.count
        self.nodes, self.begin_nodes, self.speeds = np.zeros((count, 4)), np.zeros((count, 3)), np.zeros((count, 3))
        self.nodes[: len(ws.extended)] = ws.extended
        ws.extended, ws.points = self.nodes[: len(ws.extended)], self.nodes[:n]
        ws.previous, ws.velocities = self.begin_nodes[:n], self.speeds[:n]
        self._embedded = (count - len(surface.embedded[0]), *surface.embedded)
        self.bodies = Bodies.of(surface.body, len(ws.rigid))
        on_bodies = np.flatnonzero(surface.body >= 0)
        self._movers = Movers(self.bodies, adjacency(surface.body[on_bodies], on_bodies, len(ws.rigid)))
        self._poses = ObstaclePoses(system.obstacles)
        self._shapes = RowShapes(system, self._poses)
        self.lists = Lists(system, surface, self._shapes, self.gap)
        self.tets = Tets.of(system, count)
        self._rows = Rows.room(1024)
        self._chosen = np.zeros(0, dtype=np.bool_)
        self._rates = np.zeros(count)
        self._rates[:n] = np.where(np.isfinite(rates := response_rates(system)), rates, 0.0)
        self._marks = Marks(np.zeros(count, np.int64), np.zeros(8 * count, np.int64), np.zeros(0, np.bool_))
        self._cuts = Cuts.room(0)
        self._elastic, self._far = np.zeros((count, 3)), np.zeros(count, dtype=np.bool_)
        self._everyone = np.zeros(0, dtype=np.bool_)
        self._before = np.zeros((count, 3))
        self._parts = [np.arange(part.vertices.start, part.vertices.stop) for part in system.bodies]
        self._h = self._dt = self.time = 0.0
        self._origin = np.zeros(3)
        self.tangled: frozenset[str] = frozenset()
        self._frames = self._shapes.frames(0.0, np.zeros(3)), self._shapes.frames(0.0, np.zeros(3))
        self._walls: Walls = no_walls()
        self.counts = RowCounts()

    def begin_frame(self, time: float, dt: float, origin: NDArray[np.float64]) -> None:
        """Begin a frame of dt [s] at `time` [s]; places of nodes are about an origin [m]."""
        self._dt, self._origin, self.counts = dt, origin, RowCounts()
        self._place_obstacles(time)
        place_nodes(self.nodes, *self._embedded)
        self.nodes[self._embedded[0] :, 3] = self.nodes[self._embedded[1][:, 0], 3]
        self.begin_nodes[:] = self.nodes[:, :3]
        self._frames = self._frames[0], self._shapes.frames(time, origin)
        volumes.measure(self.nodes, self.tets, False, 1.0)
        self.tets.J[:] = self.tets.now
        self.tangled = tangled_bodies(self.ws.system, self.tets.J)

    def _place_obstacles(self, time: float) -> None:
        surface = self.surface
        if len(surface.anchors):
            R, t = self._poses.at(time)
            of = surface.of_anchor
            mine = slice(surface.first, surface.first + len(of))
            self.nodes[mine, :3] = np.einsum("kij,kj->ki", R[of], surface.anchors) + t[of] - self._origin

    def begin(self, time: float, h: float) -> None:
        """Begin the substep of h [s] that ends at `time` [s]: valid lists, and the impulses that were kept."""
        self.time, self._h, lists, x = time, h, self.lists, self.nodes
        self.counts.substeps += 1
        self.begin_nodes[:] = x[:, :3]
        self._frames = self._frames[1], self._shapes.frames(time, self._origin)
        if self._poses.moving.any():
            self._place_obstacles(time)
            moved = slice(self.surface.first, self.surface.first + len(self.surface.anchors))
            self.speeds[moved] = (x[moved, :3] - self.begin_nodes[moved]) / h
        self._begin_bodies()
        lists.renew(self.begin_nodes, self.speeds, h, self._frames[0])
        self._measure_walls()
        self._before[:] = self.speeds
        push_kept(self._at_begin(), self.bodies, self.speeds, lists.near, lists.pairs, self._walls, self.gap, h)
        take_twists(self.speeds, self.ws.rigid.control, self.bodies, h)

    def _begin_bodies(self) -> None:
        rigid = self.ws.rigid
        if len(rigid):
            place_nodes(self.speeds, *self._embedded)
            free = self.nodes[rigid.control[:, 0], 3] > 0.0
            describe(self.begin_nodes, rigid.control, rigid.masses, free, self.bodies)

    def _move_bodies(self) -> None:
        """Move rigid bodies as their momenta and the twists determine."""
        ws = self.ws
        if len(ws.rigid):
            take_twists(self.speeds, ws.rigid.control, self.bodies, self._h)
            ws.rigid.advance(ws.points, ws.previous, ws.velocities, self._h)
            place_nodes(self.nodes, *self._embedded)

    def _at_begin(self) -> NDArray[np.float64]:
        """The nodes at x_n: obstacles may have moved already."""
        if not self._poses.moving.any():
            return self.nodes
        nodes = self.nodes.copy()
        nodes[:, :3] = self.begin_nodes
        return nodes

    def _measure_walls(self) -> None:
        lists = self.lists
        mine = is_last_shape(lists.pairs, lists.near)
        nodes, shapes = lists.pairs.nodes[mine, 0], lists.pairs.shapes[mine]
        self._walls = self._shapes.walls(self.begin_nodes, nodes, shapes, *self._frames)

    def detect(self) -> int:
        """Find the rows of the substep; returns their number."""
        ws, body = self.ws, self.surface.body
        if len(ws.rigid):
            place_nodes(self.nodes, *self._embedded)
            turns = self._h * ws.rigid.spins(ws.previous, ws.velocities)
            mine = body >= 0
            arms = np.linalg.norm(self.bodies.arms[mine], axis=1)
            self.bodies.bends[mine] = arms * (1.0 - np.cos(0.5 * np.minimum(turns[body[mine]], np.pi)))
        self._elastic[:] = self.nodes[:, :3]
        if len(self._chosen) != len(self.lists.pairs.keys):
            self._chosen = np.zeros(len(self.lists.pairs.keys), dtype=np.bool_)
        self._chosen[:] = False
        return self._detect(0, (1.0 + 2.0 * SLACK) * self.gap, self._everyone)

    def _detect(self, first: int, reach: float, moved: NDArray[np.bool_]) -> int:
        lists = self.lists
        self._make_room(first + len(lists.near))
        targets = self.gap, SKIN * self.gap
        given = (
            self.begin_nodes,
            self.nodes,
            self.bodies,
            self.surface.simplices.first,
            lists.near,
            lists.pairs,
            self._walls,
        )
        return detect(*given, reach, targets, self._chosen, moved, first, self._rows)

    def _make_room(self, count: int) -> None:
        if count > len(self._rows.pairs):
            rows = Rows.room(count + count // 2)
            for new, old in zip(rows, self._rows, strict=True):
                new[: len(old)] = old
            self._rows = rows
        most = len(self._rows.pairs)
        if len(self._marks.planes) < most:
            self._marks = self._marks._replace(planes=np.zeros(most, dtype=np.bool_))
        if len(self._cuts.shares) < most + len(self.tets.J):
            self._cuts = Cuts.room(most + len(self.tets.J))

    def solve(self, rows: int) -> None:
        """Solve the rows."""
        sweeps, residual = self._sweep(rows, MOST_RIGID_SWEEPS if len(self.ws.rigid) else MOST_SWEEPS)
        self.counts.rows += rows
        self.counts.sweeps += sweeps
        self.counts.residual = max(self.counts.residual, residual)

    def _sweep(self, rows: int, most: int) -> tuple[int, float]:
        tolerance = RESIDUAL * self.gap
        if len(self.ws.rigid):
            fall = float(np.linalg.norm(self.ws.system.gravity)) * self._h**2
            tolerance = min(tolerance, RIGID_RESIDUAL * fall) if fall > 0.0 else tolerance
        found = solve(self.nodes, self.bodies, self.begin_nodes, self._rows, rows, tolerance, most)
        self._move_bodies()
        return found

    def hold_volumes(self, rows: int) -> int:
        """Project tets that lose too much volume, in turn with rows; shorten the motions of what is left over.

        They are shortened relative to the mean motion of their body, so that nothing stops in the world for it.
        Returns how many tets, listed, have still lost too much.
        """
        ws, h, tets, guard = self.ws, self._h, self.tets, self.ws.guard
        x, x_n, v = ws.points, ws.previous, ws.velocities
        if not volumes.measure(self.nodes, tets, True, 1.0):
            return 0
        volumes.set_bounds(tets, guard.bounds)
        update_velocities(x, x_n, v, h)
        for _ in range(MOST_PROJECTIONS):
            guard.project(x)
            self._restore()
            self._sweep(rows, 1)
            update_velocities(x, x_n, v, h)
            self.counts.projections += 1
            if not volumes.measure(self.nodes, tets, True, ENOUGH):
                return 0
        low = volumes.measure(self.nodes, tets, False, KEEP_INSIDE)
        if not low:
            return 0
        base = self._carried()
        for part in self._parts:
            free = part[x[part, 3] > 0.0]
            base[free] += (x[free, :3] - x_n[free]).mean(axis=0)
        self._make_room(0)
        cut, _ = guarantee.admit(
            base, self.nodes, self._movers, self._rows, 0, tets, low, 0, KEEP_INSIDE, 0.0, self._marks, self._cuts
        )
        self.counts.inside_cut += cut
        self._restore()
        return volumes.measure(self.nodes, tets, False, guarantee.KEEP_J)

    def _restore(self) -> None:
        if self.ws.momentum is not None:
            restore(self.ws, self._h)

    def _carried(self) -> NDArray[np.float64]:
        """x_n, with what goes where it is told at its end."""
        base = self.begin_nodes.copy()
        told = self.nodes[:, 3] == 0.0
        base[told] = self.nodes[told, :3]
        return base

    def keep(self, rows: int) -> None:
        """Keep the impulses with which the next substep begins."""
        lists = self.lists
        keep_impulses(self._rows, rows, self._before, self._h, self._rates, lists.near, lists.pairs)

    def admit(self, rows: int, low: int) -> None:
        """Widen gaps and put nodes back onto walls, then shorten motions until the guarantee holds."""
        h, slack = self._h, SLACK * self.gap
        loose = np.where(self.ws.rigid.joined, 0.0, self.bodies.w)
        recovered = RECOVERED * self.edge * h / self._dt
        moved = guarantee.widen(self.nodes, self._movers, loose, self._rows, rows, self.gap, recovered, self._marks)
        # Pairs that were left out are asked again where something went farther than was expected.
        if _farther(self.nodes, self._elastic, slack, self._far):
            rows = self._detect(rows, 0.0, self._far)
        cut = self._cut(rows, low, moved)
        if not self.lists.cover(self.begin_nodes, self.nodes, h, self._frames[0]):
            # A node has left what the lists expect of it: lists of this very motion, and again.
            self.counts.late += 1
            self._chosen = np.zeros(len(self.lists.pairs.keys), dtype=np.bool_)
            self._measure_walls()
            cut += self._cut(self._detect(0, 0.0, self._everyone), 0, 0)
        self.counts.cut += cut > 0
        self.tets.J[:] = self.tets.now

    def _cut(self, rows: int, low: int, moved: int) -> int:
        nearest = guarantee.NEAREST * self.gap
        cut, _ = guarantee.admit(
            self._carried(), self.nodes, self._movers, self._rows, rows, self.tets, low, moved, guarantee.KEEP_J,
            nearest, self._marks, self._cuts,
        )  # fmt: skip
        if cut:
            self.counts.pairs_cut += cut
            if len(self.ws.rigid):
                self.ws.rigid.place(self.nodes[: len(self.ws.points), :3])
                place_nodes(self.nodes, *self._embedded)
                place_nodes(self.speeds, *self._embedded)
            share = self.nodes, self._movers, self._rows, self.begin_nodes, self.speeds, self._cuts, cut
            guarantee.share_motion(*share)
            take_twists(self.speeds, self.ws.rigid.control, self.bodies, 1.0)
            crossing = guarantee.count_crossing(self.nodes, self._rows, rows, nearest)
            low = volumes.measure(self.nodes, self.tets, False, 0.5 * guarantee.KEEP_J)
            self.counts.crushed += crossing + low > 0
        return cut


@njit(cache=True)
def _farther(points, reference, most, far):
    """Which nodes (N,) are farther than `most` [m] from a reference (N, 3); returns whether there are any."""
    found = False
    for i in range(len(reference)):
        d = subtract(row(points, i), row(reference, i))
        far[i] = not dot(d, d) <= most * most
        found = found or far[i]
    return found
