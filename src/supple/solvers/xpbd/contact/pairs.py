"""Pairs that may touch: what lists hold between substeps, and the geometry of a pair.

A pair has four nodes with weights c_i, and r = sum c_i x_i - q is the vector from the nearest place of its second side
to that of its first. It is a point and a triangle, two edges, or a point and a simple shape (a plane or the wall of a
room): then all four nodes are the point, c = (1, 0, 0, 0), and q is the nearest place of the shape. Otherwise q = 0 and
the weights add up to zero.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from supple.numerics.geometry.closest_points import closest_on_segments, closest_on_triangle
from supple.numerics.mat3 import cross, dot, row, subtract
from supple.runtime.kernel_cache import njit

POINT, EDGES, SHAPE = 0, 1, 2
# Of `Pairs.near`.
FAR, NEAR, UNKNOWN = 0, 1, 2
PART = (1 << 30) - 1
# Of the gap: what is nearer touches. The cosine of the angle between the normals of what does.
NIL, OPPOSED = 5e-6, -0.25


# A pair: its nodes and kind; of pairs with a shape, the number of that, of pairs with a triangle, that of the triangle;
# its parts as one number, see `keys_of`, by which pairs are sorted. Whether it pushes: pairs of one body that are near
# each other at rest are only kept apart. Whether the sides penetrated each other when the frame began: then they are
# not kept on their sides, but pushed out along the normals at that time. Friction; the smallest gap of its nodes and
# the offsets of its sides together, and these alone [m]. The normal as of the latest look, and the impulse with which
# the next substep begins [kg m]. The largest distance of its rows since it is listed, its gap at most [m]. Whether it
# may come near while its nodes go on, see `near_pairs`.
PAIR = np.dtype(
    [
        ("keys", np.int64),
        ("nodes", np.int32, 4),
        ("shapes", np.int32),
        ("kinds", np.int8),
        ("pushes", np.bool_),
        ("deep", np.bool_),
        ("near", np.int8),
        ("friction", np.float64),
        ("gaps", np.float64),
        ("offsets", np.float64),
        ("normals", np.float64, 3),
        ("impulses", np.float64, 3),
        ("reached", np.float64),
    ],
    align=True,
)


def pairs_with_keys(keys: NDArray[np.int64]) -> NDArray[np.void]:
    """(k,) of `PAIR`: room for the pairs with these sorted keys, of which nothing is known."""
    pairs = np.zeros(len(keys), dtype=PAIR)
    pairs["keys"], pairs["pushes"], pairs["near"] = keys, True, UNKNOWN
    return pairs


def keys_of(kind: int, first: NDArray[np.integer], second: NDArray[np.integer]) -> NDArray[np.int64]:
    """The keys (k,) of pairs of a kind: of points and triangles, of edges, or of shapes and points."""
    return np.int64(kind) << 60 | first.astype(np.int64) << 30 | second


def parts_of(keys: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """The kinds (k,) and the first and second parts of pairs with these keys."""
    return keys >> 60, keys >> 30 & PART, keys & PART


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
def describe_pairs(pairs, s, shape_friction, old, is_kept):
    """Fill in what pairs are, and what was known of those of them that are among `old` pairs.

    Pairs of one body push that are farther from each other at rest than twice their gap without offsets,
    and than one and a half times these, as in `contact.mesh.near_at_rest`.

    Parameters
    ----------
    s : see `Simplices`; shape_friction : (owners, shapes)
    is_kept : (o,) of old pairs, whether the new list knows of them what the old one did
    """
    o = 0
    for k in range(len(pairs.keys)):
        key = pairs.keys[k]
        kind, first, second = key >> 60, key >> 30 & PART, key & PART
        pairs.kinds[k] = kind
        if kind == SHAPE:
            i = s.nodes[second]
            pairs.nodes[k, :] = i
            pairs.shapes[k], pairs.friction[k] = first, shape_friction[s.owner[i], first]
        elif kind == POINT:
            pairs.nodes[k, 0], pairs.shapes[k] = s.nodes[first], second
            for j in range(3):
                pairs.nodes[k, 1 + j] = s.triangles[second, j]
        else:
            for j in range(2):
                pairs.nodes[k, j], pairs.nodes[k, 2 + j] = s.edges[first, j], s.edges[second, j]
        gap = np.inf
        for i in range(4):
            gap = min(gap, s.gaps[pairs.nodes[k, i]])
        pairs.offsets[k] = s.offsets[pairs.nodes[k, 0]] + (s.offsets[pairs.nodes[k, 3]] if kind != SHAPE else 0.0)
        pairs.gaps[k] = gap + pairs.offsets[k]
        one, other = s.owner[pairs.nodes[k, 0]], s.owner[pairs.nodes[k, 3]]
        if kind != SHAPE:
            pairs.friction[k] = s.friction[one, other]
        while o < len(old.keys) and old.keys[o] < key:
            o += 1
        known = o < len(old.keys) and old.keys[o] == key
        if known:
            for j in range(3):
                pairs.normals[k, j], pairs.impulses[k, j] = old.normals[o, j], old.impulses[o, j]
            pairs.reached[k], pairs.deep[k] = old.reached[o], old.deep[o]
        if known and is_kept[o]:
            pairs.near[k], pairs.pushes[k] = old.near[o], old.pushes[o]
        elif kind != SHAPE and one == other:
            _, r = weights_of(s.rest, pairs.nodes, k, kind)
            pairs.pushes[k] = dot(r, r) > max(2.0 * gap, 1.5 * pairs.offsets[k]) ** 2


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


@njit
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
