"""Which pairs of points and triangles, and of edges, may come near each other while all nodes go straight on.

A pair is found if its parts may come nearer than `reach` on the given ways. Only relative ways count: what goes
together is near what it was near. Boxes of patches are swept along an axis; in patches whose boxes overlap, the parts
are compared that reach into the box of the other patch.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from supple.contact.search.distances import edge_edge_square, point_triangle_square
from supple.contact.search.patches import Parts, Patches
from supple.numerics.adjacency import in_list
from supple.numerics.mat3 import dot, row, subtract
from supple.runtime.kernel_cache import njit

# Points and edges of a patch of 16 triangles, at most.
_SCRATCH = 96


@njit(cache=True)
def _boxes(x, way, nodes, out):
    """Write the box that each part (m, k) of nodes sweeps to out (m, 6)."""
    for e in range(len(nodes)):
        for j in range(3):
            low, high = np.inf, -np.inf
            for k in range(nodes.shape[1]):
                a = x[nodes[e, k], j]
                b = a + way[nodes[e, k], j]
                low, high = min(low, min(a, b)), max(high, max(a, b))
            out[e, j], out[e, 3 + j] = low, high


@njit(cache=True)
def _boxes_of_patches(triangles, boxes, out):
    for q in range(len(out)):
        for j in range(3):
            low, high = np.inf, -np.inf
            for k in range(triangles.start[q], triangles.start[q + 1]):
                t = triangles.items[k]
                low, high = min(low, boxes[t, j]), max(high, boxes[t, 3 + j])
            out[q, j], out[q, 3 + j] = low, high


@njit(inline="always")
def _meet(a, i, b, j, reach):
    return (
        a[i, 0] - reach <= b[j, 3] and b[j, 0] - reach <= a[i, 3]
        and a[i, 1] - reach <= b[j, 4] and b[j, 1] - reach <= a[i, 4]
        and a[i, 2] - reach <= b[j, 5] and b[j, 2] - reach <= a[i, 5]
    )  # fmt: skip


@njit(inline="always")
def _relative(way, a, b):
    d = subtract(row(way, a), row(way, b))
    return dot(d, d)


@njit
def _point_near(x, way, v, triangles, t, reach):
    """Whether a point may come nearer to a triangle than `reach`."""
    a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
    far = reach + math.sqrt(max(_relative(way, v, a), _relative(way, v, b), _relative(way, v, c)))
    # The plane across the line from the middle of the triangle to the point, before the exact distance.
    p, u, w, z = row(x, v), row(x, a), row(x, b), row(x, c)
    n = (p[0] - (u[0] + w[0] + z[0]) / 3.0, p[1] - (u[1] + w[1] + z[1]) / 3.0, p[2] - (u[2] + w[2] + z[2]) / 3.0)
    room = dot(p, n) - max(dot(u, n), dot(w, n), dot(z, n))
    if room > 0.0 and room * room > far * far * dot(n, n):
        return False
    return point_triangle_square(x, v, triangles, t) <= far * far


@njit
def _edges_near(x, way, edges, e, f, reach):
    """Whether two edges may come nearer than `reach`."""
    a, b, c, d = edges[e, 0], edges[e, 1], edges[f, 0], edges[f, 1]
    most = max(max(_relative(way, a, c), _relative(way, a, d)), max(_relative(way, b, c), _relative(way, b, d)))
    far = reach + math.sqrt(most)
    p, q, r, s = row(x, a), row(x, b), row(x, c), row(x, d)
    n = (p[0] + q[0] - r[0] - s[0], p[1] + q[1] - r[1] - s[1], p[2] + q[2] - r[2] - s[2])
    room = min(dot(p, n), dot(q, n)) - max(dot(r, n), dot(s, n))
    if room > 0.0 and room * room > far * far * dot(n, n):
        return False
    return edge_edge_square(x, edges, e, f) <= far * far


@njit
def _reaching(lists, q, boxes, other, o, reach, out):
    """The parts of patch q that reach into a box; returns their number."""
    count = 0
    for k in range(lists.start[q], lists.start[q + 1]):
        if _meet(boxes, lists.items[k], other, o, reach):
            out[count] = lists.items[k]
            count += 1
    return count


@njit(cache=True)
def search_patches(x, way, reach, asked, parts, patches, boxes, order, out_points, out_edges):
    """List pairs with a part in a patch that is asked (q,). Returns the numbers of both kinds, which may not fit.

    Parameters
    ----------
    x, way : (N, >= 3) of the nodes [m]; reach : [m]
    boxes : of points, triangles, edges and patches; order : (q,) patches by the low end of their box along `axis`
    out_points : (k, 2) points and triangles; out_edges : (l, 2) edges, the lower first
    """
    of_points, of_triangles, of_edges, of_patches, axis = boxes
    s, p = parts, patches
    one, other = np.empty(_SCRATCH, dtype=np.int32), np.empty(_SCRATCH, dtype=np.int32)
    points = edges = 0
    for first in range(len(order)):
        a = order[first]
        for second in range(first, len(order)):
            b = order[second]
            if of_patches[b, axis] - reach > of_patches[a, 3 + axis]:
                break
            if not (asked[a] or asked[b]) or not s.collide[p.owner[a], p.owner[b]]:
                continue
            if not _meet(of_patches, a, of_patches, b, reach):
                continue
            for turn in range(1 if a == b else 2):
                u, w = (a, b) if turn == 0 else (b, a)
                m = _reaching(p.points, u, of_points, of_patches, w, reach, one)
                if m == 0:
                    continue
                n = _reaching(p.triangles, w, of_triangles, of_patches, u, reach, other)
                for i in range(m):
                    k = one[i]
                    v = s.nodes[k]
                    for j in range(n):
                        t = other[j]
                        if not _meet(of_points, k, of_triangles, t, reach):
                            continue
                        if v in (s.triangles[t, 0], s.triangles[t, 1], s.triangles[t, 2]):
                            continue
                        if not _point_near(x, way, v, s.triangles, t, reach) or in_list(s.excluded_triangles, k, t):
                            continue
                        if points < len(out_points):
                            out_points[points, 0], out_points[points, 1] = k, t
                        points += 1
            m = _reaching(p.edges, a, of_edges, of_patches, b, reach, one)
            n = _reaching(p.edges, b, of_edges, of_patches, a, reach, other) if m else 0
            for i in range(m):
                e = one[i]
                c, d = s.edges[e, 0], s.edges[e, 1]
                for j in range(i + 1 if a == b else 0, n):
                    f = other[j]
                    if not _meet(of_edges, e, of_edges, f, reach):
                        continue
                    g, h = s.edges[f, 0], s.edges[f, 1]
                    if c in (g, h) or d in (g, h):
                        continue
                    if not _edges_near(x, way, s.edges, e, f, reach) or in_list(s.excluded_edges, e, f):
                        continue
                    if edges < len(out_edges):
                        out_edges[edges, 0], out_edges[edges, 1] = min(e, f), max(e, f)
                    edges += 1
    return points, edges


class PatchSearch:
    """Searches surfaces; keeps the memory of its results."""

    def __init__(self, parts: Parts, patches: Patches) -> None:
        self._parts, self._patches = parts, patches
        self._simplices = parts.nodes[:, None], parts.triangles, parts.edges
        self._boxes = [np.empty((len(rows), 6)) for rows in (*self._simplices, patches.owner)]
        self._room = [np.empty((1024, 2), dtype=np.int32) for _ in range(2)]

    def find(
        self, x: NDArray[np.float64], way: NDArray[np.float64], reach: float, asked: NDArray[np.bool_] | None = None
    ) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
        """(k, 2) points and triangles, (l, 2) edges, the lower first; see the module.

        Parameters
        ----------
        x, way : (N, 3) [m]; reach : [m]; asked : (q,) patches of one side of every pair, None for all
        """
        p = self._patches
        asked = np.ones(len(p.owner), dtype=np.bool_) if asked is None else asked
        for rows, boxes in zip(self._simplices, self._boxes, strict=False):
            _boxes(x, way, rows, boxes)
        of_patches = self._boxes[3]
        _boxes_of_patches(p.triangles, self._boxes[1], of_patches)
        axis = int(np.argmax(of_patches[:, 3:].max(axis=0) - of_patches[:, :3].min(axis=0))) if len(of_patches) else 0
        order = np.argsort(of_patches[:, axis], kind="stable")
        boxes = (*self._boxes, axis)
        while True:
            counts = search_patches(x, way, reach, asked, self._parts, p, boxes, order, *self._room)
            if all(count <= len(room) for count, room in zip(counts, self._room, strict=True)):
                break
            self._room = [np.empty((count + count // 2 + 64, 2), dtype=np.int32) for count in counts]
        return self._room[0][: counts[0]].copy(), self._room[1][: counts[1]].copy()


def pairs_nearer(
    x: NDArray[np.float64], parts: Parts, patches: Patches, reach: float
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Pairs of points with triangles, and of edges, that are not farther apart than `reach` [m] at x (N, 3)."""
    return PatchSearch(parts, patches).find(x, np.zeros_like(x), reach)
