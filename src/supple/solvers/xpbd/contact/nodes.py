"""The nodes of contact: vertices, anchors of stitches, and points of obstacles and rigid bodies."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.contact.mesh.obstacles import ObstaclePoses
from supple.numerics.adjacency import adjacency
from supple.solvers.xpbd.contact.bodies import Bodies, Movers, describe, place_nodes, take_twists
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
    embedded : the first node on a rigid body's surface, and control points and weights (k, 4) of all of these
    """

    def __init__(
        self, surface: RowSurface, rigid: RigidBodies, poses: ObstaclePoses, inverse_masses: NDArray[np.float64]
    ) -> None:
        count, n = surface.count, len(rigid.of_vertex)
        self._surface, self._rigid, self._poses = surface, rigid, poses
        self.x, self.begin, self.v = np.zeros((count, 4)), np.zeros((count, 3)), np.zeros((count, 3))
        self.x[: len(inverse_masses), 3] = inverse_masses
        self.impulses, self.origin = np.zeros((n, 3)), np.zeros(3)
        self.embedded = (count - len(surface.embedded[0]), *surface.embedded)
        self.bodies = Bodies.of(surface.body, len(rigid))
        on_bodies = np.flatnonzero(surface.body >= 0)
        self._on_bodies = on_bodies, surface.body[on_bodies]
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

    def begin_substep(self, time: float, h: float) -> None:
        """Begin the substep of h [s] that ends at `time` [s]: obstacles are at its end."""
        self.begin[:] = self.x[:, :3]
        self.impulses[:] = 0.0
        if self._poses.moving.any():
            moved = self._place_obstacles(time)
            self.v[moved] = (self.x[moved, :3] - self.begin[moved]) / h
        rigid = self._rigid
        if len(rigid):
            place_nodes(self.v, *self.embedded)
            free = self.x[rigid.control[:, 0], 3] > 0.0
            describe(self.begin, rigid.control, rigid.masses, free, self.bodies)

    def at_begin(self) -> NDArray[np.float64]:
        """(N, 4) the nodes at x_n: obstacles may have moved already."""
        return np.column_stack([self.begin, self.x[:, 3]]) if self._poses.moving.any() else self.x

    def carried(self) -> NDArray[np.float64]:
        """(N, 3) x_n, with kinematic nodes at the end of their motion."""
        base = self.begin.copy()
        kinematic = self.x[:, 3] == 0.0
        base[kinematic] = self.x[kinematic, :3]
        return base

    def follow(self) -> None:
        """Put the points of rigid bodies where their bodies are."""
        place_nodes(self.x, *self.embedded)

    def take_twists(self, h: float) -> None:
        """Give what twists displaced in h [s] to the velocities of bodies."""
        if len(self._rigid):
            take_twists(self.v, self._rigid.control, self.bodies, h)

    def move_bodies(self, h: float) -> None:
        """Move rigid bodies as their momenta and the twists determine."""
        n = len(self.impulses)
        if len(self._rigid):
            self.take_twists(h)
            self._rigid.advance(self.x[:n], self.begin[:n], self.v[:n], h)
            self.follow()

    def settle(self) -> None:
        """Make places rigid that something has moved freely, and the velocities of points those of their bodies."""
        if len(self._rigid):
            self._rigid.place(self.x[: len(self.impulses), :3])
            self.follow()
            place_nodes(self.v, *self.embedded)

    def bend(self, h: float) -> None:
        """Set how far the ways of nodes in h [s] are from straight ones, as bodies turn."""
        rigid, n = self._rigid, len(self.impulses)
        if len(rigid):
            self.follow()
            turns = h * rigid.spins(self.begin[:n], self.v[:n])
            mine, body = self._on_bodies
            arms = np.linalg.norm(self.bodies.arms[mine], axis=1)
            self.bodies.bends[mine] = arms * (1.0 - np.cos(0.5 * np.minimum(turns, np.pi)))[body]
