"""The nodes of contact: vertices, anchors of stitches, and points of obstacles and rigid bodies."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.contact.mesh.obstacles import ObstaclePoses
from supple.numerics.adjacency import adjacency
from supple.solvers.xpbd.contact.bodies import Bodies, Movers, place_nodes, take_twists
from supple.solvers.xpbd.contact.search.surface import RowSurface
from supple.solvers.xpbd.rigid.bodies import RigidBodies


class Nodes:
    """The N nodes of a system in the solver's numbering, whose first n are the vertices.

    Attributes
    ----------
    x : (N, 4) places about `origin` (3,) [m], and inverse masses [1/kg]
    begin, v : (N, 3) places where the substep began [m], velocities [m/s]
    impulses : (n, 3) changes of velocities of the vertices by contact in the present substep [m/s]
    bodies : the rigid bodies that nodes are on; movers : with the nodes of each
    embedded : the first of the nodes that are points of bodies, their control points (k, 4) and weights (k, 4)
    """

    def __init__(
        self, surface: RowSurface, rigid: RigidBodies, poses: ObstaclePoses, inverse_masses: NDArray[np.float64]
    ) -> None:
        count, n = surface.count, len(rigid.of_vertex)
        self._surface, self._rigid, self._poses = surface, rigid, poses
        self.x, self.begin, self.v = np.zeros((count, 4)), np.zeros((count, 3)), np.zeros((count, 3))
        self.x[: len(inverse_masses), 3] = inverse_masses
        self.obstacles_move = bool(poses.moving.any())
        self.impulses, self.origin = np.zeros((n, 3)), np.zeros(3)
        self.embedded = (count - len(surface.embedded[0]), *surface.embedded)
        self.bodies = Bodies.of(surface.body, len(rigid))
        on_bodies = np.flatnonzero(surface.body >= 0)
        self.movers = Movers(self.bodies, adjacency(surface.body[on_bodies], on_bodies, len(rigid)))

    def of_pieces(self, pieces: NDArray[np.int32]) -> NDArray[np.int32]:
        """(N,) the piece of each node, of pieces (n,) of the vertices; -1 for nodes of obstacles."""
        found = np.full(len(self.x), -1, dtype=np.int32)
        found[: len(pieces)] = pieces
        first, control, _ = self.embedded
        found[first:] = pieces[control[:, 0]]
        return found

    def begin_frame(self, time: float, origin: NDArray[np.float64]) -> None:
        """Begin a frame at `time` [s] with places about an origin (3,) [m]."""
        self.origin = origin
        self._place_obstacles(time)
        self.follow()
        self.x[self.embedded[0] :, 3] = self.x[self.embedded[1][:, 0], 3]
        self.begin[:] = self.x[:, :3]

    def _place_obstacles(self, time: float) -> slice:
        surface = self._surface
        of, mine = surface.of_anchor, slice(surface.first, surface.first + len(surface.anchors))
        if len(of):
            R, t = self._poses.at(time)
            self.x[mine, :3] = np.einsum("kij,kj->ki", R[of], surface.anchors) + t[of] - self.origin
        return mine

    def move_obstacles(self, time: float, h: float) -> bool:
        """Put obstacles at the end of the substep of h [s] that ends at `time` [s]; returns whether any moves."""
        if not self.obstacles_move:
            return False
        moved = self._place_obstacles(time)
        self.v[moved] = (self.x[moved, :3] - self.begin[moved]) / h
        return True

    def follow(self) -> None:
        """Put the points of rigid bodies where their bodies are."""
        place_nodes(self.x, *self.embedded)

    def take_twists(self, h: float) -> None:
        """Give what twists displaced in h [s] to the velocities of bodies."""
        if len(self._rigid):
            take_twists(self.v, self._rigid.control, self.bodies, h)

    def settle(self) -> None:
        """Make places rigid that something has moved freely, and the velocities of points those of their bodies."""
        if len(self._rigid):
            self._rigid.place(self.x[: len(self.impulses), :3])
            self.follow()
            place_nodes(self.v, *self.embedded)
