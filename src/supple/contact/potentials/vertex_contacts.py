"""Contacts of vertices with the triangles, edges and vertices around them.

The energy of a vertex in front of a surface is that of its distances from the triangles, minus that of its distances
from the edges between them, plus that of its distances from the vertices between those: all terms cancel but one where
the surface is flat or convex, whatever its triangles. In a valley both sides count. The gradient is continuous.

A vertex stands for half of its area: the vertices of the other surface stand for the other half, so that faces that lie
on each other press on each other with the pressure of the barrier, whatever their meshes.

A vertex that hangs over an edge or a corner, while its own surface comes nearer to that beside it, gets less weight,
down to none: what is in contact there are vertices of the other surface with the faces of this one, or two edges.

Where a vertex is beside the outline of a face and its own surface lies flat on that face, its distance is that from the
plane of the face: faces whose outlines are nearly aligned are held at all of their vertices, and nothing pushes along
them. Its weight fades with the distance from the outline.

Source of the alternating sum: Li et al., "Convergent Incremental Potential Contact" (2023), section 4.
"""

import math

import numpy as np

from supple.contact.closest.pair_geometry import VERTEX_EDGE, VERTEX_TRIANGLE, VERTEX_VERTEX
from supple.contact.potentials.known_weights import has_grown, known_row, known_weight
from supple.numerics.geometry.closest_point import closest_on_triangle
from supple.numerics.kernel_cache import njit, prange
from supple.numerics.mat3 import cross, dot, row, subtract

# A vertex counts in full while none of its neighbors is nearer, and not at all where one is, by this share of dhat.
NEARER_SHARE = 0.25

# A vertex that hangs beyond the outline of a face counts with its plane: in full up to the first of these shares of
# dhat, not at all from the second on.
_FULL, _NONE = 0.25, 0.75

# So much farther than dhat are vertices that hang beyond an outline.
REACH = math.sqrt(1.0 + _NONE**2)

# Cosines of the angle between two faces that lie on each other, from none of the weight to all of it.
_LEANING, _FLAT = 0.9, 0.98

# An edge or a vertex is part of an outline where one of its faces leans by more than this cosine.
_SHARP = 0.8

# Most parts of one triangle: itself, its edges, its corners.
_PARTS = 7


@njit(cache=True, parallel=True, error_model="numpy")
def near_features(x, pairs, triangles, triangle_edges, edge_count, reach):
    """The parts of triangles that are closest to vertices.

    Parameters
    ----------
    x : (s, 3) [m]; pairs : (k, 2) of vertices and triangles

    Returns
    -------
    features : (k,) number of the triangle, f + number of the edge or f + e + number of the vertex; -1 where the
        triangle is not nearer than `reach` [m]
    squares : (k,) squared distances [m^2], infinite where not below `reach`
    """
    features = np.full(len(pairs), -1, dtype=np.int32)
    squares = np.full(len(pairs), np.inf)
    for k in prange(len(pairs)):
        p, t = row(x, pairs[k, 0]), pairs[k, 1]
        a, b, c = row(x, triangles[t, 0]), row(x, triangles[t, 1]), row(x, triangles[t, 2])
        u = closest_on_triangle(p, a, b, c)
        f, g, h = subtract(p, a), subtract(b, a), subtract(c, a)
        square = 0.0
        for j in range(3):
            # Differences of points are as small as triangles.
            square += (f[j] - u[1] * g[j] - u[2] * h[j]) ** 2
        if not square < reach * reach:
            continue
        squares[k] = square
        inside = (u[0] > 0.0) + (u[1] > 0.0) + (u[2] > 0.0)
        if inside == 3:
            features[k] = t
        elif inside == 2:
            features[k] = len(triangles) + triangle_edges[t, 1 if u[0] <= 0.0 else (2 if u[1] <= 0.0 else 0)]
        else:
            features[k] = len(triangles) + edge_count + triangles[t, 0 if u[0] > 0.0 else (1 if u[1] > 0.0 else 2)]
    return features, squares


@njit(cache=True, error_model="numpy")
def grouped_by_vertex(pairs, features, s):
    """The rows (m,) of the pairs that have a feature, by vertex, and where each vertex begins (groups + 1,)."""
    count = np.zeros(s, dtype=np.int32)
    order = np.empty(s, dtype=np.int32)
    groups = total = 0
    for k in range(len(pairs)):
        if features[k] >= 0:
            if count[pairs[k, 0]] == 0:
                order[groups] = pairs[k, 0]
                groups += 1
            count[pairs[k, 0]] += 1
            total += 1
    start = np.empty(groups + 1, dtype=np.int32)
    start[0] = 0
    for g in range(groups):
        start[g + 1] = start[g] + count[order[g]]
        count[order[g]] = start[g]
    rows = np.empty(total, dtype=np.int32)
    for k in range(len(pairs)):
        if features[k] >= 0:
            rows[count[pairs[k, 0]]] = k
            count[pairs[k, 0]] += 1
    return rows, start


@njit(cache=True, parallel=True, error_model="numpy")
def alternating_sums(x, pairs, features, squares, rows, start, mesh, known, reach):
    """The features that are left of each vertex's alternating sum, and how often each counts.

    Where only edges and vertices of an outline are left, the nearest one remains and a triangle at it follows, with the
    number 0, if one of the vertex's own lies flat on it: its plane may count instead. A known one stays.

    Parameters
    ----------
    mesh : triangles, edges, triangle_edges, start and items of vertex_triangles, owner (see `ContactMesh`)
    known : a `KnownWeights`

    Returns
    -------
    codes, signs : (7 m,), those of a group from 7 * start on; counts : (groups,) how many there are
    """
    codes = np.empty(_PARTS * len(rows), dtype=np.int32)
    signs = np.empty(_PARTS * len(rows), dtype=np.int32)
    counts = np.empty(len(start) - 1, dtype=np.int32)
    triangles, edges, triangle_edges, own_start, own_items, owner = mesh
    for g in prange(len(start) - 1):
        begin, end = start[g], start[g + 1]
        first = _PARTS * begin
        counts[g] = _alternating_sum(
            x, pairs, features, rows, begin, end, triangles, edges, triangle_edges, reach, codes, signs
        )
        on_outlines = counts[g] > 0
        for k in range(first, first + counts[g]):
            on_outlines = on_outlines and codes[k] >= len(triangles)
        other = owner[triangles[pairs[rows[begin], 1], 0]]
        for k in range(begin, end):
            on_outlines = on_outlines and owner[triangles[pairs[rows[k], 1], 0]] == other
        if not on_outlines:
            continue
        # Along an outline that is nearly straight, the nearest feature stands for all.
        nearest = begin
        for k in range(begin, end):
            if squares[rows[k]] < squares[rows[nearest]]:
                nearest = k
        v = pairs[rows[begin], 0]
        kept = known_row(known, _beyond(np.int64(v) * len(x) + other, len(x)))
        least, facing = _SHARP, -1
        if kept >= 0:
            least, facing = -1.0, known.triangles[kept]
        else:
            for k in range(begin, end):
                if features[rows[k]] == features[rows[nearest]]:
                    t = pairs[rows[k], 1]
                    cosine = _facing(x, v, triangles, t, own_start, own_items)
                    least = min(least, cosine)
                    if cosine > _LEANING and facing < 0:  # triangles of one face are nearly in one plane
                        facing = t
        if facing >= 0 and least < _SHARP:
            codes[first], signs[first] = features[rows[nearest]], 1
            codes[first + 1], signs[first + 1] = facing, 0
            counts[g] = 2
    return codes, signs, counts


@njit(error_model="numpy")
def _normal(x, triangles, t):
    """Unit normal of a triangle; zero without area."""
    a = row(x, triangles[t, 0])
    n = cross(subtract(row(x, triangles[t, 1]), a), subtract(row(x, triangles[t, 2]), a))
    length = math.sqrt(dot(n, n))
    if length == 0.0:
        return (0.0, 0.0, 0.0)
    return (n[0] / length, n[1] / length, n[2] / length)


@njit(error_model="numpy")
def _facing(x, v, triangles, t, own_start, own_items):
    """The largest cosine of the angle at which triangle t and one of vertex v's own look at each other.

    The sides that look are those of the normals, also of a sheet, which has no inside.
    """
    n, best = _normal(x, triangles, t), 0.0
    for k in range(own_start[v], own_start[v + 1]):
        best = max(best, -dot(n, _normal(x, triangles, own_items[k])))
    return best


@njit(error_model="numpy")
def _alternating_sum(x, pairs, features, rows, begin, end, triangles, edges, triangle_edges, reach, codes, signs):
    first, n = _PARTS * begin, 0
    p = row(x, pairs[rows[begin], 0])
    for k in range(begin, end):
        n = _add(codes, signs, first, n, features[rows[k]], 1)
    if end - begin > 1:
        for k in range(begin, end):
            t = pairs[rows[k], 1]
            for i in range(3):
                e, q = triangle_edges[t, i], triangles[t, i]
                shared = _sharing_edge(pairs, rows, k, begin, end, triangle_edges, e)
                if shared > 1:
                    feature, square = _closest_on_edge(x, p, edges, e, len(triangles))
                    if square < reach * reach:
                        n = _add(codes, signs, first, n, feature, 1 - shared)
                around, sides = _sharing_vertex(pairs, rows, k, begin, end, triangles, triangle_edges, edges, q)
                away = subtract(p, row(x, q))
                # The triangles and edges of a closed fan cancel, those of an open one leave one.
                if around > 1 and around >= sides and dot(away, away) < reach * reach:
                    n = _add(codes, signs, first, n, len(triangles) + len(edges) + q, 1 + around - sides)
    left = 0
    for i in range(first, first + n):
        if signs[i] != 0:
            codes[first + left], signs[first + left] = codes[i], signs[i]
            left += 1
    return left


@njit(error_model="numpy")
def _add(codes, signs, first, n, code, sign):
    """Count a code once more; returns how many codes there are."""
    for i in range(first, first + n):
        if codes[i] == code:
            signs[i] += sign
            return n
    codes[first + n], signs[first + n] = code, sign
    return n + 1


@njit(error_model="numpy")
def _sharing_edge(pairs, rows, k, begin, end, triangle_edges, e):
    """How many triangles of a group have edge e; 0 where one before the k-th has it."""
    count = 0
    for other in range(begin, end):
        t = pairs[rows[other], 1]
        if triangle_edges[t, 0] == e or triangle_edges[t, 1] == e or triangle_edges[t, 2] == e:
            if other < k:
                return 0
            count += 1
    return count


@njit(error_model="numpy")
def _sharing_vertex(pairs, rows, k, begin, end, triangles, triangle_edges, edges, q):
    """How many triangles of a group have vertex q, and how many different edges at q they have; 0 as above."""
    around = sides = 0
    for other in range(begin, end):
        t = pairs[rows[other], 1]
        if triangles[t, 0] == q or triangles[t, 1] == q or triangles[t, 2] == q:
            if other < k:
                return 0, 0
            around += 1
            for i in range(3):
                e = triangle_edges[t, i]
                if (edges[e, 0] == q or edges[e, 1] == q) and _sharing_edge(
                    pairs, rows, other, begin, end, triangle_edges, e
                ):
                    sides += 1
    return around, sides


@njit(error_model="numpy")
def _closest_on_edge(x, p, edges, e, triangle_count):
    """The feature of an edge that is closest to p, and the squared distance [m^2]."""
    a, b = row(x, edges[e, 0]), row(x, edges[e, 1])
    w, r = nearest_of_edge(p, a, b)
    if w <= 0.0:
        return triangle_count + len(edges) + edges[e, 0], dot(r, r)
    if w >= 1.0:
        return triangle_count + len(edges) + edges[e, 1], dot(r, r)
    return triangle_count + e, dot(r, r)


@njit(error_model="numpy")
def nearest_of_edge(p, a, b):
    """w in [0, 1], and the vector to p from the closest point (1 - w) a + w b."""
    along, r = subtract(b, a), subtract(p, a)
    length = dot(along, along)
    w = min(1.0, max(0.0, dot(r, along) / length)) if length > 0.0 else 0.0
    if w == 1.0:
        return w, subtract(p, b)
    return w, (r[0] - w * along[0], r[1] - w * along[1], r[2] - w * along[2])


@njit(cache=True, parallel=True, error_model="numpy")
def write_vertex_contacts(
    x, pairs, rows, starts, codes, signs, mesh, owner, areas, saddles, dhat, known, out, keys, planes, grown
):
    """Write the contacts of `alternating_sums` into the first rows of `out`, a `Contacts`.

    Parameters
    ----------
    starts : (groups + 1, 2) where each group begins in `rows` and in `out`
    mesh : triangles, edges, start and items of neighbors and of vertex_triangles (see `ContactMesh`)
    saddles : (s,) least weights of vertices that `saddle_weights` asks for [m^2]
    known : the weights that do not depend on x, a `KnownWeights`
    keys : (m,) a code of each contact's vertex and the owner of the other side, for `KnownWeights`
    planes : (m,) triangles whose planes count, -1 for other contacts
    grown : (m,) weights of the vertices that are to be known [m^2], -1 where they do not change
    """
    triangles, edges, near_start, near_items, own_start, own_items = mesh
    kinds, points, coefficients, vectors, distances, weights = out
    height = NEARER_SHARE * dhat
    for g in prange(len(starts) - 1):
        v = pairs[rows[starts[g, 0]], 0]
        first, last = starts[g, 1], starts[g + 1, 1]
        offset = _PARTS * starts[g, 0] - first
        full = 0.5 * areas[v]
        for k in range(first, last):
            sign = signs[offset + k]
            _write_contact(x, v, codes[offset + k], sign == 0, triangles, edges, kinds, points, coefficients, k)
            for j in range(3):
                vectors[k, j] = 0.0
                for i in range(1, 4):
                    # Differences of points are as small as triangles.
                    vectors[k, j] += coefficients[k, i] * (x[points[k, i], j] - x[v, j])
            r = row(vectors, k)
            distances[k] = math.sqrt(dot(r, r))
            keys[k] = np.int64(v) * len(x) + owner[points[k, 1]]
            weights[k] = 0.0
            if sign > 0:
                weights[k] = full
                if kinds[k] != VERTEX_TRIANGLE:
                    weights[k] *= _own_side(
                        x, near_start, near_items, v, points[k, 1], points[k, 2], r, distances[k], height
                    )
        beside = last == first + 2 and signs[offset + first + 1] == 0
        last -= beside
        share = 0.0
        if beside:
            facing = _facing(x, v, triangles, codes[offset + last], own_start, own_items)
            side = math.sqrt(max(0.0, distances[first] ** 2 - distances[last] ** 2))
            share = _between(facing, _LEANING, _FLAT) * (1.0 - _between(side / dhat, _FULL, _NONE))
        for k in range(first, last):
            best = saddles[v]
            for other in range(first, last):
                if keys[other] == keys[k]:
                    best = max(best, weights[other])
            grown[k] = (1.0 - share) * best
        for k in range(first, last):
            before = known_weight(known, keys[k])
            planes[k] = -1
            # Where the vertex comes over the face, both of its weights are those of the face.
            beyond = 0.0
            if not beside:
                beyond = max(0.0, known_weight(known, _beyond(keys[k], len(x))))
                before = max(before, 0.0) + beyond if before >= 0.0 or beyond > 0.0 else -1.0
            now = grown[k]
            grown[k] = now - beyond if has_grown(before, now, full) else -1.0
            weights[k] = signs[offset + k] * (now if before < 0.0 else before)
        if beside:
            keys[last], planes[last] = _beyond(keys[last], len(x)), codes[offset + last]
            before = known_weight(known, keys[last])
            if before < 0.0 <= known_weight(known, keys[first]):
                # The vertex was over the face: its weight stays as a whole.
                now = share * weights[first]
                grown[first] = weights[first] = weights[first] - now
            else:
                now = min(share * full, max(0.0, full - weights[first]))
            grown[last] = now if has_grown(before, now, full) else -1.0
            weights[last] = now if before < 0.0 else before


@njit(error_model="numpy")
def _between(x, low, high):
    """0 up to `low`, 1 from `high` on, linear between them."""
    return min(1.0, max(0.0, (x - low) / (high - low)))


@njit(error_model="numpy")
def _beyond(key, s):
    """The code of a vertex that hangs beyond an outline; `key` is that of the vertex and the other side's owner."""
    return key + np.int64(s) * s


@njit(error_model="numpy")
def _write_contact(x, v, code, plane, triangles, edges, kinds, points, coefficients, k):
    """Kind, points and coefficients of contact k: of vertex v with the feature that a code names, or with its plane."""
    p = row(x, v)
    points[k, 0], coefficients[k, 0] = v, 1.0
    for i in range(1, 4):
        points[k, i], coefficients[k, i] = -1, 0.0
    if code < len(triangles):
        kinds[k] = VERTEX_TRIANGLE
        t = code
        a, b, c = row(x, triangles[t, 0]), row(x, triangles[t, 1]), row(x, triangles[t, 2])
        u = _foot(p, a, b, c) if plane else closest_on_triangle(p, a, b, c)
        for i in range(3):
            points[k, i + 1], coefficients[k, i + 1] = triangles[t, i], -u[i]
    elif code < len(triangles) + len(edges):
        kinds[k] = VERTEX_EDGE
        e = code - len(triangles)
        points[k, 1], points[k, 2] = edges[e, 0], edges[e, 1]
        w, _ = nearest_of_edge(p, row(x, points[k, 1]), row(x, points[k, 2]))
        coefficients[k, 1], coefficients[k, 2] = w - 1.0, -w
    else:
        kinds[k] = VERTEX_VERTEX
        points[k, 1], coefficients[k, 1] = code - len(triangles) - len(edges), -1.0


@njit(error_model="numpy")
def _foot(p, a, b, c):
    """Barycentric coordinates of the point of a triangle's plane that is closest to p."""
    g, h, r = subtract(b, a), subtract(c, a), subtract(p, a)
    n = cross(g, h)
    nn = dot(n, n)
    u, v = dot(cross(r, h), n) / nn, dot(cross(g, r), n) / nn
    return 1.0 - u - v, u, v


@njit(error_model="numpy")
def _own_side(x, near_start, near_items, v, a, b, r, d, height):
    """1 where no neighbor of vertex v is nearer to what lies at -r, 0 where one is nearer by `height`.

    The points a and b that lie there do not count: in a crease, they may be neighbors.
    """
    nearer = 0.0
    for k in range(near_start[v], near_start[v + 1]):
        if near_items[k] != a and near_items[k] != b:
            nearer = min(nearer, dot(r, subtract(row(x, near_items[k]), row(x, v))) / d)
    return max(0.0, 1.0 + nearer / height)
