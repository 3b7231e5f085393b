"""The distance that surfaces keep from each other, at each point from the features there: no share of the scene.

It is small against the thickness of the thing below the point, against the edges of its surface, and against the thing,
so that what rests on something touches it for the eye, as thin as either may be. Two sides keep the smaller distance.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from supple.contact.mesh.contact_mesh import ContactMesh
from supple.contact.search.patch_search import pairs_nearer
from supple.numerics.adjacency import no_lists
from supple.numerics.cross_rows import cross_rows
from supple.numerics.geometry.closest_points import closest_on_triangle
from supple.numerics.mat3 import dot, row
from supple.runtime.kernel_cache import njit

# Of the thickness at a point, and of the thing's mean surface edge; of the diagonal of the thing, like `dhat` of the
# implicit solver. The last is far above round-off: of surfaces that lie on themselves.
SHARE, OF_DIAGONAL, LEAST = 0.05, 3e-3, 1e-6
# The cosines of the angles between the normals of two sides of a wall, and between the way through it and the normal.
OPPOSITE, ALONG = -0.5, 0.5


def point_gaps(mesh: ContactMesh, x: NDArray[np.float64]) -> NDArray[np.float64]:
    """(s,) the gaps of the points of surfaces [m], whose places at rest are x (s, 3) [m]."""
    things, of_edge = len(mesh.names), mesh.owner[mesh.edges[:, 0]]
    low, high = np.full((things, 3), np.inf), np.full((things, 3), -np.inf)
    np.minimum.at(low, mesh.owner, x)
    np.maximum.at(high, mesh.owner, x)
    counts = np.bincount(of_edge, minlength=things)
    edges = np.bincount(of_edge, weights=mesh.edge_lengths, minlength=things) / np.maximum(counts, 1)
    diagonals = np.where(counts > 0, np.linalg.norm(np.where(counts[:, None] > 0, high - low, 0.0), axis=1), 1.0)
    reach = np.where(counts > 0, np.minimum(edges, OF_DIAGONAL / SHARE * diagonals), 1.0)
    # Things are scaled so that the same reach holds for all, and stand side by side, so that none is near another.
    scales = reach[mesh.owner]
    widths = np.where(counts > 0, (high - low)[:, 0] / reach + 2.0, 0.0)
    scaled = (x - np.where(counts[:, None] > 0, low, 0.0)[mesh.owner]) / scales[:, None]
    scaled[:, 0] += (np.cumsum(widths) - widths)[mesh.owner]
    own = np.eye(things, dtype=np.bool_)
    parts = mesh.parts._replace(
        collide=own, excluded_triangles=no_lists(len(x)), excluded_edges=no_lists(len(mesh.edges))
    )
    points, _ = pairs_nearer(scaled, parts, mesh.patches, 1.0)
    a, b, c = scaled[mesh.triangles].transpose(1, 0, 2)
    normals = cross_rows(b - a, c - a)
    normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]
    thicknesses = _thicknesses(scaled, points, mesh.triangles, normals, mesh.vertex_triangles)
    return np.maximum(SHARE * scales * thicknesses, LEAST * diagonals[mesh.owner])


@njit(cache=True)
def _thicknesses(x, pairs, triangles, normals, around):
    """(s,) how far it is from each point through the thing to the other side of a wall, one at most.

    pairs : (k, 2) points and triangles that are near each other; normals : (f, 3) of unit length
    around : the triangles at each point
    """
    out = np.ones(len(x))
    for k in range(len(pairs)):
        p, t = pairs[k, 0], pairs[k, 1]
        a, b, c, m = row(x, triangles[t, 0]), row(x, triangles[t, 1]), row(x, triangles[t, 2]), row(normals, t)
        u = closest_on_triangle(row(x, p), a, b, c)
        r = (
            u[0] * a[0] + u[1] * b[0] + u[2] * c[0] - x[p, 0],
            u[0] * a[1] + u[1] * b[1] + u[2] * c[1] - x[p, 1],
            u[0] * a[2] + u[1] * b[2] + u[2] * c[2] - x[p, 2],
        )
        way = math.sqrt(dot(r, r))
        if way >= out[p]:
            continue
        for k in range(around.start[p], around.start[p + 1]):
            n = row(normals, around.items[k])
            if dot(n, m) < OPPOSITE and -dot(n, r) > ALONG * way:
                out[p] = way
                break
    return out
