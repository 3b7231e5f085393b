"""The parts of surfaces that vertices are in front of: triangles, edges and vertices, and how often each counts.

The energy of a vertex in front of a surface is that of its distances from the triangles, minus that of its distances
from the edges between them, plus that of its distances from the vertices between those: all terms cancel but one where
the surface is flat or convex, whatever its triangles. In a valley both sides count. The gradient is continuous.

Where a vertex is beside the outline of a face and its own surface lies flat on that face, its distance may be that from
the plane of the face (see `vertex_contacts`).

Source of the alternating sum: Li et al., "Convergent Incremental Potential Contact" (2023), section 4.
"""

import math

import numpy as np

from supple.contact.features.contacts import known_row
from supple.contact.features.pair_geometry import unit
from supple.numerics.geometry.closest_points import area_normal, closest_on_triangle
from supple.numerics.mat3 import dot, row, subtract
from supple.runtime.kernel_cache import njit, prange

# Cosines of the angle between two faces that lie on each other, from none of the weight to all of it.
_LEANING, _FLAT = 0.9, 0.98

# Cosines of the angle of the most inclined face at an edge or a vertex, from none of the weight to all of it: others
# are not part of an outline.
_BENT, _SHARP = 0.8, 0.6

# Most parts of one triangle: itself, its edges, its corners.
PARTS = 7


@njit(cache=True, parallel=True)
def near_features(x, pairs, triangles, triangle_edges, edge_count, reach, offsets):
    """The parts of triangles that are closest to vertices.

    Parameters
    ----------
    x : (s, 3) [m]; pairs : (k, 2) of vertices and triangles; offsets : (s,), see `ContactMesh` [m]

    Returns
    -------
    features : (k,) number of the triangle, f + number of the edge or f + e + number of the vertex; -1 where the
        gap is not below `reach` [m]
    squares : (k,) squared gaps, below zero where gaps are [m^2]; infinite where not below `reach`
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
        offset = offsets[pairs[k, 0]] + offsets[triangles[t, 0]]
        far = reach + offset
        if not square < far * far:
            continue
        squares[k] = square_of_gap(square, offset)
        inside = (u[0] > 0.0) + (u[1] > 0.0) + (u[2] > 0.0)
        if inside == 3:
            features[k] = t
        elif inside == 2:
            features[k] = len(triangles) + triangle_edges[t, 1 if u[0] <= 0.0 else (2 if u[1] <= 0.0 else 0)]
        else:
            features[k] = len(triangles) + edge_count + triangles[t, 0 if u[0] > 0.0 else (1 if u[1] > 0.0 else 2)]
    return features, squares


@njit
def square_of_gap(square, offset):
    """g |g| of the gap g that a squared distance leaves of an offset."""
    if offset == 0.0:
        return square
    gap = math.sqrt(square) - offset
    return gap * abs(gap)


@njit(cache=True)
def grouped(pairs, features, triangles, owner):
    """The rows (m,) of the pairs that have a feature, by vertex and owner of the triangle.

    Parameters
    ----------
    owner : (s,) of each point

    Returns
    -------
    rows : (m,); start : (groups + 1,) where each vertex with each owner begins
    """
    rows = np.flatnonzero(features >= 0)
    keys = np.empty(len(rows), dtype=np.int64)
    ascending = True  # most often they are
    for i in range(len(rows)):
        keys[i] = np.int64(pairs[rows[i], 0]) * len(owner) + _owner(pairs, rows[i], triangles, owner)
        ascending = ascending and (i == 0 or keys[i - 1] <= keys[i])
    if not ascending:
        order = np.argsort(keys, kind="mergesort")
        rows, keys = rows[order], keys[order]
    start = np.empty(len(rows) + 1, dtype=np.int32)
    groups = 0
    for i in range(len(rows)):
        if i == 0 or keys[i] != keys[i - 1]:
            start[groups] = i
            groups += 1
    start[groups] = len(rows)
    return rows.astype(np.int32), start[: groups + 1]


@njit
def _owner(pairs, k, triangles, owner):
    return owner[triangles[pairs[k, 1], 0]]


@njit(cache=True, parallel=True)
def alternating_sums(x, pairs, features, squares, rows, start, mesh, known, reach):
    """The features that are left of each vertex's alternating sum, and how often each counts.

    Where only edges and vertices of an outline are left, a triangle at the nearest one follows, with the number 0, if
    one of the vertex's own lies flat on it: its plane may count instead. A known one stays.

    Parameters
    ----------
    mesh : triangles, edges, triangle_edges, start and items of vertex_triangles, owner, offsets (see `ContactMesh`)
    known : a `KnownWeights`

    Returns
    -------
    codes, signs : (7 m,), those of a group from 7 * start on; counts : (groups,) how many there are
    shares : (groups,) of the weight of a vertex beside an outline that may count with the plane
    """
    codes = np.empty(PARTS * len(rows), dtype=np.int32)
    signs = np.empty(PARTS * len(rows), dtype=np.int32)
    counts, shares = np.empty(len(start) - 1, dtype=np.int32), np.zeros(len(start) - 1)
    triangles, edges, triangle_edges, own_start, own_items, owner, offsets = mesh
    for g in prange(len(start) - 1):
        begin, end = start[g], start[g + 1]
        first = PARTS * begin
        far = reach + (offsets[pairs[rows[begin], 0]] + offsets[triangles[pairs[rows[begin], 1], 0]])
        counts[g] = _alternating_sum(
            x, pairs, features, rows, begin, end, triangles, edges, triangle_edges, far, codes, signs
        )
        if counts[g] == 0:
            continue
        on_outlines, nearest = True, begin
        for k in range(first, first + counts[g]):
            on_outlines = on_outlines and codes[k] >= len(triangles)
        for k in range(begin, end):
            if squares[rows[k]] < squares[rows[nearest]]:
                nearest = k
        v, other = pairs[rows[begin], 0], _owner(pairs, rows[begin], triangles, owner)
        kept = known_row(known, beyond(np.int64(v) * len(x) + other, len(x)))
        stays = -1
        if kept >= 0 and known.weights[kept] > 0.0:
            for k in range(begin, end):
                if pairs[rows[k], 1] == known.triangles[kept]:
                    stays = known.triangles[kept]
        over = features[rows[nearest]]
        if stays >= 0:
            # It ends where the vertex comes over this face, and not where some other triangle begins to count.
            ends = over < len(triangles) and dot(_normal(x, triangles, over), _normal(x, triangles, stays)) > _FLAT
        else:
            ends = not on_outlines
        if ends:
            continue
        facing, flattest, least = -1, _LEANING, _BENT
        for k in range(begin, end):
            if features[rows[k]] == over:
                t = pairs[rows[k], 1]
                cosine = _facing_cosine(x, v, triangles, t, own_start, own_items)
                least = min(least, cosine)
                if cosine > flattest and facing < 0:  # triangles of one face are nearly in one plane
                    facing, flattest = t, cosine
        if stays >= 0 or (facing >= 0 and least < _BENT):
            codes[first + counts[g]], signs[first + counts[g]] = stays if stays >= 0 else facing, 0
            counts[g] += 1
            shares[g] = share_between(flattest, _LEANING, _FLAT) * (1.0 - share_between(least, _SHARP, _BENT))
    return codes, signs, counts, shares


@njit
def _normal(x, triangles, t):
    """Unit normal of a triangle; zero without area."""
    return unit(area_normal(row(x, triangles[t, 0]), row(x, triangles[t, 1]), row(x, triangles[t, 2])))


@njit
def _facing_cosine(x, v, triangles, t, own_start, own_items):
    """The largest cosine of the angle at which triangle t and one of vertex v's own face each other.

    The sides that face each other are those of the normals, also of a sheet, which has no inside.
    """
    n, best = _normal(x, triangles, t), 0.0
    for k in range(own_start[v], own_start[v + 1]):
        best = max(best, -dot(n, _normal(x, triangles, own_items[k])))
    return best


@njit
def _alternating_sum(x, pairs, features, rows, begin, end, triangles, edges, triangle_edges, reach, codes, signs):
    first, n = PARTS * begin, 0
    p = row(x, pairs[rows[begin], 0])
    for k in range(begin, end):
        n = _add(codes, signs, first, n, features[rows[k]], 1)
    if end - begin > 1:
        for k in range(begin, end):
            t = pairs[rows[k], 1]
            of_rod = triangles[t, 1] == triangles[t, 2]
            for i in range(2 if of_rod else 3):
                e, q = triangle_edges[t, i], triangles[t, i]
                shared = _sharing_edge(pairs, rows, k, begin, end, triangle_edges, e)
                if shared > 1:
                    feature, square = _closest_on_edge(x, p, edges, e, len(triangles))
                    if square < reach * reach:
                        n = _add(codes, signs, first, n, feature, 1 - shared)
                around, sides = _sharing_vertex(pairs, rows, k, begin, end, triangles, triangle_edges, edges, q)
                away = subtract(p, row(x, q))
                # The triangles and edges of a closed fan cancel, those of an open one leave one. Edges of rods have no
                # sides to cancel.
                if around > 1 and (of_rod or around >= sides) and dot(away, away) < reach * reach:
                    times = 1 - around if of_rod else 1 + around - sides
                    n = _add(codes, signs, first, n, len(triangles) + len(edges) + q, times)
    left = 0
    for i in range(first, first + n):
        if signs[i] != 0:
            codes[first + left], signs[first + left] = codes[i], signs[i]
            left += 1
    return left


@njit
def _add(codes, signs, first, n, code, sign):
    """Count a code once more; returns how many codes there are."""
    for i in range(first, first + n):
        if codes[i] == code:
            signs[i] += sign
            return n
    codes[first + n], signs[first + n] = code, sign
    return n + 1


@njit
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


@njit
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


@njit
def _closest_on_edge(x, p, edges, e, triangle_count):
    """The feature of an edge that is closest to p, and the squared distance [m^2]."""
    a, b = row(x, edges[e, 0]), row(x, edges[e, 1])
    w, r = nearest_of_edge(p, a, b)
    if w <= 0.0:
        return triangle_count + len(edges) + edges[e, 0], dot(r, r)
    if w >= 1.0:
        return triangle_count + len(edges) + edges[e, 1], dot(r, r)
    return triangle_count + e, dot(r, r)


@njit
def nearest_of_edge(p, a, b):
    """w in [0, 1], and the vector to p from the closest point (1 - w) a + w b."""
    along, r = subtract(b, a), subtract(p, a)
    length = dot(along, along)
    w = min(1.0, max(0.0, dot(r, along) / length)) if length > 0.0 else 0.0
    if w == 1.0:
        return w, subtract(p, b)
    return w, (r[0] - w * along[0], r[1] - w * along[1], r[2] - w * along[2])


@njit
def beyond(key, s):
    """The code of a vertex that hangs beyond an outline; `key` is that of the vertex and the other side's owner."""
    return key + np.int64(s) * s


@njit
def share_between(x, low, high):
    """0 up to `low`, 1 from `high` on, linear between them."""
    return min(1.0, max(0.0, (x - low) / (high - low)))
