"""Vertices against obstacles of simple shape: plane, ball, bowl and block; static or scripted, with friction.

Every vertex of a body is tested, also inner ones. A correction is along the shape's normal only, to the last bit: a
floor cannot turn what stands on it about the vertical.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from supple.contact.obstacle_poses import ObstaclePoses
from supple.numerics.kernel_cache import njit
from supple.numerics.mat3 import dot, row
from supple.scene.contact_pairs import PairTable
from supple.system import System
from supple.xpbd.contact.friction import friction_correction
from supple.xpbd.contact.obstacle_shapes import BALL, BOWL, PLANE, ObstacleShapes
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
def _world(frames, k, s):
    """The point with coordinates s in frame k."""
    return (
        frames[k, 0, 0] + (frames[k, 1, 0] * s[0] + frames[k, 2, 0] * s[1] + frames[k, 3, 0] * s[2]),
        frames[k, 0, 1] + (frames[k, 1, 1] * s[0] + frames[k, 2, 1] * s[1] + frames[k, 3, 1] * s[2]),
        frames[k, 0, 2] + (frames[k, 1, 2] * s[0] + frames[k, 2, 2] * s[1] + frames[k, 3, 2] * s[2]),
    )


@njit
def _axis(frames, k, i, sign):
    return (sign * frames[k, 1 + i, 0], sign * frames[k, 1 + i, 1], sign * frames[k, 1 + i, 2])


@njit
def _radial(frames, k, s, length, sign):
    """World direction of the local vector s of the given length, times sign."""
    f = sign / length
    return (
        f * (frames[k, 1, 0] * s[0] + frames[k, 2, 0] * s[1] + frames[k, 3, 0] * s[2]),
        f * (frames[k, 1, 1] * s[0] + frames[k, 2, 1] * s[1] + frames[k, 3, 1] * s[2]),
        f * (frames[k, 1, 2] * s[0] + frames[k, 2, 2] * s[1] + frames[k, 3, 2] * s[2]),
    )


@njit
def _ball(frames, k, radius, s0, s1):
    """Gap now, gap before, normal. A vertex that came deep or passed through is held where it entered."""
    r0, r1 = math.sqrt(dot(s0, s0)), math.sqrt(dot(s1, s1))
    gap, before = r1 - radius, r0 - radius
    if before >= 0.0 and (gap >= 0.0 or r1 < 0.5 * radius):
        d = (s1[0] - s0[0], s1[1] - s0[1], s1[2] - s0[2])
        # |s0 + t d| = radius, the smaller root
        a, b, c = dot(d, d), dot(s0, d), dot(s0, s0) - radius * radius
        root = b * b - a * c
        if b < 0.0 and root > 0.0 and -b - math.sqrt(root) <= a:
            t = (-b - math.sqrt(root)) / a
            q = (s0[0] + t * d[0], s0[1] + t * d[1], s0[2] + t * d[2])
            length = math.sqrt(dot(q, q))
            n = (q[0] / length, q[1] / length, q[2] / length)
            return dot(s1, n) - radius, dot(s0, n) - radius, _radial(frames, k, n, 1.0, 1.0)
    if r1 > 0.0:
        return gap, before, _radial(frames, k, s1, r1, 1.0)
    return gap, before, _axis(frames, k, 1, 1.0)


@njit
def _block_side(half, s0, s1):
    """The face (axis) of a block that a vertex moving from s0 to s1 came in through and must leave by; -1: none.

    Where it was inside before, too, that is the face nearest to s0.
    """
    enter, leave = -1.0, 1.0
    side, nearest = -1, 0
    inside = True
    for i in range(3):
        e0, e1 = abs(s0[i]) - half[i], abs(s1[i]) - half[i]
        inside = inside and e1 < 0.0
        if e0 > abs(s0[nearest]) - half[nearest]:
            nearest = i
        sign = 1.0 if s0[i] >= 0.0 else -1.0
        depth0, depth1 = half[i] - sign * s0[i], half[i] - sign * s1[i]  # below the face of this side
        if depth0 <= 0.0:
            if depth1 <= 0.0:
                return -1  # stays above this face
            t = depth0 / (depth0 - depth1)
            if t > enter:
                enter, side = t, i
        if depth1 > 2.0 * half[i]:  # leaves by the opposite face
            leave = min(leave, (2.0 * half[i] - depth0) / (depth1 - depth0))
        elif depth1 < 0.0:  # leaves by this face
            leave = min(leave, depth0 / (depth0 - depth1))
    if side >= 0:
        return side if enter < leave or inside else -1
    return nearest if inside else -1


@njit
def _block(frames, k, half, s0, s1):
    """Gap now, gap before, normal."""
    side = _block_side(half, s0, s1)
    if side < 0:
        square = 0.0
        for i in range(3):
            square += max(0.0, abs(s1[i]) - half[i]) ** 2
        gap = math.sqrt(square)
        return gap, gap, (0.0, 0.0, 0.0)
    sign = 1.0 if s0[side] >= 0.0 else -1.0
    return sign * s1[side] - half[side], sign * s0[side] - half[side], _axis(frames, k, side, sign)


@njit
def _contact(kind, extent, frames, frames_before, k, p, p_before):
    """Gap now [m], gap at the beginning of the substep [m], unit normal towards the free side."""
    if kind == PLANE:
        n, m = _axis(frames, k, 0, 1.0), _axis(frames_before, k, 0, 1.0)
        d = (p[0] - frames[k, 0, 0], p[1] - frames[k, 0, 1], p[2] - frames[k, 0, 2])
        e = (
            p_before[0] - frames_before[k, 0, 0],
            p_before[1] - frames_before[k, 0, 1],
            p_before[2] - frames_before[k, 0, 2],
        )
        return dot(d, n), dot(e, m), n
    s1, s0 = _local(frames, k, p), _local(frames_before, k, p_before)
    if kind == BALL:
        return _ball(frames, k, extent[0], s0, s1)
    if kind == BOWL:
        r0, r1 = math.sqrt(dot(s0, s0)), math.sqrt(dot(s1, s1))
        if r1 == 0.0:
            return extent[0], extent[0] - r0, (0.0, 0.0, 0.0)
        return extent[0] - r1, extent[0] - r0, _radial(frames, k, s1, r1, -1.0)
    return _block(frames, k, extent, s0, s1)


@njit(cache=True)
def find_candidates(x, reach, masses_inverse, shapes, rules, frames, starts, vertices):
    """Vertices that may touch each shape before they have moved by their reach (n,) [m]; all of them if it moves.

    Vertices whose body does not collide with the shape are left out. `shapes` and `rules`: see `project_shapes`.

    Writes `starts` (k + 1,) and as many of `vertices` as fit. Returns how many there are.
    """
    kinds, extents, moving = shapes
    owner, collide, _ = rules
    count = 0
    for k in range(len(kinds)):
        starts[k] = count
        extent = row(extents, k)
        for i in range(len(x)):
            if masses_inverse[i] == 0.0 or not collide[owner[i], k]:
                continue
            if not moving[k]:
                p = row(x, i)
                gap, _, _ = _contact(kinds[k], extent, frames, frames, k, p, p)
                if not gap <= reach[i]:
                    continue
            if count < len(vertices):
                vertices[count] = i
            count += 1
    starts[len(kinds)] = count
    return count


@njit(cache=True)
def project_shapes(x, x_prev, candidates, shapes, rules, frames, frames_before, limit, near):
    """Push vertices out of shapes, in place. Returns the number of contacts and the smallest gap before (or inf).

    Parameters
    ----------
    candidates : starts (k + 1,), vertices, as from `find_candidates`
    shapes : kinds (k,), extents (k, 3), moving (k,)
    rules : owner (n,), the body of a vertex; collide (b, k), friction (b, k), of each body with each shape
    frames, frames_before : (k, 4, 3) at the end and at the beginning of the substep
    limit : see `split_overlap`; near : gaps above this are not reported [m]
    """
    starts, vertices = candidates
    kinds, extents, moving = shapes
    owner, _, friction = rules
    contacts, smallest = 0, math.inf
    for k in range(len(kinds)):
        extent = row(extents, k)
        for c in range(starts[k], starts[k + 1]):
            i = vertices[c]
            p, p_before = row(x, i), row(x_prev, i)
            gap, gap_before, n = _contact(kinds[k], extent, frames, frames_before, k, p, p_before)
            if gap_before < near:
                smallest = min(smallest, gap_before)
            if not gap < 0.0:
                continue
            contacts += 1
            impulse, shift = split_overlap(gap, gap_before, limit)
            carried = p  # where the point of the obstacle that is now at p was at the beginning
            if moving[k]:
                carried = _world(frames_before, k, _local(frames, k, p))
            slip = (carried[0] - p_before[0], carried[1] - p_before[1], carried[2] - p_before[2])
            back = friction_correction(slip, n, friction[owner[i], k], impulse)
            for j in range(3):
                x[i, j] += n[j] * (impulse + shift) + back[j]
                x_prev[i, j] += n[j] * shift
    return contacts, smallest


class ObstacleContacts:
    """The simple shapes of a scene and the vertices near them."""

    def __init__(self, shapes: ObstacleShapes, poses: ObstaclePoses, system: System, table: PairTable) -> None:
        self.shapes = shapes
        self.poses = poses
        self.inverse_masses = np.ascontiguousarray(system.inverse_masses)
        self._arrays = (shapes.kinds, shapes.extents, shapes.moving)
        obstacles = table.bodies + shapes.owners
        owner = np.zeros(len(system.masses), dtype=np.int32)
        for k, part in enumerate(system.bodies):
            owner[part.vertices] = k
        self._rules = (
            owner,
            np.ascontiguousarray(table.collide[: table.bodies, obstacles]),
            np.ascontiguousarray(table.friction[: table.bodies, obstacles]),
        )
        self._starts = np.zeros(len(shapes.kinds) + 1, dtype=np.int64)
        self._vertices = np.zeros(1024, dtype=np.int32)

    def __bool__(self) -> bool:
        return len(self.shapes.kinds) > 0

    def gather(self, x: NDArray[np.float64], reach: NDArray[np.float64], time: float) -> None:
        """List the vertices (of n) that may touch something before they have moved by `reach` (n,) [m]."""
        frames = self.shapes.placed(self.poses, time)
        described = (self._arrays, self._rules, frames)
        while True:
            count = find_candidates(x, reach, self.inverse_masses, *described, self._starts, self._vertices)
            if count <= len(self._vertices):
                return
            self._vertices = np.zeros(2 * count, dtype=np.int32)

    def project(
        self, x: NDArray[np.float64], x_prev: NDArray[np.float64], times: tuple[float, float], limit: float, near: float
    ) -> tuple[int, float]:
        """Push vertices out at the end of the substep `times` = (beginning, end) [s]; see `project_shapes`."""
        frames_before = self.shapes.placed(self.poses, times[0])
        frames = self.shapes.placed(self.poses, times[1])
        candidates = (self._starts, self._vertices)
        return project_shapes(x, x_prev, candidates, self._arrays, self._rules, frames, frames_before, limit, near)
