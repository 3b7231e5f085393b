"""Contacts of vertices: each local minimum of a vertex's distance from the surfaces around it counts once.

A vertex stands for half of its area: the vertices of the other surface stand for the other half, so that faces that lie
on each other press on each other with the pressure of the barrier, whatever their meshes.

A closest point inside a triangle is a minimum. On an edge it is one if no triangle of the edge leads nearer, at a corner
if no edge of the corner does. A vertex that hangs over such an edge or corner while its own surface comes nearer
elsewhere gets less weight, down to none: what is nearer there are parts of the other surface in front of its faces, or
two edges.

Minima in nearly the same direction are one contact, which they share: a vertex in a flat valley has several.
"""

import math

import numpy as np

from supple.contact.closest.pair_geometry import VERTEX_EDGE, VERTEX_TRIANGLE, VERTEX_VERTEX
from supple.numerics.geometry.closest_point import closest_on_triangle
from supple.numerics.kernel_cache import njit, prange
from supple.numerics.mat3 import cross, dot, row, subtract

# Sines of angles that count as round-off.
_ROUND_OFF = 1e-6

# A vertex counts in full while none of its neighbors is nearer, and not at all where one is nearer by this share of dhat.
NEARER_SHARE = 0.25

# Minima whose directions differ by less than some 26 degrees are one contact; beyond 60 degrees they are two.
_SAME, _DIFFERENT = 0.9, 0.5


@njit(cache=True, parallel=True, error_model="numpy")
def vertex_minima(x, pairs, mesh, dhat):
    """Where the distance of vertices from triangles has a local minimum over the surface, below dhat.

    Parameters
    ----------
    x : (s, 3) [m]; pairs : (k, 2) of vertices and triangles
    mesh : triangles, edges, triangle_edges, edge_triangles, neighbors (see `ContactMesh`)

    Returns
    -------
    codes : (k,) number of the triangle, f + number of the edge or f + e + number of the vertex on which it is; -1 where
        there is none
    squares : (k,) squared distance of the pair [m^2], infinite where not below dhat
    """
    triangles, edges, triangle_edges, edge_triangles, neighbors = mesh
    codes = np.full(len(pairs), -1, dtype=np.int32)
    squares = np.full(len(pairs), np.inf)
    for k in prange(len(pairs)):
        t = pairs[k, 1]
        p = row(x, pairs[k, 0])
        ids = (triangles[t, 0], triangles[t, 1], triangles[t, 2])
        a, b, c = row(x, ids[0]), row(x, ids[1]), row(x, ids[2])
        u = closest_on_triangle(p, a, b, c)
        r = _difference(p, a, b, c, u)
        square = dot(r, r)
        if not square < dhat * dhat:
            continue
        squares[k] = square
        inside = (u[0] > 0.0) + (u[1] > 0.0) + (u[2] > 0.0)
        if inside == 3:
            codes[k] = t
        elif inside == 2:
            i = 1 if u[0] == 0.0 else (2 if u[1] == 0.0 else 0)
            e = triangle_edges[t, i]
            if _is_minimum_on_edge(x, triangles, edges, edge_triangles, e, r, square):
                codes[k] = len(triangles) + e
        else:
            q = ids[0] if u[0] > 0.0 else (ids[1] if u[1] > 0.0 else ids[2])
            if _is_minimum_at_vertex(x, neighbors, q, r, square):
                codes[k] = len(triangles) + len(edges) + q
    return codes, squares


@njit(error_model="numpy")
def _difference(p, a, b, c, u):
    """p minus the point with barycentric coordinates u, from differences of points, which are as small as triangles."""
    f, g, h = subtract(p, a), subtract(b, a), subtract(c, a)
    return (
        f[0] - u[1] * g[0] - u[2] * h[0],
        f[1] - u[1] * g[1] - u[2] * h[1],
        f[2] - u[1] * g[2] - u[2] * h[2],
    )


@njit(error_model="numpy")
def inward(x, triangles, t, a, b):
    """Unit vector in the plane of triangle t from its edge of the points a and b inwards; zero without area."""
    o = triangles[t, 0] + triangles[t, 1] + triangles[t, 2] - a - b
    along, over = subtract(row(x, b), row(x, a)), subtract(row(x, o), row(x, a))
    m = cross(cross(along, over), along)
    length = math.sqrt(dot(m, m))
    if length == 0.0:
        return (0.0, 0.0, 0.0)
    return (m[0] / length, m[1] / length, m[2] / length)


@njit(error_model="numpy")
def _is_minimum_on_edge(x, triangles, edges, edge_triangles, e, r, square):
    start, items = edge_triangles
    limit = _ROUND_OFF * math.sqrt(square)
    for k in range(start[e], start[e + 1]):
        if dot(r, inward(x, triangles, items[k], edges[e, 0], edges[e, 1])) > limit:
            return False
    return True


@njit(error_model="numpy")
def _is_minimum_at_vertex(x, neighbors, q, r, square):
    start, items = neighbors
    for k in range(start[q], start[q + 1]):
        way = subtract(row(x, items[k]), row(x, q))
        if dot(r, way) > _ROUND_OFF * math.sqrt(square * dot(way, way)):
            return False
    return True


@njit(cache=True, error_model="numpy")
def grouped_minima(pairs, codes, s):
    """The rows of the pairs that have a minimum, by vertex, each minimum of a vertex once.

    Returns
    -------
    rows : (m,) rows of `pairs`, ascending within a vertex
    start : (m + 1,), of which the first (groups + 1) say where each vertex begins; groups : how many vertices there are
    """
    first = np.full(s, -1, dtype=np.int32)
    last = np.empty(s, dtype=np.int32)
    kept = np.empty(len(pairs), dtype=np.int32)
    following = np.empty(len(pairs), dtype=np.int32)
    order = np.empty(len(pairs), dtype=np.int32)
    count = groups = 0
    for k in range(len(pairs)):
        if codes[k] < 0:
            continue
        v = pairs[k, 0]
        if first[v] < 0:
            order[groups] = v
            groups += 1
            first[v] = last[v] = count
        else:
            known = False
            i = first[v]
            while i >= 0:
                known = known or codes[kept[i]] == codes[k]
                i = following[i]
            if known:
                continue
            following[last[v]] = count
            last[v] = count
        kept[count] = k
        following[count] = -1
        count += 1
    rows = np.empty(count, dtype=np.int32)
    start = np.empty(groups + 1, dtype=np.int32)
    n = 0
    for g in range(groups):
        start[g] = n
        i = first[order[g]]
        while i >= 0:
            rows[n] = kept[i]
            n += 1
            i = following[i]
    start[groups] = n
    return rows, start


@njit(cache=True, parallel=True, error_model="numpy")
def write_vertex_contacts(x, pairs, codes, grouped, mesh, areas, dhat, out):
    """Write the contacts of `grouped_minima` into the first rows of `out`, a `Contacts`; weights may be zero."""
    triangles, edges, _, _, neighbors = mesh
    rows, start = grouped
    kinds, points, coefficients, vectors, distances, weights = out
    for g in prange(len(start) - 1):
        v = pairs[rows[start[g]], 0]
        p = row(x, v)
        for k in range(start[g], start[g + 1]):
            t, code = pairs[rows[k], 1], codes[rows[k]]
            points[k, 0], coefficients[k, 0] = v, 1.0
            for i in range(1, 4):
                points[k, i], coefficients[k, i] = -1, 0.0
            if code < len(triangles):
                kinds[k] = VERTEX_TRIANGLE
                a, b, c = row(x, triangles[t, 0]), row(x, triangles[t, 1]), row(x, triangles[t, 2])
                u = closest_on_triangle(p, a, b, c)
                for i in range(3):
                    points[k, i + 1], coefficients[k, i + 1] = triangles[t, i], -u[i]
                r = _difference(p, a, b, c, u)
            elif code < len(triangles) + len(edges):
                kinds[k] = VERTEX_EDGE
                e = code - len(triangles)
                a, along = row(x, edges[e, 0]), subtract(row(x, edges[e, 1]), row(x, edges[e, 0]))
                w = min(1.0, max(0.0, dot(subtract(p, a), along) / dot(along, along)))
                points[k, 1], points[k, 2] = edges[e, 0], edges[e, 1]
                coefficients[k, 1], coefficients[k, 2] = w - 1.0, -w
                r = (p[0] - a[0] - w * along[0], p[1] - a[1] - w * along[1], p[2] - a[2] - w * along[2])
            else:
                kinds[k] = VERTEX_VERTEX
                q = code - len(triangles) - len(edges)
                points[k, 1], coefficients[k, 1] = q, -1.0
                r = subtract(p, row(x, q))
            vectors[k, 0], vectors[k, 1], vectors[k, 2] = r
            distances[k] = math.sqrt(dot(r, r))
        for k in range(start[g], start[g + 1]):
            share = 0.0
            for other in range(start[g], start[g + 1]):
                share += 1.0 if other == k else _sameness(vectors, distances, k, other)
            weights[k] = 0.5 * areas[v] / share
            if kinds[k] != VERTEX_TRIANGLE:
                weights[k] *= _own_side(x, neighbors, v, row(vectors, k), distances[k], NEARER_SHARE * dhat)


@njit(error_model="numpy")
def _sameness(vectors, distances, k, other):
    """1 for two minima in the same direction, 0 for different ones."""
    cosine = dot(row(vectors, k), row(vectors, other)) / (distances[k] * distances[other])
    return min(1.0, max(0.0, (cosine - _DIFFERENT) / (_SAME - _DIFFERENT)))


@njit(error_model="numpy")
def _own_side(x, neighbors, v, r, d, height):
    """1 where no neighbor of vertex v is nearer to what lies at -r, 0 where one is nearer by `height`."""
    start, items = neighbors
    nearer = 0.0
    for k in range(start[v], start[v + 1]):
        nearer = min(nearer, dot(r, subtract(row(x, items[k]), row(x, v))) / d)
    return max(0.0, 1.0 + nearer / height)
