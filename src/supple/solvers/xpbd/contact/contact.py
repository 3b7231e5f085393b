"""Contact in the substeps of a frame: what its stages need, and what they leave to Python."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.contact.mesh.obstacles import ObstaclePoses
from supple.model.system import System
from supple.solvers.xpbd.contact.admit import KEEP_J, Marks, count_crossing
from supple.solvers.xpbd.contact.cuts import Cuts, share_motion
from supple.solvers.xpbd.contact.frame_forces import FrameForces, LoadedRows
from supple.solvers.xpbd.contact.memory import ContactMemory
from supple.solvers.xpbd.contact.nodes import Nodes
from supple.solvers.xpbd.contact.pairs import SHAPE
from supple.solvers.xpbd.contact.row_solver import RowSolver
from supple.solvers.xpbd.contact.rows import ROW
from supple.solvers.xpbd.contact.search.lists import Lists
from supple.solvers.xpbd.contact.search.overlaps import find_overlaps
from supple.solvers.xpbd.contact.search.surface import row_surface
from supple.solvers.xpbd.contact.settings import XPBDContact
from supple.solvers.xpbd.contact.shapes import RowShapes, Walls
from supple.solvers.xpbd.contact.tets import Tets, measure
from supple.solvers.xpbd.response_rates import response_rates
from supple.solvers.xpbd.rigid.bodies import RigidBodies

# Of the mean edge: how far nodes may go beyond the places that were expected when rows were found.
SLACK = 0.0125
# Of the mean edge: by how much things that are through each other are separated in a frame.
RECOVERED = 0.05


class Contact:
    """The contact of a system in the solver's numbering.

    Attributes
    ----------
    nodes : what moves; tets : of the system; lists : of the pairs that may touch; solver : of rows
    surface, shapes : what may touch
    rows, marks, cuts, log, near : room for what pairs may need; chosen : (k,) pairs that are rows
    walls : nodes (w,) and shapes (w,) of pairs with shapes, and room for where these are
    frames : of the shapes at the beginning and at the end of the substep
    rates, spins : see `Record`
    forces : of the substeps since the frame began; crushed : substeps in which no cut could keep what must be kept
    edge_length : mean surface edge [m]
    """

    def __init__(
        self, system: System, rigid: RigidBodies, inverse_masses: NDArray[np.float64], settings: XPBDContact | None
    ) -> None:
        n = len(system.masses)
        self.surface = surface = row_surface(system, rigid, len(inverse_masses) - n, settings)
        self.edge_length = surface.edge_length
        self.faces = surface.simplices.around, surface.simplices.triangles
        count, poses = surface.count, ObstaclePoses(system.obstacles)
        self.nodes = Nodes(surface, rigid, poses, inverse_masses)
        self.solver = RowSolver(self.nodes, rigid, system.gravity, system.joined_components)
        self.shapes = RowShapes(system, poses)
        self.lists = Lists(surface, self.shapes)
        self.tets = Tets.of(system, count)
        self.rates = np.zeros(count)
        # Of what has no elastic energy, nothing is kept; a finite number, as infinity times zero is not one.
        self.rates[:n] = np.minimum(response_rates(system), 1e100)
        self.rows, self.log = np.zeros(0, dtype=ROW), LoadedRows.room(0)
        changed = np.zeros(count, np.int64), np.zeros(8 * count, np.int64)
        none = np.zeros(0, np.bool_), np.zeros(len(rigid), np.bool_)
        self.marks = Marks(*changed, *none, surface.simplices.gaps, np.zeros(1))
        self.cuts = Cuts.room(len(self.tets.J))
        labels = system.joined_components
        free = np.ones(int(labels.max()) + 1, dtype=np.bool_)
        free[labels[system.inverse_masses == 0.0]] = free[labels[system.stitching.anchored_vertices()]] = False
        masses = np.where(rigid.welded_to >= 0, 0.0, system.masses)
        self.spins = masses, labels, free, np.zeros((len(free), 13))
        self.frames = self.shapes.frames(0.0, np.zeros(3)), self.shapes.frames(0.0, np.zeros(3))
        self._names = tuple(part.name for part in system.bodies) + tuple(str(o.name) for o in system.obstacles)
        self.crushed, self._began_apart = 0, False
        self.forces = FrameForces(self._names, surface.points)
        self.make_room()

    def __bool__(self) -> bool:
        """Whether any contact is possible."""
        return bool(self.lists)

    @property
    def rigid_points(self) -> int:
        """Number of points of rigid bodies' surfaces."""
        return len(self.surface.embedded[0]) if self else 0

    @property
    def kept_apart(self) -> bool:
        """Whether no surfaces crossed where the frame began, and nothing was crushed since.

        Then nothing crosses; see docs/theory/contact.md.
        """
        return self._began_apart and not self.crushed

    def begin_frame(
        self,
        time: float,
        h: float,
        origin: NDArray[np.float64],
        memory: ContactMemory | None,
        crossing: list[tuple[int, int]],
        asleep: NDArray[np.bool_],
    ) -> None:
        """Begin a frame.

        Parameters
        ----------
        time : of its begin, h : length of its substeps [s]
        origin : (3,) of the places of nodes [m]; memory : of the frame before
        crossing : pairs of bodies and obstacles (counted after the bodies) whose surfaces cross
        asleep : (b,) bodies that do not move
        """
        self.crushed, self.forces = 0, FrameForces(self._names, self.surface.points, self.log)
        self.nodes.begin_frame(time, origin)
        self.frames = self.shapes.frames(time, origin), self.shapes.frames(time, origin)
        measure(self.nodes.x, self.tets, False, 1.0)
        still = np.ones(len(self._names), dtype=np.bool_)
        still[: len(asleep)] = asleep
        overlaps = find_overlaps(self.surface.simplices, self.surface.closed, self.nodes.x, crossing)
        self._began_apart = not overlaps.crossing.any()
        self.lists.begin_frame(memory, self.nodes.begin, origin, h, still, overlaps)
        self.make_room()

    def memory(self, x: NDArray[np.float64], h: float) -> ContactMemory | None:
        """What the next frame begins with after substeps of h [s]; x (n, 3) are the positions of the state [m]."""
        return self.lists.memory(x, self.nodes.origin, h) if self else None

    def places(self) -> NDArray[np.float64]:
        """(N, 3) of the nodes in the world [m]; a copy."""
        return self.nodes.x[:, :3] + self.nodes.origin

    def move_obstacles(self, time: float, h: float) -> None:
        """Move obstacles to their places at the end of a substep of h [s], `time` [s]."""
        if self.nodes.move_obstacles(time, h):
            self.frames = self.frames[1], self.shapes.frames(time, self.nodes.origin)

    def renew(self, h: float) -> bool:
        """Make the list of pairs valid for a substep of h [s] that begins; returns whether it has others."""
        found = bool(self) and self.lists.renew(self.nodes.begin, self.nodes.v, h, self.frames[0])
        if found:
            self.make_room()
        return found

    def make_room(self) -> None:
        """Make room for the rows of all pairs."""
        pairs, count = self.lists.pairs, len(self.lists.pairs)
        self.chosen, self.near = np.zeros(count, dtype=np.bool_), np.zeros(count + 1, dtype=np.int64)
        mine = slice(int(np.searchsorted(pairs["kinds"], SHAPE)), None)
        w = len(pairs[mine])
        points, shapes = np.ascontiguousarray(pairs["nodes"][mine, 0]), np.ascontiguousarray(pairs["shapes"][mine])
        self.walls = points, shapes, Walls(np.empty(w), np.empty((w, 3)), np.empty((w, 3)))
        if count > len(self.rows):
            most = count + count // 2
            self.rows = np.zeros(most, dtype=ROW)
            self.marks = self.marks._replace(planes=np.zeros(most, dtype=np.bool_))
            self.cuts = Cuts.room(most + len(self.tets.J))

    def measure_walls(self) -> None:
        """Measure the walls of pairs with shapes at x_n."""
        points, shapes, walls = self.walls
        if len(points):
            begin, end = self.frames
            for kernel, wanted in self.shapes.kinds:
                kernel(self.nodes.begin, points, shapes, wanted, self.shapes.parameters, begin, end, *walls)

    def make_room_in_log(self, logged: int) -> bool:
        """Make room for the rows of a substep after those that are in the log; returns whether there was too little."""
        needed = logged + len(self.lists.pairs)
        lacks = needed > len(self.log.keys)
        if lacks:
            log = LoadedRows.room(2 * needed)
            for new, old in zip(log, self.log, strict=True):
                new[:logged] = old[:logged]
            self.log = self.forces.log = log
        return lacks

    def give_back(self, rows: int, cut: int, base: NDArray[np.float64]) -> None:
        """Give back what cuts took from motions, the first of `cuts`, that went from `base` (N, 3)."""
        nodes = self.nodes
        nodes.settle()
        share_motion(nodes.x, nodes.movers, self.rows, nodes.begin, nodes.v, self.cuts, cut)
        nodes.take_twists(1.0)
        crossing = count_crossing(base, nodes.x, self.rows, rows)
        low = measure(nodes.x, self.tets, False, 0.5 * KEEP_J)
        self.crushed += crossing + low > 0

    def recovered(self, dt: float, h: float) -> float:
        """By how much things are separated in a substep of h [s] of a frame of dt [s] [m]."""
        return RECOVERED * self.edge_length * h / dt

    @property
    def slack(self) -> float:
        """See `detect` [m]."""
        return 2.0 * SLACK * self.edge_length
