"""Contact in the substeps of a frame: rows at x_n, their solution, and the guarantee."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.contact.mesh.obstacles import ObstaclePoses
from supple.model.system import System
from supple.numerics.mat3 import dot, row, subtract
from supple.runtime.kernel_cache import njit
from supple.solvers.xpbd.contact import admit as guarantee
from supple.solvers.xpbd.contact import tets as volumes
from supple.solvers.xpbd.contact.admit import Marks
from supple.solvers.xpbd.contact.cuts import Cuts, keep_spin, share_motion
from supple.solvers.xpbd.contact.frame_forces import FrameForces, LoadedRows, loaded_rows
from supple.solvers.xpbd.contact.islands import keep_active
from supple.solvers.xpbd.contact.memory import ContactMemory
from supple.solvers.xpbd.contact.nodes import Nodes
from supple.solvers.xpbd.contact.row_solver import RowSolver
from supple.solvers.xpbd.contact.rows import Rows, detect, is_last_shape, no_walls
from supple.solvers.xpbd.contact.search.lists import Lists
from supple.solvers.xpbd.contact.search.overlaps import find_overlaps
from supple.solvers.xpbd.contact.search.surface import row_surface
from supple.solvers.xpbd.contact.settings import XPBDContact
from supple.solvers.xpbd.contact.shapes import RowShapes, Walls
from supple.solvers.xpbd.contact.solve import keep_impulses, push_kept
from supple.solvers.xpbd.contact.tets import Tets
from supple.solvers.xpbd.response_rates import response_rates
from supple.solvers.xpbd.rigid.bodies import RigidBodies
from supple.solvers.xpbd.rigid.joints import JointProjection

# Of the mean edge: how far nodes may go beyond the places that were expected when rows were found.
SLACK = 0.0125
# Of the mean edge: by how much things that are through each other are separated in a frame.
RECOVERED = 0.05
# Of the gap: cuts that do not count.
HARMLESS = 0.5
# See `detect`.
ONLY_MEETING = -1.0


@dataclass
class RowCounts:
    """Counts over the substeps of a frame.

    Attributes
    ----------
    cut : substeps in which motion was shortened; crushed : those in which that could not help
    smallest : distance of a contact where a substep began [m]
    residual : the largest change in the last sweep over the rows of a substep, in gaps
    """

    cut: int = 0
    crushed: int = 0
    smallest: float = math.inf
    residual: float = 0.0


class Contact:
    """The contact of a system in the solver's numbering.

    Attributes
    ----------
    nodes : what moves; tets : of the system
    forces : of the substeps since the frame began; counts : in these
    edge_length : mean surface edge [m]
    """

    def __init__(
        self, system: System, rigid: RigidBodies, inverse_masses: NDArray[np.float64], settings: XPBDContact | None
    ) -> None:
        n = len(system.masses)
        self._rigid = rigid
        self._surface = surface = row_surface(system, rigid, len(inverse_masses) - n, settings)
        self.edge_length = surface.edge_length
        self._faces = surface.simplices.around, surface.simplices.triangles
        count, poses = surface.count, ObstaclePoses(system.obstacles)
        self.nodes = Nodes(surface, rigid, poses, inverse_masses)
        self._solver = RowSolver(self.nodes, rigid, system.gravity, system.joined_components)
        self._shapes = RowShapes(system, poses)
        self._lists = Lists(surface, self._shapes)
        self.tets = Tets.of(system, count)
        self._rows = Rows.room(1024)
        self._chosen = np.zeros(0, dtype=np.bool_)
        self._rates = np.zeros(count)
        # Of what has no elastic energy, nothing is kept; a finite number, as infinity times zero is not one.
        self._rates[:n] = np.minimum(response_rates(system), 1e100)
        changed = np.zeros(count, np.int64), np.zeros(8 * count, np.int64)
        none = np.zeros(0, np.bool_), np.zeros(len(rigid), np.bool_)
        self._marks = Marks(*changed, *none, surface.simplices.gaps, np.zeros(1))
        self._cuts = Cuts.room(0)
        self._expected, self._far = np.zeros((count, 3)), np.zeros(count, dtype=np.bool_)
        self._everyone = np.zeros(0, dtype=np.bool_)
        self._before = np.zeros((count, 3))
        labels = system.joined_components
        free = np.ones(int(labels.max()) + 1, dtype=np.bool_)
        free[labels[system.inverse_masses == 0.0]] = free[labels[system.stitching.anchored_vertices()]] = False
        masses = np.where(rigid.welded_to >= 0, 0.0, system.masses)
        self._spins = masses, labels, free, np.zeros((len(free), 13))
        self._h = self._dt = 0.0
        self._frames = self._shapes.frames(0.0, np.zeros(3)), self._shapes.frames(0.0, np.zeros(3))
        self._walls: Walls = no_walls()
        self._names = tuple(part.name for part in system.bodies) + tuple(str(o.name) for o in system.obstacles)
        self.counts, self._began_apart = RowCounts(), False
        self.forces = FrameForces(self._names, surface.points)

    def __bool__(self) -> bool:
        """Whether any contact is possible."""
        return bool(self._lists)

    @property
    def rigid_points(self) -> int:
        """Number of points of rigid bodies' surfaces."""
        return len(self._surface.embedded[0]) if self else 0

    @property
    def kept_apart(self) -> bool:
        """Whether no surfaces crossed where the frame began, and nothing was crushed since.

        Then nothing crosses; see docs/theory/contact.md.
        """
        return self._began_apart and not self.counts.crushed

    @property
    def smallest_gap(self) -> float | None:
        """See `XPBDDetails`."""
        return self.counts.smallest if math.isfinite(self.counts.smallest) else None

    def begin_frame(
        self,
        times: tuple[float, float, float],
        origin: NDArray[np.float64],
        memory: ContactMemory | None,
        crossing: list[tuple[int, int]],
        asleep: NDArray[np.bool_],
    ) -> None:
        """Begin a frame.

        Parameters
        ----------
        times : its begin, its length, and that of its substeps [s]
        origin : (3,) of the places of nodes [m]; memory : of the frame before
        crossing : pairs of bodies and obstacles (counted after the bodies) whose surfaces cross
        asleep : (b,) bodies that do not move
        """
        time, self._dt, self._h = times
        self.counts, self.forces = RowCounts(), FrameForces(self._names, self._surface.points)
        self.nodes.begin_frame(time, origin)
        self._frames = self._frames[0], self._shapes.frames(time, origin)
        volumes.measure(self.nodes.x, self.tets, False, 1.0)
        still = np.ones(len(self._names), dtype=np.bool_)
        still[: len(asleep)] = asleep
        overlaps = find_overlaps(self._surface.simplices, self._surface.closed, self.nodes.x, crossing)
        self._began_apart = not overlaps.crossing.any()
        self._lists.begin_frame(memory, self.nodes.begin, origin, self._h, still, overlaps)

    def guard(self, sound: NDArray[np.bool_]) -> None:
        """Begin a substep whose tets must keep a share of the volume they have, where they are `sound` (m,)."""
        self.tets.J[:] = np.where(sound, self.tets.now, -1.0)

    def memory(self, x: NDArray[np.float64]) -> ContactMemory | None:
        """What the next frame begins with; x (n, 3) are the positions of the state [m]."""
        return self._lists.memory(x, self.nodes.origin, self._h) if self else None

    def places(self) -> NDArray[np.float64]:
        """(N, 3) of the nodes in the world [m]; a copy."""
        return self.nodes.x[:, :3] + self.nodes.origin

    def begin(self, time: float) -> None:
        """Begin the substep that ends at `time` [s]: valid lists, and the impulses that were kept."""
        lists, nodes, h = self._lists, self.nodes, self._h
        nodes.begin_substep(time, h)
        if not self:
            return
        self._frames = self._frames[1], self._shapes.frames(time, nodes.origin)
        lists.renew(nodes.begin, nodes.v, h, self._frames[0])
        self._measure_walls()
        self._before[:] = nodes.v
        if not lists.loaded:  # so that no kernel is compiled for what does not push
            return
        push_kept(nodes.at_begin(), nodes.bodies, nodes.v, lists.near, lists.pairs, self._walls, self._faces, h)
        nodes.take_twists(h)
        nodes.impulses += (nodes.v - self._before)[: len(nodes.impulses)]

    def _measure_walls(self) -> None:
        pairs = self._lists.pairs
        mine = is_last_shape(pairs, self._lists.near)
        nodes, shapes = pairs.nodes[mine, 0], pairs.shapes[mine]
        self._walls = self._shapes.walls(self.nodes.begin, nodes, shapes, *self._frames)

    def detect(self) -> int:
        """Find the rows of the substep; returns their number."""
        self._solver.left = 0.0
        if not self:
            return 0
        self.nodes.bend(self._h)
        self._expected[:] = self.nodes.x[:, :3]
        if len(self._chosen) != len(self._lists.pairs.keys):
            self._chosen = np.zeros(len(self._lists.pairs.keys), dtype=np.bool_)
        self._chosen[:] = False
        rows = self._detect(0, 2.0 * SLACK * self.edge_length, self._everyone)
        self.counts.smallest = min(self.counts.smallest, float(self._rows.distances[:rows].min(initial=math.inf)))
        return rows

    def _detect(self, first: int, slack: float, moved: NDArray[np.bool_]) -> int:
        lists, nodes = self._lists, self.nodes
        self._make_room(first + len(lists.near))
        whole = nodes.begin, nodes.x, nodes.bodies, self._faces, self._surface.simplices.first
        listed = lists.near, lists.pairs, self._walls
        return detect(*whole, *listed, slack, self._chosen, moved, first, self._rows)

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

    def solve(self, rows: int) -> float:
        """Solve the rows; see `RowSolver`."""
        return self._solver.solve(self._rows, rows, self._h)

    def sweep(self, rows: int) -> None:
        """Sweep once over the rows of active islands; see `RowSolver`."""
        self._solver.sweep(self._rows, rows, self._h)

    def keep_active(self, low: int, left: float, flat: float, *, first: bool = False) -> bool:
        """Leave the islands with low tets active, `left` in gaps; see `islands.keep_active`."""
        return keep_active(self.tets, low, self._solver.islands, left, flat, first)

    def project_low(self, bounds: NDArray[np.float64]) -> None:
        """Project the tets of active islands; see `tets.project_low`."""
        volumes.project_low(self.nodes.x, self.tets, self._solver.islands, bounds)

    def solve_joined(self, rows: int, joints: JointProjection) -> None:
        """Solve the rows of contacts and of joints; see `RowSolver`."""
        self._solver.solve_joined(self._rows, rows, joints, self._h)

    def keep(self, rows: int) -> None:
        """Note the forces, and keep the impulses with which the next substep begins."""
        lists, r, h = self._lists, self._rows, self._h
        if not self:
            return
        lists.loaded = rows > 0
        self.counts.residual = max(self.counts.residual, self._solver.left)
        if not rows:
            self.forces.end_substep(LoadedRows.none())
            return
        owners = self._surface.simplices.owner, self._shapes.owners
        self.forces.end_substep(LoadedRows(*loaded_rows(r, rows, lists.pairs, *owners, self.nodes.origin, h)))
        keep_impulses(r, rows, self._before, h, self._rates, lists.near, lists.pairs)

    def cut_inside(self, base: NDArray[np.float64], low: int, keep: float) -> int:
        """Shorten motions from `base` (N, 3) of the nodes of the first `low` tets; see `admit`."""
        self._make_room(0)
        room = self._rows, 0, self.tets, low, 0, keep, self._marks, self._cuts
        guarantee.admit(base, self.nodes.x, self.nodes.movers, *room)
        return volumes.measure(self.nodes.x, self.tets, False, guarantee.KEEP_J)

    def admit(self, rows: int, low: int) -> None:
        """Part what is through each other, put nodes back onto walls, then shorten motions until the guarantee holds.

        low : number of tets that have lost too much, as listed
        """
        nodes, h, moved = self.nodes, self._h, 0
        self._marks.longest[0] = 0.0
        if self:
            loose = np.where(self._rigid.joined, 0.0, nodes.bodies.w)
            recovered = RECOVERED * self.edge_length * h / self._dt
            if rows:
                pushing = loose, self._lists.pairs, self._rows, rows
                moved = guarantee.part(nodes.x, nodes.movers, *pushing, recovered, self._marks)
            # Pairs that were left out are asked again where something went farther than was expected.
            if _farther(nodes.x, self._expected, SLACK * self.edge_length, self._far):
                rows = self._detect(rows, ONLY_MEETING, self._far)
        else:
            self._make_room(0)
        v = nodes.v[: len(nodes.impulses)].copy()
        cut = self._cut(rows, low, moved)
        if self:
            self._lists.end_substep(h)
        for _ in range(guarantee.MOST_ROUNDS if self else 0):
            # Where a node has left what the lists expect of it: lists of this very motion, and again. What that cuts
            # may have left its place, too.
            if self._lists.cover(nodes.begin, nodes.x, h, self._frames[0]):
                break
            self._chosen = np.zeros(len(self._lists.pairs.keys), dtype=np.bool_)
            self._measure_walls()
            cut += self._cut(self._detect(0, ONLY_MEETING, self._everyone), 0, 0)
        if cut or moved:
            keep_spin(nodes.begin, nodes.x, nodes.v[: len(v)], h, *self._spins)
            nodes.impulses += nodes.v[: len(v)] - v
        self.counts.cut += math.sqrt(self._marks.longest[0]) > HARMLESS

    def _cut(self, rows: int, low: int, moved: int) -> int:
        if not (rows or low or moved):
            return 0
        nodes = self.nodes
        room = self._rows, rows, self.tets, low, moved, guarantee.KEEP_J, self._marks, self._cuts
        base = nodes.carried()
        cut, _ = guarantee.admit(base, nodes.x, nodes.movers, *room)
        if cut:
            nodes.settle()
            share_motion(nodes.x, nodes.movers, self._rows, nodes.begin, nodes.v, self._cuts, cut)
            nodes.take_twists(1.0)
            crossing = guarantee.count_crossing(base, nodes.x, self._rows, rows)
            low = volumes.measure(nodes.x, self.tets, False, 0.5 * guarantee.KEEP_J)
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
