"""Contacts of vertices with the triangles, edges and vertices around them.

A vertex stands for half of its area: the vertices of the other surface stand for the other half, so that faces that lie
on each other press on each other with the pressure of the barrier, whatever their meshes.

A vertex that hangs over an edge or a corner, while its own surface comes nearer to that beside it, gets less weight,
down to none: what is in contact there are vertices of the other surface with the faces of this one, or two edges.

Where a vertex is beside the outline of a face and its own surface lies flat on that face, its distance is that from the
plane of the face: faces whose outlines are nearly aligned are held at all of their vertices, and nothing pushes along
them. Its weight fades with the distance from the outline.
"""

import math

import numpy as np

from supple.contact.features.contacts import has_grown, known_row, known_weight, put
from supple.contact.features.pair_geometry import VERTEX_EDGE, VERTEX_TRIANGLE, VERTEX_VERTEX
from supple.contact.features.vertex_features import PARTS, beyond, nearest_of_edge, share_between
from supple.numerics.geometry.closest_points import closest_on_triangle, combine
from supple.numerics.mat3 import cross, dot, row, subtract
from supple.runtime.kernel_cache import njit, prange

# A vertex counts in full while none of its neighbors is nearer, and not at all where one is, by this share of dhat.
NEARER_SHARE = 0.25

# A vertex that hangs beyond the outline of a face counts with its plane: in full up to the first of these shares of
# dhat, not at all from the second on.
_FULL, _NONE = 0.25, 0.75

# Of dhat: how far vertices that hang beyond an outline may be.
REACH = math.sqrt(1.0 + _NONE**2)


@njit(cache=True, parallel=True)
def write_vertex_contacts(x, pairs, groups, mesh, surface, dhat, known, out, new):
    """Write the contacts of `alternating_sums` into the first rows of `out`, a `Contacts`.

    Parameters
    ----------
    groups : rows, starts (groups + 1, 2) where each group begins in `rows` and in `out`, codes, signs, shares
    mesh : triangles, edges, start and items of neighbors (see `ContactMesh`)
    surface : owner, areas, offsets, and (s,) least weights of vertices that `write_edge_contacts` asks for [m^2]
    known : the weights that do not depend on x, a `KnownWeights`
    new : (m,) another one, to be written: codes, the weights that are to be known [m^2], -1 where they do not change,
        and triangles whose planes count, -1 for other contacts
    """
    rows, starts, codes, signs, shares = groups
    owner, areas, offsets, saddles = surface
    keys, grown, planes = new
    triangles, edges, near_start, near_items = mesh
    kinds, points, _, vectors, distances, weights, _ = out
    height = NEARER_SHARE * dhat
    for g in prange(len(starts) - 1):
        v = pairs[rows[starts[g, 0]], 0]
        first, last = starts[g, 1], starts[g + 1, 1]
        offset = PARTS * starts[g, 0] - first
        full = 0.5 * areas[v]
        best, nearest = saddles[v], np.inf
        for k in range(first, last):
            sign = signs[offset + k]
            _write_contact(x, v, codes[offset + k], sign == 0, triangles, edges, offsets, out, k)
            r = row(vectors, k)
            if sign > 0:
                nearest = min(nearest, distances[k])
                side = 1.0
                if kinds[k] != VERTEX_TRIANGLE:
                    side = _own_side(x, near_start, near_items, v, points[k, 1], points[k, 2], r, distances[k], height)
                best = max(best, side * full)
        beside = last > first and signs[offset + last - 1] == 0
        last -= beside
        # Of the vertex and the owner of the other side: the same for all.
        key = np.int64(v) * len(x) + owner[points[first, 1]]
        face, of_plane = known_weight(known, key), known_row(known, beyond(key, len(x)))
        outside = known.weights[of_plane] if of_plane >= 0 else -1.0
        for k in range(first, last):
            keys[k], planes[k], grown[k] = key, -1, -1.0
        if not beside:
            # Where the vertex comes over the face, both of its weights are those of the face.
            before = max(face, 0.0) + max(outside, 0.0) if face >= 0.0 or outside >= 0.0 else -1.0
            if has_grown(before, best, full):
                grown[first] = best
            elif outside > 0.0:
                grown[first] = before
            for k in range(first, last):
                weights[k] = signs[offset + k] * (best if before < 0.0 else before)
            continue
        keys[last], planes[last], grown[last] = beyond(key, len(x)), codes[offset + last], -1.0
        side = math.sqrt(max(0.0, nearest**2 - distances[last] ** 2))
        share = shares[g] * (1.0 - share_between(side / dhat, _FULL, _NONE))
        other = of_plane >= 0 and known.triangles[of_plane] != planes[last]
        if face >= 0.0 and (other or outside <= 0.0):
            # The vertex was over the face, or beside another one: its weight stays as a whole.
            on_outline, weights[last] = (1.0 - share) * face, share * face
            if share > 0.0 or outside > 0.0:
                grown[first], grown[last] = on_outline, weights[last]
        else:
            now = (1.0 - share) * best
            on_outline = now if face < 0.0 else face
            if has_grown(face, now, full):
                grown[first] = now
            now = min(share * full, max(0.0, full - on_outline))
            weights[last] = now if outside < 0.0 else outside
            if has_grown(outside, now, full):
                grown[last] = now
        for k in range(first, last):
            weights[k] = signs[offset + k] * on_outline


@njit
def _write_contact(x, v, code, plane, triangles, edges, offsets, out, k):
    """Contact k but its weight: of vertex v with the feature that a code names, or with its plane."""
    p, zero = row(x, v), (0.0, 0.0, 0.0)
    if code < len(triangles):
        i, j, m = triangles[code, 0], triangles[code, 1], triangles[code, 2]
        a, b, c = row(x, i), row(x, j), row(x, m)
        u = foot_on_plane(p, a, b, c) if plane else closest_on_triangle(p, a, b, c)
        shares = (-u[0], -u[1], -u[2])
        # Differences of points are as small as triangles.
        r = combine(shares, subtract(a, p), subtract(b, p), subtract(c, p))
        put(out, k, VERTEX_TRIANGLE, (v, i, j, m), (1.0, shares[0], shares[1], shares[2]), r, offsets[v] + offsets[i])
    elif code < len(triangles) + len(edges):
        i, j = edges[code - len(triangles), 0], edges[code - len(triangles), 1]
        a, b = row(x, i), row(x, j)
        w, _ = nearest_of_edge(p, a, b)
        r = combine((w - 1.0, -w, 0.0), subtract(a, p), subtract(b, p), zero)
        put(out, k, VERTEX_EDGE, (v, i, j, -1), (1.0, w - 1.0, -w, 0.0), r, offsets[v] + offsets[i])
    else:
        i = code - len(triangles) - len(edges)
        r = subtract(p, row(x, i))
        put(out, k, VERTEX_VERTEX, (v, i, -1, -1), (1.0, -1.0, 0.0, 0.0), r, offsets[v] + offsets[i])


@njit
def foot_on_plane(p, a, b, c):
    """Barycentric coordinates of the point of a triangle's plane that is closest to p."""
    g, h, r = subtract(b, a), subtract(c, a), subtract(p, a)
    n = cross(g, h)
    nn = dot(n, n)
    u, v = dot(cross(r, h), n) / nn, dot(cross(g, r), n) / nn
    return 1.0 - u - v, u, v


@njit
def _own_side(x, near_start, near_items, v, a, b, r, d, height):
    """1 where no neighbor of vertex v is nearer to what lies at -r, 0 where one is nearer by `height`.

    The points a and b that lie there do not count: in a crease, they may be neighbors.
    """
    nearer = 0.0
    for k in range(near_start[v], near_start[v + 1]):
        if near_items[k] != a and near_items[k] != b:
            nearer = min(nearer, dot(r, subtract(row(x, near_items[k]), row(x, v))) / d)
    return max(0.0, 1.0 + nearer / height)
