"""Pairs that may touch: what lists hold between substeps, and the geometry of a pair.

A pair has four nodes with weights c_i, and r = sum c_i x_i - q is the vector from the nearest place of its second side
to that of its first. It is a point and a triangle, two edges, or a point and a simple shape (a plane or the wall of a
room): then all four nodes are the point, c = (1, 0, 0, 0), and q is the nearest place of the shape. Otherwise q = 0 and
the weights add up to zero.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.numerics.geometry.closest_points import closest_on_segments, closest_on_triangle
from supple.numerics.mat3 import cross, dot, row, subtract
from supple.runtime.kernel_cache import njit

POINT, EDGES, SHAPE = 0, 1, 2
# Of `Pairs.near`.
FAR, NEAR, UNKNOWN = 0, 1, 2
# Of the gap: what is nearer touches. The cosine of the angle between the normals of what does.
NIL, OPPOSED = 5e-6, -0.25


class Pairs(NamedTuple):
    """k pairs.

    Attributes
    ----------
    nodes : (k, 4); kinds : (k,) int8
    shapes : (k,) of pairs with a shape, its number; of pairs with a triangle, that of the triangle
    keys : (k,) the parts of the pair as one number, by which impulses are handed on to the next list; of bodies they
        are the same with other obstacles
    pushes : (k,) whether the pair pushes; pairs of one body that are near each other at rest are only kept apart
    deep : (k,) whether the sides were through each other when the frame began; then they are not kept on their sides,
        but pushed out along the normals at that time
    friction : (k,) its coefficient; gaps : (k,) the smallest gap of its nodes [m]
    normals : (k, 3) as of the latest look; impulses : (k, 3) with which the next substep begins [kg m]
    reached : (k,) the largest distance of the pair's rows so far, its gap at most [m]
    near : (k,) int8, whether the pair may come near while its nodes go on, see `near_pairs`
    """

    nodes: NDArray[np.int32]
    kinds: NDArray[np.int8]
    shapes: NDArray[np.int32]
    keys: NDArray[np.int64]
    pushes: NDArray[np.bool_]
    deep: NDArray[np.bool_]
    friction: NDArray[np.float64]
    gaps: NDArray[np.float64]
    normals: NDArray[np.float64]
    impulses: NDArray[np.float64]
    reached: NDArray[np.float64]
    near: NDArray[np.int8]

    @classmethod
    def room(cls, k: int) -> Pairs:
        """For k pairs, of which nothing is known."""
        numbers = (
            np.zeros((k, 4), np.int32),
            np.full(k, SHAPE, np.int8),
            np.full(k, -1, np.int32),
            np.zeros(k, np.int64),
        )
        flags, vectors = (np.empty(k, np.bool_), np.zeros(k, np.bool_)), (np.zeros((k, 3)), np.zeros((k, 3)))
        return cls(*numbers, *flags, np.empty(k), np.empty(k), *vectors, np.zeros(k), np.full(k, UNKNOWN, np.int8))


@njit
def weights_of(x, nodes, k, kind):
    """The weights (4) of a pair of surfaces at places x, and r."""
    p, q, r, s = row(x, nodes[k, 0]), row(x, nodes[k, 1]), row(x, nodes[k, 2]), row(x, nodes[k, 3])
    if kind == POINT:
        u = closest_on_triangle(p, q, r, s)
        c = (1.0, -u[0], -u[1], -u[2])
    else:
        a, b = closest_on_segments(p, q, r, s)
        c = (1.0 - a, a, b - 1.0, -b)
    return c, (
        c[0] * p[0] + c[1] * q[0] + c[2] * r[0] + c[3] * s[0],
        c[0] * p[1] + c[1] * q[1] + c[2] * r[1] + c[3] * s[1],
        c[0] * p[2] + c[1] * q[2] + c[2] * r[2] + c[3] * s[2],
    )


@njit
def facing(x, pairs, k, faces):
    """The weights (4) of a pair of surfaces, the unit normal from its second side to its first, and the distance.

    Below zero where the sides of a deep pair are on the wrong sides of each other. The normal of what touches, or is
    behind the other by no more, comes from the surfaces; it is zero where these do not face each other.

    faces : the triangles around each node, and their nodes (f, 3)
    """
    c, r = weights_of(x, pairs.nodes, k, pairs.kinds[k])
    size, nil = math.sqrt(dot(r, r)), NIL * pairs.gaps[k]
    old = row(pairs.normals, k)
    if pairs.deep[k]:
        if size <= nil:
            return c, old, 0.0
        if dot(r, old) < 0.0:
            return c, (-r[0] / size, -r[1] / size, -r[2] / size), -size
    elif size <= nil:
        n = _normal_of_touching(x, pairs.nodes, k, pairs.kinds[k], faces)
        return c, n, dot(n, r)
    return c, (r[0] / size, r[1] / size, r[2] / size), size


@njit
def _normal_of_touching(x, nodes, k, kind, faces):
    """The unit normal from the second side of a pair to the first one, from the surfaces around them, or zero."""
    a, b = row(x, nodes[k, 0]), row(x, nodes[k, 1])
    c, d = row(x, nodes[k, 2]), row(x, nodes[k, 3])
    one = normal_at(x, nodes[k, 0], faces)
    if kind == POINT:
        m, other = cross(subtract(c, b), subtract(d, b)), (0.0, 0.0, 0.0)
    else:
        m, two = cross(subtract(b, a), subtract(d, c)), normal_at(x, nodes[k, 1], faces)
        one = (one[0] + two[0], one[1] + two[1], one[2] + two[2])
        p, q = normal_at(x, nodes[k, 2], faces), normal_at(x, nodes[k, 3], faces)
        other = (p[0] + q[0], p[1] + q[1], p[2] + q[2])
        if dot(m, subtract(other, one)) < 0.0:
            m = (-m[0], -m[1], -m[2])
    length = math.sqrt(dot(m, m))
    if not length > 0.0:
        return (0.0, 0.0, 0.0)
    n = (m[0] / length, m[1] / length, m[2] / length)
    faces_first = dot(n, one) < OPPOSED * math.sqrt(dot(one, one))
    faces_second = kind == POINT or dot(n, other) > -OPPOSED * math.sqrt(dot(other, other))
    return n if faces_first and faces_second else (0.0, 0.0, 0.0)


@njit(cache=True)
def normal_at(x, i, faces):
    """The unit normal of the surface at node i."""
    (start, items), triangles = faces
    n = (0.0, 0.0, 0.0)
    for k in range(start[i], start[i + 1]):
        t = items[k]
        p = row(x, triangles[t, 0])
        m = cross(subtract(row(x, triangles[t, 1]), p), subtract(row(x, triangles[t, 2]), p))
        n = (n[0] + m[0], n[1] + m[1], n[2] + m[2])
    length = math.sqrt(dot(n, n))
    return (n[0] / length, n[1] / length, n[2] / length) if length > 0.0 else n


@njit(inline="always")
def along(x, i, n):
    """The coordinate of node i along n."""
    return x[i, 0] * n[0] + x[i, 1] * n[1] + x[i, 2] * n[2]


@njit
def is_loaded(impulses, k):
    return impulses[k, 0] != 0.0 or impulses[k, 1] != 0.0 or impulses[k, 2] != 0.0


@njit(cache=True)
def loaded_pairs(impulses):
    """The numbers of the pairs that push, from impulses (k, 3)."""
    return np.array([k for k in range(len(impulses)) if is_loaded(impulses, k)], dtype=np.int64)


@njit(cache=True)
def describe_pairs(first, points, edges, simplices, pairs):
    """Fill in what pairs of surfaces are, from row `first` on: nodes, kinds, keys, whether they push, friction, gaps.

    points : (k, 2) points and triangles; edges : (l, 2)
    Pairs of one body push that are farther from each other at rest than twice their gap.
    """
    s = simplices
    for e in range(len(points) + len(edges)):
        k = first + e
        if e < len(points):
            p, t = points[e, 0], points[e, 1]
            pairs.nodes[k, 0] = s.nodes[p]
            for j in range(3):
                pairs.nodes[k, 1 + j] = s.triangles[t, j]
            pairs.kinds[k], pairs.shapes[k] = POINT, t
            pairs.keys[k] = np.int64(p) << 31 | t
        else:
            a, b = edges[e - len(points), 0], edges[e - len(points), 1]
            for j in range(2):
                pairs.nodes[k, j], pairs.nodes[k, 2 + j] = s.edges[a, j], s.edges[b, j]
            pairs.kinds[k] = EDGES
            pairs.keys[k] = -1 - (np.int64(a) << 31 | b)
        one, other = s.owner[pairs.nodes[k, 0]], s.owner[pairs.nodes[k, 3]]
        pairs.friction[k], pairs.gaps[k] = s.friction[one, other], np.inf
        for i in range(4):
            pairs.gaps[k] = min(pairs.gaps[k], s.gaps[pairs.nodes[k, i]])
        pairs.pushes[k] = True
        if one == other:
            _, r = weights_of(s.rest, pairs.nodes, k, pairs.kinds[k])
            pairs.pushes[k] = dot(r, r) > (2.0 * pairs.gaps[k]) ** 2


@njit
def room_between(begin, end, nodes, k, kind, n):
    """The width of the slab across n that neither side of a pair enters, at the beginning and at the end."""
    p, q, r, s = nodes[k, 0], nodes[k, 1], nodes[k, 2], nodes[k, 3]
    low = min(along(begin, p, n), along(end, p, n))
    high = max(max(along(begin, r, n), along(end, r, n)), max(along(begin, s, n), along(end, s, n)))
    one, other = along(begin, q, n), along(end, q, n)
    if kind == POINT:
        return low - max(high, max(one, other))
    return min(low, min(one, other)) - high


@njit
def relative_speed(v, nodes, k, kind):
    """The largest relative speed of nodes of the two sides of a pair."""
    p, q, r, s = row(v, nodes[k, 0]), row(v, nodes[k, 1]), row(v, nodes[k, 2]), row(v, nodes[k, 3])
    if kind == SHAPE:
        return math.sqrt(dot(p, p))
    a, b = subtract(p, r), subtract(p, s)
    most = max(dot(a, a), dot(b, b))
    if kind == POINT:
        c = subtract(p, q)
        return math.sqrt(max(most, dot(c, c)))
    a, b = subtract(q, r), subtract(q, s)
    return math.sqrt(max(most, max(dot(a, a), dot(b, b))))


@njit(cache=True)
def mean_square_speed(v, pairs):
    """The mean square of the relative speeds of pairs of surfaces [m^2/s^2], zero without any."""
    count, total = 0, 0.0
    for k in range(len(pairs.nodes)):
        if pairs.kinds[k] != SHAPE:
            count += 1
            total += relative_speed(v, pairs.nodes, k, pairs.kinds[k]) ** 2
    return total / max(count, 1)


@njit(cache=True)
def copy_pairs(old, rows, new, first):
    """Copy pairs to the rows from `first` on."""
    for m in range(len(rows)):
        k, o = first + m, rows[m]
        for i in range(4):
            new.nodes[k, i] = old.nodes[o, i]
        for j in range(3):
            new.normals[k, j], new.impulses[k, j] = old.normals[o, j], old.impulses[o, j]
        new.kinds[k], new.shapes[k], new.keys[k], new.near[k] = old.kinds[o], old.shapes[o], old.keys[o], old.near[o]
        new.pushes[k], new.deep[k] = old.pushes[o], old.deep[o]
        new.friction[k], new.gaps[k], new.reached[k] = old.friction[o], old.gaps[o], old.reached[o]


@njit(cache=True)
def near_pairs(x, v, pairs, time, reach, moved, out):
    """List the pairs that may come nearer than their gap and `reach` while their nodes go on, and all with shapes.

    Of others it is known already, unless a node has `moved` (N,); returns the number of near pairs.
    """
    count = 0
    nodes = pairs.nodes
    for k in range(len(nodes)):
        kind = pairs.kinds[k]
        if kind == SHAPE or pairs.deep[k] or is_loaded(pairs.impulses, k):
            pairs.near[k] = NEAR
        elif (
            pairs.near[k] == UNKNOWN
            or moved[nodes[k, 0]]
            or moved[nodes[k, 1]]
            or moved[nodes[k, 2]]
            or moved[nodes[k, 3]]
        ):
            pairs.near[k] = FAR
            far = pairs.gaps[k] + reach + time * relative_speed(v, nodes, k, kind)
            if room_between(x, x, nodes, k, kind, row(pairs.normals, k)) > far:
                continue
            _, r = weights_of(x, nodes, k, kind)
            size = math.sqrt(dot(r, r))
            for j in range(3):
                pairs.normals[k, j] = r[j] / size if size > 0.0 else 0.0
            if size <= far:
                pairs.near[k] = NEAR
        out[count] = k
        count += pairs.near[k]
    return count


def hand_on(old: Pairs, kept: NDArray[np.int64], new: Pairs) -> None:
    """Give the impulses of loaded pairs that are not kept to the same pairs of a new list."""
    held = loaded_pairs(old.impulses)
    if len(held):
        left = np.ones(len(old.keys), dtype=np.bool_)
        left[kept] = False
        held = held[left[held]]
    open_ = np.flatnonzero(new.near == UNKNOWN)
    if not len(held) or not len(open_):
        return
    held = held[np.argsort(old.keys[held])]
    place = np.minimum(np.searchsorted(old.keys[held], new.keys[open_]), len(held) - 1)
    same = old.keys[held[place]] == new.keys[open_]
    found, source = open_[same], held[place[same]]
    new.impulses[found], new.normals[found] = old.impulses[source], old.normals[source]
    new.reached[found] = old.reached[source]
