"""Contacts of edges that cross each other, where at least one of them protrudes from its surface.

The energy of a pair is that of the distance of the two edges, minus that of the smallest distance of an end from the
other edge: it is zero where the closest point is an end, because vertices have contacts of their own, and along a ridge
of several edges the sum with the energy of its vertices is nearly constant.

Where two flat faces lie on each other, no edge protrudes, and none counts. The ridge of a knife has a contact with
every edge that it crosses; so have two ridges that cross.
"""

import math

import numpy as np

from supple.contact.features.contacts import has_grown, known_weight, put
from supple.contact.features.pair_geometry import EDGE_EDGE, VERTEX_EDGE, VERTEX_VERTEX, unit
from supple.contact.features.vertex_contacts import NEARER_SHARE
from supple.contact.features.vertex_features import nearest_of_edge, square_of_gap
from supple.numerics.mat3 import cross, dot, row, subtract
from supple.runtime.kernel_cache import njit, prange

# Squared sine of the angle between two edges from which they count in full. Parallel edges do not count: their ends do.
_CROSSING = 1e-3

# Of the smaller area of two edges. In a regular mesh, two edges then stand for as much as a vertex.
_SHARE = 1.5


@njit(cache=True, parallel=True)
def edge_weights(x, pairs, mesh, areas, dhat, known):
    """Areas of the contacts of pairs of edges.

    Parameters
    ----------
    x : (s, 3) [m]; pairs : (l, 2)
    mesh : triangles, edges, start and items of edge_triangles, offsets (see `ContactMesh`)
    areas : (e,) a third of each edge's triangles at rest [m^2]
    known : the weights that do not depend on x, a `KnownWeights`

    Returns
    -------
    weights : (l,) [m^2], zero without a contact
    squares : (l,) squared gaps, below zero where gaps are; infinite where the edges do not cross, or not below dhat
        [m^2]
    keys : (l,) codes of the pairs, for `KnownWeights`
    grown : (l,) weights that are to be known [m^2], -1 where they do not change
    """
    triangles, edges, edge_start, edge_items, offsets = mesh
    weights, squares = np.zeros(len(pairs)), np.full(len(pairs), np.inf)
    keys, grown = np.empty(len(pairs), dtype=np.int64), np.full(len(pairs), -1.0)
    h = NEARER_SHARE * dhat
    for k in prange(len(pairs)):
        e, f = pairs[k, 0], pairs[k, 1]
        a, b, c, d = row(x, edges[e, 0]), row(x, edges[e, 1]), row(x, edges[f, 0]), row(x, edges[f, 1])
        s, t, r, crossing = crossing_point(a, b, c, d)
        square, offset = dot(r, r), offsets[edges[e, 0]] + offsets[edges[f, 0]]
        far = dhat + offset
        if not (crossing > 0.0 and 0.0 < s < 1.0 and 0.0 < t < 1.0 and square < far * far):
            continue
        squares[k] = square_of_gap(square, offset)
        one = _height(x, triangles, edges, edge_start, edge_items, e, f, r, -1.0)
        other = _height(x, triangles, edges, edge_start, edge_items, f, e, r, 1.0)
        protruding = min(1.0, max(0.0, max(one, other) / h))
        nearest = min(1.0, max(0.0, 1.0 + min(one, other) / h))
        angle = min(1.0, crossing / _CROSSING)
        full = _SHARE * min(areas[e], areas[f])
        now = full * protruding * nearest * angle * (2.0 - angle)
        # Below zero: the codes of vertices are not.
        keys[k] = -1 - np.int64(e) * len(edges) - f
        before = known_weight(known, keys[k])
        if has_grown(before, now, full):
            grown[k] = now
        weights[k] = now if before < 0.0 else before
    return weights, squares, keys, grown


@njit
def crossing_point(a, b, c, d):
    """Where the lines a b and c d are closest to each other.

    Returns
    -------
    s, t : the points (1 - s) a + s b and (1 - t) c + t d; r : from the second to the first
    crossing : squared sine of the angle between the lines; 0 where the others have no meaning
    """
    u, v, w = subtract(b, a), subtract(d, c), subtract(c, a)
    n = cross(u, v)
    nn, both = dot(n, n), dot(u, u) * dot(v, v)
    if not nn > 1e-20 * both:
        return 0.0, 0.0, w, 0.0
    apart = -dot(w, n) / nn
    r = (apart * n[0], apart * n[1], apart * n[2])
    return dot(cross(w, v), n) / nn, dot(cross(w, u), n) / nn, r, nn / both


@njit
def _height(x, triangles, edges, edge_start, edge_items, e, other, r, sign):
    """How far the surface recedes beside edge e, against the direction sign * r, over the edge's length [m].

    Negative where it comes nearer. Triangles that end at the other edge have no contacts with it, and do not count: in
    a crease, the surface always comes nearer there. Infinite without others.
    """
    length = math.sqrt(dot(r, r))
    least = np.inf
    for k in range(edge_start[e], edge_start[e + 1]):
        t = edge_items[k]
        if _ends_at(triangles, t, edges[other, 0]) or _ends_at(triangles, t, edges[other, 1]):
            continue
        least = min(least, -sign * dot(r, _inward(x, triangles, t, edges[e, 0], edges[e, 1])) / length)
    along = subtract(row(x, edges[e, 1]), row(x, edges[e, 0]))
    return least * math.sqrt(dot(along, along))


@njit
def _ends_at(triangles, t, v):
    return triangles[t, 0] == v or triangles[t, 1] == v or triangles[t, 2] == v


@njit
def _inward(x, triangles, t, a, b):
    """Unit vector in the plane of triangle t from its edge of the points a and b inwards; zero without area."""
    o = triangles[t, 0] + triangles[t, 1] + triangles[t, 2] - a - b
    along, over = subtract(row(x, b), row(x, a)), subtract(row(x, o), row(x, a))
    return unit(cross(cross(along, over), along))


@njit(cache=True)
def write_edge_contacts(x, pairs, rows, weights, edges, offsets, first, out):
    """Write two contacts for each of the rows (m,) of pairs with a weight into `out`, a `Contacts`, from `first` on.

    Returns
    -------
    saddles : (s,) weights [m^2] that vertices need because they are ends of several edges that cross the same edge

    Every pair of edges takes the energy of its nearest end away. Where two edges of a ridge that bends away cross an
    edge beside their common vertex, that vertex's energy must be counted once more, or nothing is left of the three.
    """
    codes = np.empty(len(rows), dtype=np.int64)
    for m in range(len(rows)):
        k, n = rows[m], first + 2 * m
        e, f = pairs[k, 0], pairs[k, 1]
        ids = (edges[e, 0], edges[e, 1], edges[f, 0], edges[f, 1])
        s, t, r, _ = crossing_point(row(x, ids[0]), row(x, ids[1]), row(x, ids[2]), row(x, ids[3]))
        offset = offsets[ids[0]] + offsets[ids[2]]
        put(out, n, EDGE_EDGE, ids, (1.0 - s, s, t - 1.0, -t), r, offset)
        least, nearest = np.inf, 0
        for end in range(4):
            vertex, one, other = _end(ids, end)
            _, r = nearest_of_edge(row(x, vertex), row(x, one), row(x, other))
            if dot(r, r) < least:
                least, nearest = dot(r, r), end
        # The nearest end with the other edge, or with an end of that.
        end, one, other = _end(ids, nearest)
        w, r = nearest_of_edge(row(x, end), row(x, one), row(x, other))
        if 0.0 < w < 1.0:
            put(out, n + 1, VERTEX_EDGE, (end, one, other, -1), (1.0, w - 1.0, -w, 0.0), r, offset)
        else:
            points = (end, one if w == 0.0 else other, -1, -1)
            put(out, n + 1, VERTEX_VERTEX, points, (1.0, -1.0, 0.0, 0.0), r, offset)
        out.weights[n], out.weights[n + 1] = weights[k], -weights[k]
        codes[m] = np.int64(end) * len(edges) + (f if nearest < 2 else e)
    saddles, order = np.zeros(len(x)), np.argsort(codes, kind="mergesort")
    begin = 0
    while begin < len(order):
        end, total, most = begin, 0.0, 0.0
        while end < len(order) and codes[order[end]] == codes[order[begin]]:
            weight = weights[rows[order[end]]]
            total, most = total + weight, max(most, weight)
            end += 1
        vertex = codes[order[begin]] // len(edges)
        saddles[vertex] = max(saddles[vertex], total - most)
        begin = end
    return saddles


@njit
def _end(ids, end):
    """The end of two edges with a number, and the ends of the other edge."""
    return (ids[end], ids[2], ids[3]) if end < 2 else (ids[end], ids[0], ids[1])
