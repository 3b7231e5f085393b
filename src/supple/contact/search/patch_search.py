"""Which pairs of points and triangles, and of edges, may come near each other while all nodes go straight on.

A pair is found if its parts may come nearer than `reach` on the given ways. Only relative ways count: parts that move
together keep their distance. Of parts that go `apart`, each may be anywhere on its own way. Boxes of patches are swept
along an axis; in patches whose boxes overlap, the parts are compared that reach into the box of the other patch.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from supple.contact.search.distances import edge_edge_square, point_triangle_square
from supple.contact.search.patches import Parts, Patches
from supple.numerics.adjacency import Adjacency, in_list
from supple.numerics.mat3 import dot, row, subtract
from supple.runtime.kernel_cache import njit, prange
from supple.runtime.threads import has_several

# Points and edges of a patch of 16 triangles, at most.
_SCRATCH = 96
# Parts of a search that threads share. They find the pairs in the order in which one finds them.
_RUNS = 16


@njit(cache=True)
def _boxes(x, way, nodes, out):
    """Write the box that each part (m, k) of nodes sweeps to out (6, m): the low corner, then the high one."""
    for e in range(len(nodes)):
        for j in range(3):
            low, high = np.inf, -np.inf
            for k in range(nodes.shape[1]):
                a = x[nodes[e, k], j]
                b = a + way[nodes[e, k], j]
                low, high = min(low, min(a, b)), max(high, max(a, b))
            out[j, e], out[3 + j, e] = low, high


@njit(cache=True)
def _boxes_of_patches(start, boxes, out):
    for q in range(len(start) - 1):
        for j in range(3):
            out[j, q] = boxes[j, start[q] : start[q + 1]].min()
            out[3 + j, q] = boxes[3 + j, start[q] : start[q + 1]].max()


@njit
def _meeting(box, i, boxes, first, last, reach, hits, out):
    """List which of the boxes from `first` to `last` come nearer to box i than `reach`; returns their number.

    The first loop has no branch, so that it is compiled to vector instructions.
    """
    a, b, c = box[0, i] - reach, box[1, i] - reach, box[2, i] - reach
    d, e, f = box[3, i] + reach, box[4, i] + reach, box[5, i] + reach
    n = last - first
    x, y, z = boxes[0, first:last], boxes[1, first:last], boxes[2, first:last]
    u, v, w = boxes[3, first:last], boxes[4, first:last], boxes[5, first:last]
    for j in range(n):
        hits[j] = (x[j] <= d) & (y[j] <= e) & (z[j] <= f) & (u[j] >= a) & (v[j] >= b) & (w[j] >= c)
    count = 0
    for j in range(n):
        out[count] = j
        count += hits[j]
    return count


@njit(inline="always")
def _relative(way, a, b, apart):
    """The square of how much nearer two nodes may come. Apart, it is largest where each way is whole or not begun."""
    u, v = row(way, a), row(way, b)
    d = subtract(u, v)
    return max(dot(d, d), dot(u, u), dot(v, v)) if apart else dot(d, d)


@njit
def _point_near(x, way, apart, v, triangles, t, reach):
    """Whether a point may come nearer to a triangle than `reach`."""
    a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
    most = max(_relative(way, v, a, apart), _relative(way, v, b, apart), _relative(way, v, c, apart))
    far = reach + math.sqrt(most)
    # The plane across the line from the middle of the triangle to the point, before the exact distance.
    p, u, w, z = row(x, v), row(x, a), row(x, b), row(x, c)
    n = (p[0] - (u[0] + w[0] + z[0]) / 3.0, p[1] - (u[1] + w[1] + z[1]) / 3.0, p[2] - (u[2] + w[2] + z[2]) / 3.0)
    room = dot(p, n) - max(dot(u, n), dot(w, n), dot(z, n))
    if room > 0.0 and room * room > far * far * dot(n, n):
        return False
    return point_triangle_square(x, v, triangles, t) <= far * far


@njit
def _edges_near(x, way, apart, edges, e, f, reach):
    """Whether two edges may come nearer than `reach`."""
    a, b, c, d = edges[e, 0], edges[e, 1], edges[f, 0], edges[f, 1]
    first = max(_relative(way, a, c, apart), _relative(way, a, d, apart))
    most = max(first, _relative(way, b, c, apart), _relative(way, b, d, apart))
    far = reach + math.sqrt(most)
    p, q, r, s = row(x, a), row(x, b), row(x, c), row(x, d)
    n = (p[0] + q[0] - r[0] - s[0], p[1] + q[1] - r[1] - s[1], p[2] + q[2] - r[2] - s[2])
    room = min(dot(p, n), dot(q, n)) - max(dot(r, n), dot(s, n))
    if room > 0.0 and room * room > far * far * dot(n, n):
        return False
    return edge_edge_square(x, edges, e, f) <= far * far


@njit
def _reaching(box, i, boxes, first, last, reach, room):
    """List the parts of a patch, `first` to `last`, that reach into a box, and their boxes; returns their number."""
    hits, items, taken = room
    count = _meeting(box, i, boxes, first, last, reach, hits, items)
    for k in range(count):
        items[k] += first
        for j in range(6):
            taken[j, k] = boxes[j, items[k]]
    return count


@njit
def _search_run(share, x, way, apart, reach, asked, s, patches, boxes, order, rooms):
    """The pairs of patches in a share of `order`, two ends, with later ones. Returns the numbers of both kinds."""
    out_points, out_edges = rooms
    of_points, of_triangles, of_edges, of_patches, axis = boxes
    owner, patch_triangles, patch_edges, patch_points = patches
    hits, near = np.empty(_SCRATCH, dtype=np.uint8), np.empty(_SCRATCH, dtype=np.int64)
    one = np.empty(_SCRATCH, np.uint8), np.empty(_SCRATCH, np.int64), np.empty((6, _SCRATCH))
    other = np.empty(_SCRATCH, np.uint8), np.empty(_SCRATCH, np.int64), np.empty((6, _SCRATCH))
    points = edges = 0
    for first in range(share[0], share[1]):
        a = order[first]
        for second in range(first, len(order)):
            b = order[second]
            if of_patches[axis, b] - reach > of_patches[3 + axis, a]:
                break
            if not (asked[a] or asked[b]) or not s.collide[owner[a], owner[b]]:
                continue
            if _meeting(of_patches, a, of_patches, b, b + 1, reach, hits, near) == 0:
                continue
            for turn in range(1 if a == b else 2):
                u, w = (a, b) if turn == 0 else (b, a)
                m = _reaching(of_patches, w, of_points, patch_points.start[u], patch_points.start[u + 1], reach, one)
                if m == 0:
                    continue
                start, stop = patch_triangles.start[w], patch_triangles.start[w + 1]
                n = _reaching(of_patches, u, of_triangles, start, stop, reach, other)
                for i in range(m):
                    k = patch_points.items[one[1][i]]
                    v = s.nodes[k]
                    for j in range(_meeting(one[2], i, other[2], 0, n, reach, hits, near)):
                        t = patch_triangles.items[other[1][near[j]]]
                        if v in (s.triangles[t, 0], s.triangles[t, 1], s.triangles[t, 2]):
                            continue
                        if not _point_near(x, way, apart, v, s.triangles, t, reach) or in_list(
                            s.excluded_triangles, k, t
                        ):
                            continue
                        if points < len(out_points):
                            out_points[points, 0], out_points[points, 1] = k, t
                        points += 1
            m = _reaching(of_patches, b, of_edges, patch_edges.start[a], patch_edges.start[a + 1], reach, one)
            start, stop = patch_edges.start[b], patch_edges.start[b + 1]
            n = _reaching(of_patches, a, of_edges, start, stop, reach, other) if m else 0
            for i in range(m):
                e = patch_edges.items[one[1][i]]
                c, d = s.edges[e, 0], s.edges[e, 1]
                start = i + 1 if a == b else 0
                for j in range(_meeting(one[2], i, other[2], start, n, reach, hits, near)):
                    f = patch_edges.items[other[1][start + near[j]]]
                    g, h = s.edges[f, 0], s.edges[f, 1]
                    if c in (g, h) or d in (g, h):
                        continue
                    if not _edges_near(x, way, apart, s.edges, e, f, reach) or in_list(s.excluded_edges, e, f):
                        continue
                    if edges < len(out_edges):
                        out_edges[edges, 0], out_edges[edges, 1] = min(e, f), max(e, f)
                    edges += 1
    return points, edges


@njit(cache=True, parallel=True)
def search_patches(x, way, apart, reach, asked, parts, patches, boxes, order, counts, out_points, out_edges):
    """List pairs with a part in a patch that is asked (q,), in runs over the patches.

    Parameters
    ----------
    x, way : (N, >= 3) of the nodes [m]; apart : whether parts go independently; reach : [m]
    boxes : of points, triangles and edges in the order of their patches, and of patches
    order : (q,) patches by the low end of their box along `axis`
    counts : (r, 2) the numbers of both kinds that each run finds, which may not fit
    out_points : (r, k, 2) points and triangles; out_edges : (r, l, 2) edges, the lower first
    """
    # Numba takes no tuples into a parallel loop.
    nodes, triangles, edges, collide, not_triangles, not_edges = parts
    (not_triangles_start, not_triangles_items), (not_edges_start, not_edges_items) = not_triangles, not_edges
    owner, (of_t_start, of_t_items), (of_e_start, of_e_items), (of_p_start, of_p_items) = patches
    of_points, of_triangles, of_edges, of_patches, axis = boxes
    runs, rows = len(counts), len(order)
    for r in prange(runs):
        no_triangles = Adjacency(not_triangles_start, not_triangles_items)
        no_edges = Adjacency(not_edges_start, not_edges_items)
        its_parts = Parts(nodes, triangles, edges, collide, no_triangles, no_edges)
        its_patches = (
            owner,
            Adjacency(of_t_start, of_t_items),
            Adjacency(of_e_start, of_e_items),
            Adjacency(of_p_start, of_p_items),
        )
        its_boxes = of_points, of_triangles, of_edges, of_patches, axis
        share, rooms = (r * rows // runs, (r + 1) * rows // runs), (out_points[r], out_edges[r])
        points, lines = _search_run(share, x, way, apart, reach, asked, its_parts, its_patches, its_boxes, order, rooms)
        counts[r, 0], counts[r, 1] = points, lines


class PatchSearch:
    """Searches surfaces; keeps the memory of its results."""

    def __init__(self, parts: Parts, patches: Patches) -> None:
        self._parts, self._patches = parts, patches
        p = patches
        points, triangles = parts.nodes[p.points.items, None], parts.triangles[p.triangles.items]
        self._simplices = points, triangles, parts.edges[p.edges.items]
        self._boxes = [np.empty((6, len(rows))) for rows in (*self._simplices, p.owner)]
        self._room = [np.empty((1, 1024, 2), dtype=np.int32) for _ in range(2)]

    def find(
        self,
        x: NDArray[np.float64],
        way: NDArray[np.float64],
        reach: float,
        asked: NDArray[np.bool_] | None = None,
        collide: NDArray[np.bool_] | None = None,
        apart: bool = False,
    ) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
        """(k, 2) points and triangles, (l, 2) edges, the lower first; see the module.

        Parameters
        ----------
        x, way : (N, 3) [m]; reach : [m]; asked : (q,) patches of one side of every pair, None for all
        collide : (p, p) the owners to compare, None for all that may touch; apart : whether parts go independently
        """
        p, parts = self._patches, self._parts if collide is None else self._parts._replace(collide=collide)
        asked = np.ones(len(p.owner), dtype=np.bool_) if asked is None else asked
        for rows, boxes in zip(self._simplices, self._boxes, strict=False):
            _boxes(x, way, rows, boxes)
        of_patches = self._boxes[3]
        _boxes_of_patches(p.triangles.start, self._boxes[1], of_patches)
        axis = int(np.argmax(of_patches[3:].max(axis=1) - of_patches[:3].min(axis=1))) if len(p.owner) else 0
        order = np.argsort(of_patches[axis], kind="stable")
        boxes = (*self._boxes, axis)
        counts = np.empty((_RUNS if has_several() else 1, 2), dtype=np.int64)
        if len(self._room[0]) != len(counts):
            self._room = [np.empty((len(counts), 1024 // len(counts), 2), dtype=np.int32) for _ in range(2)]
        while True:
            search_patches(x, way, apart, reach, asked, parts, p[:4], boxes, order, counts, *self._room)
            most = counts.max(axis=0)
            if all(count <= room.shape[1] for count, room in zip(most, self._room, strict=True)):
                break
            self._room = [np.empty((len(counts), count + count // 2 + 64, 2), dtype=np.int32) for count in most]
        points, edges = (
            np.concatenate([part[:count] for part, count in zip(room, counts[:, kind], strict=True)])
            for kind, room in enumerate(self._room)
        )
        return points, edges


def pairs_nearer(
    x: NDArray[np.float64], parts: Parts, patches: Patches, reach: float
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Pairs of points with triangles, and of edges, that are not farther apart than `reach` [m] at x (N, 3)."""
    return PatchSearch(parts, patches).find(x, np.zeros_like(x), reach)
