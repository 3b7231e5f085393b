"""Contacts of edges that cross each other, where at least one of them protrudes from its surface.

Both closest points lie inside the edges: their ends are vertices, which have contacts of their own. Where two flat
faces lie on each other, no edge protrudes, and none counts. The ridge of a knife has a contact with every edge that it
crosses; so have two ridges that cross.
"""

import math

import numpy as np

from supple.contact.closest.pair_geometry import EDGE_EDGE
from supple.contact.potentials.vertex_contacts import NEARER_SHARE, inward
from supple.numerics.kernel_cache import njit, prange
from supple.numerics.mat3 import cross, dot, row, subtract

# Squared sine of the angle between two edges from which they count in full. Parallel edges do not count: their ends do.
_CROSSING = 1e-3

# Of the sum of the areas of two edges. In a regular mesh, two edges then stand for as much as a vertex.
_SHARE = 0.75


@njit(cache=True, parallel=True, error_model="numpy")
def edge_weights(x, pairs, mesh, areas, dhat):
    """Areas (l,) [m^2] of the contacts of pairs (l, 2) of edges, zero where there is none, and squared distances.

    Parameters
    ----------
    x : (s, 3) [m]; mesh : triangles, edges, triangle_edges, edge_triangles, neighbors (see `ContactMesh`)
    areas : (e,) a third of each edge's triangles at rest [m^2]

    Returns
    -------
    weights : (l,); squares : (l,) infinite where the edges do not cross, or not below dhat [m^2]
    """
    triangles, edges, _, edge_triangles, _ = mesh
    weights = np.zeros(len(pairs))
    squares = np.full(len(pairs), np.inf)
    for k in prange(len(pairs)):
        e, f = pairs[k, 0], pairs[k, 1]
        a, b, c, d = row(x, edges[e, 0]), row(x, edges[e, 1]), row(x, edges[f, 0]), row(x, edges[f, 1])
        s, t, r, crossing = crossing_point(a, b, c, d)
        square = dot(r, r)
        if not (crossing > 0.0 and 0.0 < s < 1.0 and 0.0 < t < 1.0 and square < dhat * dhat):
            continue
        squares[k] = square
        one = _height(x, triangles, edges, edge_triangles, e, r, -1.0)
        other = _height(x, triangles, edges, edge_triangles, f, r, 1.0)
        h = NEARER_SHARE * dhat
        protruding = min(1.0, max(0.0, max(one, other) / h))
        nearest = min(1.0, max(0.0, 1.0 + min(one, other) / h))
        angle = min(1.0, crossing / _CROSSING)
        weights[k] = _SHARE * (areas[e] + areas[f]) * protruding * nearest * angle * (2.0 - angle)
    return weights, squares


@njit(error_model="numpy")
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


@njit(error_model="numpy")
def _height(x, triangles, edges, edge_triangles, e, r, sign):
    """How far the surface recedes beside edge e, against the direction sign * r, over the edge's length [m].

    Negative where it comes nearer.
    """
    start, items = edge_triangles
    length = math.sqrt(dot(r, r))
    least = np.inf
    for k in range(start[e], start[e + 1]):
        least = min(least, -sign * dot(r, inward(x, triangles, items[k], edges[e, 0], edges[e, 1])) / length)
    along = subtract(row(x, edges[e, 1]), row(x, edges[e, 0]))
    return least * math.sqrt(dot(along, along))


@njit(cache=True, error_model="numpy")
def write_edge_contacts(x, pairs, weights, edges, first, out):
    """Write the contacts with a weight into the rows of `out`, a `Contacts`, from row `first` on."""
    kinds, points, coefficients, vectors, distances, areas = out
    n = first
    for k in range(len(pairs)):
        if weights[k] == 0.0:
            continue
        e, f = pairs[k, 0], pairs[k, 1]
        points[n, 0], points[n, 1], points[n, 2], points[n, 3] = edges[e, 0], edges[e, 1], edges[f, 0], edges[f, 1]
        s, t, r, _ = crossing_point(
            row(x, points[n, 0]), row(x, points[n, 1]), row(x, points[n, 2]), row(x, points[n, 3])
        )
        kinds[n] = EDGE_EDGE
        coefficients[n, 0], coefficients[n, 1], coefficients[n, 2], coefficients[n, 3] = 1.0 - s, s, t - 1.0, -t
        vectors[n, 0], vectors[n, 1], vectors[n, 2] = r
        distances[n] = math.sqrt(dot(r, r))
        areas[n] = weights[k]
        n += 1
