"""Vertices and points of rigid bodies against obstacles of simple shape, static or scripted, with friction.

Every vertex of a soft body is tested, inner vertices too, and every point of a rigid body's surface. A correction is along the shape's normal only, to the last bit:
a floor does not rotate a body about the vertical.

Each shape supplies its contact as an element function. The two kernels of this file are compiled once for each such
function, which is inlined: a new kind of obstacle does not slow down the others.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from itertools import groupby
from types import FunctionType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.contact.obstacle_poses import ObstaclePoses
from supple.numerics.geometry.embedded_points import EmbeddedPoints
from supple.numerics.kernel_cache import njit, reached_code
from supple.numerics.mat3 import cross, dot, row, subtract
from supple.scene.contact_pairs import PairTable
from supple.system import System
from supple.xpbd.contact.frame_forces import ShapeLoads
from supple.xpbd.contact.friction import along_surface, friction_total
from supple.xpbd.contact.memory import ObstacleMemory
from supple.xpbd.contact.movers import MovedPoints, place, place_before, push_body, softness
from supple.xpbd.contact.obstacle_shapes import ObstacleShapes
from supple.xpbd.contact.response_rates import keep_shares, kept_share
from supple.xpbd.rigid.bodies import RigidBodies

# Sweeps over the contacts of rigid bodies with these shapes in a substep.
RIGID_SWEEPS = 4


@njit
def _local(frames, k, p):
    """Coordinates of the point p in frame k."""
    d = (p[0] - frames[k, 0, 0], p[1] - frames[k, 0, 1], p[2] - frames[k, 0, 2])
    return (
        frames[k, 1, 0] * d[0] + frames[k, 1, 1] * d[1] + frames[k, 1, 2] * d[2],
        frames[k, 2, 0] * d[0] + frames[k, 2, 1] * d[1] + frames[k, 2, 2] * d[2],
        frames[k, 3, 0] * d[0] + frames[k, 3, 1] * d[1] + frames[k, 3, 2] * d[2],
    )


@njit
def _turned(frames, k, s):
    """The vector with coordinates s in frame k."""
    return (
        frames[k, 1, 0] * s[0] + frames[k, 2, 0] * s[1] + frames[k, 3, 0] * s[2],
        frames[k, 1, 1] * s[0] + frames[k, 2, 1] * s[1] + frames[k, 3, 1] * s[2],
        frames[k, 1, 2] * s[0] + frames[k, 2, 2] * s[1] + frames[k, 3, 2] * s[2],
    )


@njit
def contact(parameters, s0, s1):
    """Replaced by the element function of a shape; see `kernels_of`."""
    return math.inf, math.inf, (0.0, 0.0, 0.0)


def _find_candidates(x, reach, tested, shapes, rules, frames, starts, vertices, first, last, count):
    """Vertices that may touch the shapes [first, last) before they have moved by their reach (n,) [m].

    All vertices, where the shape moves. Vertices whose body does not collide with the shape, and those that are not
    tested (n,), are left out. `shapes` and `rules`: see `_project_shapes`.

    Writes `starts` (k + 1,) and as many of `vertices`, from `count` on, as fit. Returns their number so far.
    """
    parameters, moving = shapes
    owner, collide, _ = rules
    for k in range(first, last):
        starts[k] = count
        numbers = parameters[k]
        for i in range(len(x)):
            if not tested[i] or not collide[owner[i], k]:
                continue
            if not moving[k]:
                s = _local(frames, k, row(x, i))
                gap, _, _ = contact(numbers, s, s)
                if not gap <= reach[i]:
                    continue
            if count < len(vertices):
                vertices[count] = i
            count += 1
    starts[last] = count
    return count


def _project_shapes(
    x, x_prev, points, candidates, shapes, rules, frames, frames_before, first, last, h, limits, scales, rigid_only
):
    """Push vertices out of the shapes [first, last), in place. Returns the number of contacts and the smallest gap.

    The gap is that before the substep, or inf. An overlap that existed when the substep began is removed at both ends
    of the substep alike, by at most the limits; the push only prevents the gap from becoming smaller than it was then.

    Parameters
    ----------
    points : predicted (n, 3), positions before loads and constraints [m]; rates (n,), see `response_rates` [1/s^2];
        movers, see `Movers`
    candidates : starts (k + 1,), vertices (c,), as from `_find_candidates`; loads (c, 3), those that x contains, and
        shares (c,) of them for the next substep; see `ObstacleContacts`; places (c, 4) are set to the normal and to the
        gap that remains
    shapes : parameters (k, PARAMETERS), moving (k,)
    rules : owner (n,), the body of a vertex; collide (b, k), friction (b, k), of each body with each shape
    frames, frames_before : (k, 4, 3) at the end and at the beginning of the substep
    h : length of the substep [s]
    limits : (n,) the largest part of an old overlap that is removed at each vertex [m]
    scales : skin, the gap that is kept; near, gaps above this are not reported [m]
    rigid_only : whether points of rigid bodies are projected once more, and vertices are not
    """
    predicted, rates, movers = points
    starts, vertices, loads, shares, places = candidates
    parameters, moving = shapes
    owner, _, friction = rules
    skin, near = scales
    contacts, smallest, h2 = 0, math.inf, h * h
    for k in range(first, last):
        numbers = parameters[k]
        for c in range(starts[k], starts[k + 1]):
            i = vertices[c]
            is_rigid = movers.body[i] >= 0
            if rigid_only and not is_rigid:
                continue
            p, p_before = place(x, movers, i), place_before(x_prev, movers, i)
            s = _local(frames, k, p)
            gap, gap_before, normal = contact(numbers, _local(frames_before, k, p_before), s)
            if gap_before < near:
                smallest = min(smallest, gap_before)
            load = row(loads, c)
            loaded = load[0] != 0.0 or load[1] != 0.0 or load[2] != 0.0
            if not gap < skin and not loaded:
                continue
            n = _turned(frames, k, normal)
            load = (h2 * load[0], h2 * load[1], h2 * load[2])
            pushed, held = max(0.0, dot(load, n)), along_surface(load, n)
            # A vertex moves by its load; a point of a rigid body by what the body makes of a force.
            soft = softness(movers, movers.body[i], 1.0, cross(row(movers.arms, i), n)) if is_rigid else 1.0
            old = max(0.0, skin - gap_before)
            shift = 0.0 if rigid_only else min(old, limits[i])
            push = max(0.0, pushed + (skin - gap - old) / soft)
            carried = p  # position, at the beginning, of the obstacle's point that is now at p
            if moving[k]:
                d = _turned(frames_before, k, s)
                carried = (
                    frames_before[k, 0, 0] + d[0],
                    frames_before[k, 0, 1] + d[1],
                    frames_before[k, 0, 2] + d[2],
                )
            slip = (carried[0] - p_before[0], carried[1] - p_before[1], carried[2] - p_before[2])
            more = push - pushed
            if is_rigid:
                # The push turns the body, and it answers differently along the surface.
                push_body(movers, i, (more * n[0], more * n[1], more * n[2]))
                moved = subtract(place(x, movers, i), p)
                slip = along_surface((slip[0] + moved[0], slip[1] + moved[1], slip[2] + moved[2]), n)
                length = math.sqrt(dot(slip, slip))
                if length > 0.0:
                    along = (slip[0] / length, slip[1] / length, slip[2] / length)
                    f = 1.0 / softness(movers, movers.body[i], 1.0, cross(row(movers.arms, i), along))
                    slip = (f * slip[0], f * slip[1], f * slip[2])
            hold = friction_total(held, slip, n, friction[owner[i], k] * push)
            contacts += push > 0.0
            # What stopped the approach with which the substep began does not return.
            impact = dot(subtract(p, place_before(predicted, movers, i)), n) + skin - gap - old
            impact = max(0.0, impact) / soft
            shares[c] = max(0.0, 1.0 - impact / push) * kept_share(h2 * rates[i]) if push > 0.0 else 0.0
            if is_rigid:
                b = movers.body[i]
                push_body(movers, i, (hold[0] - held[0], hold[1] - held[1], hold[2] - held[2]))
                for j in range(3):
                    movers.twists[b, 6 + j] += n[j] * shift
            else:
                for j in range(3):
                    x[i, j] += n[j] * (more + shift) + (hold[j] - held[j])
                    x_prev[i, j] += n[j] * shift
                    predicted[i, j] += n[j] * shift
            for j in range(3):
                loads[c, j] = (n[j] * push + hold[j]) / h2
                places[c, j] = n[j]
            places[c, 3] = gap + soft * more + shift
    return contacts, smallest


@cache
def kernels_of(function: Callable[..., Any]) -> tuple[Callable[..., Any], Callable[..., Any]]:
    """`_find_candidates` and `_project_shapes` with `contact` replaced by a shape's element function, compiled.

    Numba's cache distinguishes kernels of one file by their names, so that the name contains a digest of the code.
    """
    compiled = []
    for kernel in (_find_candidates, _project_shapes):
        names = {**kernel.__globals__, "contact": function}
        copy = FunctionType(kernel.__code__, names, kernel.__name__, kernel.__defaults__)
        copy.__qualname__ = f"{kernel.__qualname__}_{reached_code(copy).hex()[:14]}"
        copy.__module__ = kernel.__module__
        compiled.append(njit(cache=True)(copy))
    return compiled[0], compiled[1]


@njit(cache=True)
def add_loads(x, movers, vertices, loads, h):
    """x += h^2 a, for the loads a (c, 3) [m/s^2] of these vertices (c,); forces [N] on points of rigid bodies."""
    for c in range(len(vertices)):
        i = vertices[c]
        if movers.body[i] >= 0:
            push_body(movers, i, (h * h * loads[c, 0], h * h * loads[c, 1], h * h * loads[c, 2]))
            continue
        for j in range(3):
            x[i, j] += h * h * loads[c, j]


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
        body = self._moved.movers.body
        if len(rigid):
            self._can_move |= (body >= 0) & ~rigid.held[body]
        self._tested = self._can_move.copy()
        # Shapes, vertices and loads of the contacts of what sleeps.
        self._standing = _no_loads()
        self._rates = rates[self.embedded.vertices[self.embedded.start[:-1]]]
        self._predicted = np.zeros((count, 3))
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
        k = np.flatnonzero(self._loads[: self._starts[-1]].any(axis=1))
        shapes = np.searchsorted(self._starts, k, side="right") - 1
        return ShapeLoads(shapes.astype(np.int64), self._vertices[k], self._loads[k], self._places[k])

    def begin_substep(self, x: NDArray[np.float64], x_prev: NDArray[np.float64], h: float) -> bool:
        """See `Collisions.begin_substep`."""
        self._moved.take(x, self._predicted)
        # What rests on a point approaches it in every substep by its fall; this is no impact.
        self._predicted[len(x) :] -= h * h * self._gravity
        if self._any_load:
            count, places = self._starts[-1], self._take(x, x_prev)
            add_loads(places[0], self._moved.movers, self._vertices[:count], self._loads[:count], h)
            self._give(*places, x, x_prev)
        return self._any_load

    def _take(self, x: NDArray[np.float64], x_prev: NDArray[np.float64]) -> tuple[NDArray, NDArray]:
        """The places of what is tested, of those of the vertices."""
        if not len(self._rigid):
            return x, x_prev
        self._moved.take(x, self._x)
        self._moved.take(x_prev, self._before)
        self._moved.begin(x, x_prev, self._before)
        return self._x, self._before

    def _give(self, places: NDArray, before: NDArray, x: NDArray[np.float64], x_prev: NDArray[np.float64]) -> None:
        if len(self._rigid):
            self._moved.settle(places, before, self._predicted)
            self._moved.give(places, before, x, x_prev)

    def end_substep(self) -> None:
        """Keep the share of the loads with which the next substep begins."""
        count = self._starts[-1]
        self._any_load = keep_shares(self._loads[:count], self._shares[:count])

    def project(
        self,
        x: NDArray[np.float64],
        x_prev: NDArray[np.float64],
        times: tuple[float, float],
        limits: NDArray[np.float64],
        scales: tuple[float, float],
    ) -> tuple[int, float]:
        """Push vertices out at the end of the substep `times` = (beginning, end) [s]: contacts, smallest gap [m].

        For `limits` and `scales` see `_project_shapes`.
        """
        frames = tuple(self.shapes.placed(self.poses, time) for time in reversed(times))
        candidates = (self._starts, self._vertices, self._loads, self._shares, self._places)
        described = (candidates, self._arrays, self._rules, *frames)
        contacts, smallest = 0, math.inf
        points, h = (self._predicted, self._rates, self._moved.movers), times[1] - times[0]
        places, before = self._take(x, x_prev)
        for again in range(RIGID_SWEEPS if len(self._rigid) else 1):
            for _, push, first, last in self._groups:
                found, gap = push(
                    places, before, points, *described, first, last, h, limits, scales, again > 0
                )
                if not again:
                    contacts += found
                    smallest = min(smallest, gap)
        self._give(places, before, x, x_prev)
        return contacts, smallest
