"""Things that penetrate each other when a frame begins: the pairs that push them out, and what is not kept apart.

Pairs of surfaces that cross do not keep their sides, because that would prevent their separation. A point of one thing
that is inside of the other is pushed towards the triangle that is nearest at that time. Two edges whose nearest places
are inside of each other's things are pushed past each other.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.contact.search.distances import point_triangle_square
from supple.numerics.geometry.closest_points import closest_on_segments, closest_on_triangle
from supple.numerics.geometry.triangle_crossings import crossing_triangles
from supple.numerics.geometry.winding_number import winding_number
from supple.numerics.mat3 import dot, row, subtract
from supple.runtime.kernel_cache import njit
from supple.solvers.xpbd.contact.pairs import NIL, normal_at
from supple.solvers.xpbd.contact.search.surface import Simplices


class Overlaps(NamedTuple):
    """Things that penetrate each other when a frame begins.

    Attributes
    ----------
    crossing : (p, p) which things do
    points : (k, 2) points and triangles; edges : (l, 2)
    normals : (k + l, 3) the ways out of the first sides
    """

    crossing: NDArray[np.bool_]
    points: NDArray[np.int32]
    edges: NDArray[np.int32]
    normals: NDArray[np.float64]

    @classmethod
    def none(cls, things: int) -> Overlaps:
        """Of things that are apart: empty."""
        pairs = np.zeros((0, 2), dtype=np.int32)
        return cls(np.zeros((things, things), dtype=np.bool_), pairs, pairs, np.zeros((0, 3)))


def find_overlaps(
    s: Simplices, closed: NDArray[np.bool_], x: NDArray[np.float64], crossing: Iterable[tuple[int, int]]
) -> Overlaps:
    """Of pairs of things whose surfaces cross, and of those that are inside of others, with their nodes at x (N, >= 3).

    closed : (p,) which surfaces are closed
    """
    pairs = {pair for pair in crossing if not _only_touches(s, x, *pair)} | _nested(s, closed, x)
    pairs = {(min(pair), max(pair)) for pair in pairs}
    out = Overlaps.none(len(s.collide))
    if not pairs:
        return out
    points, edges, ways = [out.points], [out.edges], [[out.normals], [out.normals]]
    of_triangle, of_edge = s.owner[s.triangles[:, 0]], s.owner[s.edges[:, 0]]
    for a, b in pairs:
        out.crossing[a, b] = out.crossing[b, a] = True
        if a == b:
            continue
        first, second = (s.triangles[of_triangle == k] for k in (a, b))
        for one, other, triangles in ((a, b, second), (b, a, first)):
            if not closed[other]:
                continue
            mine, theirs = _inside_box(s, x, one, triangles), np.flatnonzero(of_triangle == other)
            nearest, normals = _ways_out(x, s.nodes[mine], triangles)
            inside = nearest >= 0
            points.append(np.column_stack([mine[inside], theirs[nearest[inside]]]).astype(np.int32))
            ways[0].append(normals[inside])
        if closed[a] and closed[b]:
            mine, theirs = np.flatnonzero(of_edge == a), np.flatnonzero(of_edge == b)
            found, normals = _edges_through(x, s.edges[mine], s.edges[theirs], first, second)
            edges.append(np.column_stack([mine[found[:, 0]], theirs[found[:, 1]]]).astype(np.int32))
            ways[1].append(normals)
    normals = np.concatenate([*ways[0], *ways[1]])
    return out._replace(points=np.concatenate(points), edges=np.concatenate(edges), normals=normals)


def _only_touches(s: Simplices, x: NDArray[np.float64], a: int, b: int) -> bool:
    """Whether two things cross by so little that they count as touching: not with one of them smaller by that."""
    owner = s.owner[s.triangles[:, 0]]
    if a == b:
        return False
    mine, places = s.triangles[owner == a], x[:, :3].copy()
    nodes = np.unique(mine)
    normals = np.array([normal_at(x, i, (s.around, s.triangles)) for i in nodes])
    places[nodes] -= NIL * s.gaps[nodes, None] * normals
    both, pair = (owner == a) | (owner == b), np.zeros_like(s.collide)
    pair[a, b] = pair[b, a] = True
    return not len(crossing_triangles(places, s.triangles[both], owner[both], pair, 1)[0])


def _nested(s: Simplices, closed: NDArray[np.bool_], x: NDArray[np.float64]) -> set[tuple[int, int]]:
    """The pairs of things of which one is wholly inside of the other."""
    things = len(s.collide)
    boxes = np.full((2, things, 3), np.inf)
    np.minimum.at(boxes[0], s.owner[s.nodes], x[s.nodes, :3])
    np.minimum.at(boxes[1], s.owner[s.nodes], -x[s.nodes, :3])
    low, high = boxes[0], -boxes[1]
    within = s.collide & closed & np.isfinite(low[:, :1])
    for a, b in zip(low.T, high.T, strict=True):
        within &= (a[:, None] >= a) & (b[:, None] <= b)
    np.fill_diagonal(within, False)
    found = set()
    for a, b in np.argwhere(within).tolist():
        node = s.nodes[np.flatnonzero(s.owner[s.nodes] == a)[0]]
        if abs(winding_number(x, s.triangles[s.owner[s.triangles[:, 0]] == b], tuple(x[node, :3]))) > 0.5:
            found.add((min(a, b), max(a, b)))
    return found


def _inside_box(s: Simplices, x: NDArray[np.float64], thing: int, triangles: NDArray[np.int32]) -> NDArray[np.int64]:
    """The points of a thing that are in the box of triangles."""
    mine, corners = np.flatnonzero(s.owner[s.nodes] == thing), x[triangles, :3].reshape(-1, 3)
    places = x[s.nodes[mine], :3]
    return mine[((places >= corners.min(axis=0)) & (places <= corners.max(axis=0))).all(axis=1)]


@njit
def _unit(r):
    length = np.sqrt(dot(r, r))
    return (r[0] / length, r[1] / length, r[2] / length) if length > 0.0 else (0.0, 1.0, 0.0)


@njit(cache=True)
def _ways_out(x, nodes, triangles):
    """The triangle (k,) nearest to each node inside of the closed surface, -1 for others, and the way there (k, 3)."""
    out, ways = np.full(len(nodes), -1), np.zeros((len(nodes), 3))
    for k in range(len(nodes)):
        p = row(x, nodes[k])
        if abs(winding_number(x, triangles, p)) < 0.5:
            continue
        least = np.inf
        for t in range(len(triangles)):
            square = point_triangle_square(x, nodes[k], triangles, t)
            if square < least:
                least, out[k] = square, t
        t = out[k]
        a, b, c = row(x, triangles[t, 0]), row(x, triangles[t, 1]), row(x, triangles[t, 2])
        u = closest_on_triangle(p, a, b, c)
        way = _unit(
            (
                u[0] * a[0] + u[1] * b[0] + u[2] * c[0] - p[0],
                u[0] * a[1] + u[1] * b[1] + u[2] * c[1] - p[1],
                u[0] * a[2] + u[1] * b[2] + u[2] * c[2] - p[2],
            )
        )
        for j in range(3):
            ways[k, j] = way[j]
    return out, ways


@njit(cache=True)
def _edges_through(x, first, second, of_first, of_second):
    """Edges (k, 2) of two closed surfaces whose nearest places are inside of each other's, and the ways out."""
    pairs, ways = [(0, 0)], [(0.0, 0.0, 0.0)]
    for e in range(len(first)):
        a, b = row(x, first[e, 0]), row(x, first[e, 1])
        for f in range(len(second)):
            c, d = row(x, second[f, 0]), row(x, second[f, 1])
            s, t = closest_on_segments(a, b, c, d)
            if not (0.0 < s < 1.0 and 0.0 < t < 1.0):
                continue
            p, q = subtract(b, a), subtract(d, c)
            p = (a[0] + s * p[0], a[1] + s * p[1], a[2] + s * p[2])
            q = (c[0] + t * q[0], c[1] + t * q[1], c[2] + t * q[2])
            if abs(winding_number(x, of_second, p)) > 0.5 and abs(winding_number(x, of_first, q)) > 0.5:
                pairs.append((e, f))
                ways.append(_unit(subtract(q, p)))
    return np.array(pairs)[1:], np.array(ways)[1:]
