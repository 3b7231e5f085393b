"""Vertices against obstacles of simple shape, static or scripted, with friction.

Every vertex of a body is tested, inner vertices too. A correction is along the shape's normal only, to the last bit:
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
from supple.numerics.kernel_cache import njit, reached_code
from supple.numerics.mat3 import row
from supple.scene.contact_pairs import PairTable
from supple.system import System
from supple.xpbd.contact.friction import friction_correction
from supple.xpbd.contact.obstacle_shapes import ObstacleShapes
from supple.xpbd.contact.overlap import split_overlap


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


def _find_candidates(x, reach, masses_inverse, shapes, rules, frames, starts, vertices, first, last, count):
    """Vertices that may touch the shapes [first, last) before they have moved by their reach (n,) [m].

    All vertices, where the shape moves. Vertices whose body does not collide with the shape are left out. `shapes` and
    `rules`: see `_project_shapes`.

    Writes `starts` (k + 1,) and as many of `vertices`, from `count` on, as fit. Returns their number so far.
    """
    parameters, moving = shapes
    owner, collide, _ = rules
    for k in range(first, last):
        starts[k] = count
        numbers = parameters[k]
        for i in range(len(x)):
            if masses_inverse[i] == 0.0 or not collide[owner[i], k]:
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


def _project_shapes(x, x_prev, candidates, shapes, rules, frames, frames_before, first, last, limit, near):
    """Push vertices out of the shapes [first, last), in place. Returns the number of contacts and the smallest gap.

    The gap is that before the substep, or inf.

    Parameters
    ----------
    candidates : starts (k + 1,), vertices, as from `_find_candidates`
    shapes : parameters (k, PARAMETERS), moving (k,)
    rules : owner (n,), the body of a vertex; collide (b, k), friction (b, k), of each body with each shape
    frames, frames_before : (k, 4, 3) at the end and at the beginning of the substep
    limit : see `split_overlap`; near : gaps above this are not reported [m]
    """
    starts, vertices = candidates
    parameters, moving = shapes
    owner, _, friction = rules
    contacts, smallest = 0, math.inf
    for k in range(first, last):
        numbers = parameters[k]
        for c in range(starts[k], starts[k + 1]):
            i = vertices[c]
            p, p_before = row(x, i), row(x_prev, i)
            s = _local(frames, k, p)
            gap, gap_before, normal = contact(numbers, _local(frames_before, k, p_before), s)
            if gap_before < near:
                smallest = min(smallest, gap_before)
            if not gap < 0.0:
                continue
            contacts += 1
            n = _turned(frames, k, normal)
            impulse, shift = split_overlap(gap, gap_before, limit)
            carried = p  # position, at the beginning, of the obstacle's point that is now at p
            if moving[k]:
                d = _turned(frames_before, k, s)
                carried = (
                    frames_before[k, 0, 0] + d[0],
                    frames_before[k, 0, 1] + d[1],
                    frames_before[k, 0, 2] + d[2],
                )
            slip = (carried[0] - p_before[0], carried[1] - p_before[1], carried[2] - p_before[2])
            back = friction_correction(slip, n, friction[owner[i], k], impulse)
            for j in range(3):
                x[i, j] += n[j] * (impulse + shift) + back[j]
                x_prev[i, j] += n[j] * shift
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


class ObstacleContacts:
    """The simple shapes of a scene and the vertices near them."""

    def __init__(self, shapes: ObstacleShapes, poses: ObstaclePoses, system: System, table: PairTable) -> None:
        self.shapes = shapes
        self.poses = poses
        self.inverse_masses = np.ascontiguousarray(system.inverse_masses)
        self._arrays = (shapes.parameters, shapes.moving)
        obstacles = table.bodies + shapes.owners
        owner = np.zeros(len(system.masses), dtype=np.int32)
        for k, part in enumerate(system.bodies):
            owner[part.vertices] = k
        self._rules = (
            owner,
            np.ascontiguousarray(table.collide[: table.bodies, obstacles]),
            np.ascontiguousarray(table.friction[: table.bodies, obstacles]),
        )
        self._starts = np.zeros(len(shapes.contacts) + 1, dtype=np.int64)
        self._vertices = np.zeros(1024, dtype=np.int32)
        # Consecutive shapes with the same element function need one call.
        self._groups = []
        first = 0
        for function, group in groupby(shapes.contacts):
            last = first + len(list(group))
            self._groups.append((*kernels_of(function), first, last))
            first = last

    def __bool__(self) -> bool:
        return len(self.shapes.contacts) > 0

    def gather(self, x: NDArray[np.float64], reach: NDArray[np.float64], time: float) -> None:
        """List the vertices (of n) that may touch a shape before they have moved by `reach` (n,) [m]."""
        frames = self.shapes.placed(self.poses, time)
        described = (self._arrays, self._rules, frames, self._starts)
        while True:
            count = 0
            for find, _, first, last in self._groups:
                count = find(x, reach, self.inverse_masses, *described, self._vertices, first, last, count)
            if count <= len(self._vertices):
                return
            self._vertices = np.zeros(2 * count, dtype=np.int32)

    def project(
        self, x: NDArray[np.float64], x_prev: NDArray[np.float64], times: tuple[float, float], limit: float, near: float
    ) -> tuple[int, float]:
        """Push vertices out at the end of the substep `times` = (beginning, end) [s]: contacts, smallest gap [m]."""
        frames = tuple(self.shapes.placed(self.poses, time) for time in reversed(times))
        described = ((self._starts, self._vertices), self._arrays, self._rules, *frames)
        contacts, smallest = 0, math.inf
        for _, push, first, last in self._groups:
            found, gap = push(x, x_prev, *described, first, last, limit, near)
            contacts += found
            smallest = min(smallest, gap)
        return contacts, smallest
