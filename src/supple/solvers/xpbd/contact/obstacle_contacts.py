"""Vertices and points of rigid bodies against obstacles of simple shape, static or scripted, with friction.

Every vertex of a soft body is tested, inner vertices too, and every point of a rigid body's surface. A correction is
along the shape's normal only, to the last bit: a floor does not rotate a soft body about the vertical.
"""

from __future__ import annotations

import math
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from supple.contact.mesh.obstacles import ObstaclePoses
from supple.model.system import System
from supple.numerics.geometry.embedded_points import EmbeddedPoints
from supple.scene.contact_pairs import PairTable
from supple.solvers.xpbd.contact.contact_rows import loaded_rows
from supple.solvers.xpbd.contact.frame_forces import ShapeLoads
from supple.solvers.xpbd.contact.memory import ObstacleMemory
from supple.solvers.xpbd.contact.movers import MovedPoints
from supple.solvers.xpbd.contact.obstacle_shapes import ObstacleShapes
from supple.solvers.xpbd.contact.response_rates import keep_shares
from supple.solvers.xpbd.contact.shape_kernels import add_loads, kernels_of
from supple.solvers.xpbd.rigid.bodies import RigidBodies

# Sweeps over the contacts of rigid bodies with these shapes in a substep.
RIGID_SWEEPS = 4


def _no_loads() -> tuple[NDArray, NDArray, NDArray]:
    return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int32), np.zeros((0, 3))


class ObstacleContacts:
    """The simple shapes of a scene and the vertices near them.

    A contact that pushes has a load: the acceleration [m/s^2] that it gives its vertex in the substep, or the force [N]
    on a point of a rigid body. The next substep begins with a share of it (see `contact_rows`).

    Attributes
    ----------
    embedded : what is tested: the vertices of the system, then the points of rigid bodies
    owner : (t,) the body of each of these
    """

    def __init__(
        self,
        shapes: ObstacleShapes,
        poses: ObstaclePoses,
        system: System,
        table: PairTable,
        rates: NDArray[np.float64],
        rigid: RigidBodies,
    ) -> None:
        self.shapes = shapes
        self.poses = poses
        self._rigid, self._gravity = rigid, system.gravity
        n = len(system.masses)
        on_rigid = np.flatnonzero(system.points.single < 0)
        vertices = EmbeddedPoints.at_vertices(np.arange(n, dtype=np.int32))
        self.embedded = EmbeddedPoints.joined([vertices, system.points.taken(on_rigid)]) if len(rigid) else vertices
        count = len(self.embedded)
        inverse_masses = np.concatenate([system.inverse_masses, np.zeros(count - n)])
        self._moved = MovedPoints(self.embedded, 0, rigid, inverse_masses)
        self._x, self._before = np.zeros((count, 3)), np.zeros((count, 3))
        self._arrays = (shapes.parameters, shapes.moving)
        obstacles = table.bodies + shapes.owners
        owner = np.zeros(n, dtype=np.int32)
        for k, part in enumerate(system.bodies):
            owner[part.vertices] = k
        self.owner = owner[self.embedded.vertices[self.embedded.start[:-1]]]
        self._rules = (
            self.owner,
            np.ascontiguousarray(table.collide[: table.bodies, obstacles]),
            np.ascontiguousarray(table.friction[: table.bodies, obstacles]),
        )
        self._starts = np.zeros(len(shapes.contacts) + 1, dtype=np.int64)
        self._vertices = np.zeros(1024, dtype=np.int32)
        self._loads, self._shares, self._places = np.zeros((1024, 3)), np.zeros(1024), np.zeros((1024, 4))
        self._any_load = False
        self._can_move = inverse_masses > 0.0
        self._can_move[rigid.control] = False
        self._can_move[system.stitching.rigid.numbers] = False  # these are tested as points of their surface
        body = self._moved.movers.body
        if len(rigid):
            self._can_move |= (body >= 0) & ~rigid.held[body]
        self._tested = self._can_move.copy()
        # Shapes, vertices and loads of the contacts of what sleeps.
        self._standing = _no_loads()
        self._rates = rates[self.embedded.vertices[self.embedded.start[:-1]]]
        self._predicted, self._begun = np.zeros((count, 3)), np.zeros((count, 3))
        # Consecutive shapes with the same element function need one call.
        self._groups = []
        first = 0
        for function, group in groupby(shapes.contacts):
            last = first + len(list(group))
            self._groups.append((*kernels_of(function), first, last))
            first = last

    def __bool__(self) -> bool:
        return len(self.shapes.contacts) > 0

    def places(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """(t, 3) the places or displacements of what is tested, of those of the vertices x (n, 3)."""
        return self.embedded.positions(x) if len(self._rigid) else x

    def begin_step(
        self, memory: ObstacleMemory | None, x: NDArray[np.float64], tolerance: float, asleep: NDArray[np.bool_]
    ) -> None:
        """Take over the loads of an earlier step, where it describes these shapes and positions x (n, 3) [m].

        Bodies (b,) that are asleep take no part.
        """
        self._starts[:] = 0
        self._any_load = False
        self._moved.begin_step(asleep[self._rigid.numbers] | self._rigid.held)
        asleep = asleep[self.owner]
        self._tested[:] = self._can_move & ~asleep
        self._standing = _no_loads()
        shapes = self.shapes
        if memory is not None and memory.matches(shapes.frames, shapes.parameters, x, tolerance):
            still = asleep[memory.vertices]
            self._standing = memory.shapes[still], memory.vertices[still], memory.loads[still]
            keys = memory.shapes * len(self.owner) + memory.vertices
            self._enter(keys[~still], memory.loads[~still])

    def memory(self, x: NDArray[np.float64]) -> ObstacleMemory:
        """What the next step needs; `x` (n, 3) are the positions at the end of this one [m]."""
        shapes, vertices, loads = self.forces()[:3]
        more, of_them, their = self._standing
        shapes, vertices = np.concatenate([shapes, more]), np.concatenate([vertices, of_them])
        order, loads = np.lexsort((vertices, shapes)), np.concatenate([loads, their])
        described = self.shapes.frames, self.shapes.parameters, x.copy()
        return ObstacleMemory(*described, shapes[order], vertices[order], loads[order])

    def gather(self, x: NDArray[np.float64], reach: NDArray[np.float64], time: float) -> None:
        """List what may touch a shape before it has moved by `reach` (t,) [m] from x (t, 3) [m], or is loaded."""
        shapes, vertices, loads, _ = self.forces()
        frames = self.shapes.placed(self.poses, time)
        described = (self._arrays, self._rules, frames, self._starts)
        while True:
            count = 0
            for find, _, first, last in self._groups:
                count = find(x, reach, self._tested, *described, self._vertices, first, last, count)
            if count <= len(self._vertices):
                break
            self._vertices = np.zeros(2 * count, dtype=np.int32)
        n = len(self.owner)
        found = np.repeat(np.arange(len(self._starts) - 1), np.diff(self._starts)) * n + self._vertices[:count]
        kept = shapes * n + vertices
        keys = np.union1d(found, kept).astype(np.int64)
        held = np.zeros((len(keys), 3))
        held[np.searchsorted(keys, kept)] = loads
        self._enter(keys, held)

    def rigid_point_inside(self, x: NDArray[np.float64], time: float) -> bool:
        """Whether some point of a rigid body is inside a shape, of those of the vertices x (n, 3) at `time` [s]."""
        if not len(self._rigid):
            return False
        tested = self._tested.copy()
        tested[: len(x)] = False
        still = self._arrays[0], np.zeros_like(self._arrays[1])
        frames, starts = self.shapes.placed(self.poses, time), np.zeros_like(self._starts)
        places, reach, none = self.places(x), np.zeros(len(tested)), np.zeros(0, dtype=np.int32)
        return any(
            find(places, reach, tested, still, self._rules, frames, starts, none, first, last, 0)
            for find, _, first, last in self._groups
        )

    def _enter(self, keys: NDArray[np.int64], loads: NDArray[np.float64]) -> None:
        """Make the lists from ascending keys (c,), shape times n plus vertex, and their loads (c, 3)."""
        n = len(self.owner)
        if len(self._vertices) < len(keys):
            self._vertices = np.zeros(2 * len(keys), dtype=np.int32)
        if len(self._loads) < len(keys):
            size = 2 * len(keys)
            self._loads, self._shares, self._places = np.zeros((size, 3)), np.zeros(size), np.zeros((size, 4))
        self._starts[:] = np.searchsorted(keys, np.arange(len(self._starts)) * n)
        self._vertices[: len(keys)] = keys % n
        self._loads[: len(keys)] = loads
        self._any_load = bool(loads.any())

    def forces(self) -> ShapeLoads:
        """Copies of all contacts that push, as of the substep that was projected last."""
        k = loaded_rows(self._loads[: self._starts[-1]])
        shapes = np.searchsorted(self._starts, k, side="right") - 1
        return ShapeLoads(shapes.astype(np.int64), self._vertices[k], self._loads[k], self._places[k])

    def predict(self, x: NDArray[np.float64], x_prev: NDArray[np.float64], h: float) -> None:
        """Take notice of the prediction of a substep, before any forces of contacts; see `begin_substep`.

        What other bodies press onto an obstacle approaches it by their forces. This is not an impact either.
        """
        self._moved.begin_substep()
        self._moved.take(x, self._predicted)
        self._moved.take(x_prev, self._begun)
        # What rests on a point approaches it in every substep by its fall; this is not an impact.
        self._predicted[len(x) :] -= h * h * self._gravity

    def begin_substep(self, x: NDArray[np.float64], x_prev: NDArray[np.float64], h: float) -> bool:
        """See `Collisions.begin_substep`."""
        if self._any_load:
            count, places = self._starts[-1], self.take(x, x_prev)
            add_loads(places[0], self._moved.movers, self._vertices[:count], self._loads[:count], h)
            self.give(*places, x, x_prev)
        return self._any_load

    def take(self, x: NDArray[np.float64], x_prev: NDArray[np.float64]) -> tuple[NDArray, NDArray]:
        """The places of what is tested (t, 3) at the end and at the beginning of a substep, of those of the vertices.

        `give` applies what has been done to them to the vertices.
        """
        if not len(self._rigid):
            return x, x_prev
        self._moved.begin(x, x_prev, self._x, self._before)
        return self._x, self._before

    def give(self, places: NDArray, before: NDArray, x: NDArray[np.float64], x_prev: NDArray[np.float64]) -> None:
        """Move the vertices x, x_prev (n, 3) as the places were moved."""
        if len(self._rigid):
            self._moved.settle(places, before, self._predicted)
            self._moved.give(places, before, x, x_prev)

    def end_substep(self) -> None:
        """Keep the share of the loads with which the next substep begins."""
        count = self._starts[-1]
        self._any_load = count > 0 and keep_shares(self._loads[:count], self._shares[:count])

    def project(
        self,
        places: NDArray[np.float64],
        before: NDArray[np.float64],
        times: tuple[float, float],
        limit: float,
        scales: tuple[float, float],
    ) -> tuple[int, float]:
        """Push what `take` returned out, at the end of the substep `times` = (beginning, end) [s].

        Returns the number of contacts, and the smallest gap [m]. For `limit` and `scales` see `_project_shapes`.
        """
        if self._starts[-1] == 0:
            return 0, math.inf
        frames = tuple(self.shapes.placed(self.poses, time) for time in reversed(times))
        candidates = (self._starts, self._vertices, self._loads, self._shares, self._places)
        described = (candidates, self._arrays, self._rules, *frames)
        contacts, smallest = 0, math.inf
        points, h = (self._predicted, self._rates, self._moved.movers, self._begun), times[1] - times[0]
        sweeps = RIGID_SWEEPS if len(self._rigid) else 1
        for _, push, first, last in self._groups:
            found, gap = push(places, before, points, *described, first, last, h, limit, scales, sweeps)
            contacts += found
            smallest = min(smallest, gap)
        return contacts, smallest
