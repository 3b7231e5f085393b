"""The edges of surfaces that can cross other edges while all vertices keep their gap from all faces.

The faces beside an edge of length L drop by L / 2 tan(angle / 2) where an edge that crosses it has its ends; the angle
between their normals is that at rest. Edges where this is less than the gap are left out: what crosses them keeps a
distance because its vertices do. Reentrant edges are left out too: no edge from outside reaches them first. The borders
of open sheets belong to the sharp edges.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.contact.search.surfaces import ContactSurfaces


@dataclass(frozen=True, eq=False)
class SharpEdges:
    """Edges, those of bodies first, and their neighbourhood.

    Attributes
    ----------
    ends : (e, 2) points; opposite : (e, 2) the third corners of the two triangles, -1 where there is none
    triangles : (e, 2) the triangles themselves, -1 where there is none
    """

    ends: NDArray[np.int32]
    opposite: NDArray[np.int32]
    triangles: NDArray[np.int32]


def sharp_edges(surfaces: ContactSurfaces, rest_positions: NDArray[np.float64]) -> SharpEdges:
    """The sharp edges of all pieces that may touch another piece; `rest_positions` (n, 3) of all points [m]."""
    triangles, pieces = surfaces.triangles, surfaces.triangle_piece
    halves = triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    low_high = np.sort(halves, axis=1)
    ends, edge_of, counts = np.unique(low_high, axis=0, return_inverse=True, return_counts=True)
    edge_of = edge_of.reshape(-1)
    opposite = np.full((len(ends), 2), -1, dtype=np.int32)
    beside = np.full((len(ends), 2), -1, dtype=np.int32)
    order = np.argsort(edge_of, kind="stable")
    starts = np.cumsum(counts) - counts
    third = triangles[:, [2, 0, 1]].ravel()
    for k in range(2):
        has = counts > k
        half = order[starts[has] + k]
        opposite[has, k], beside[has, k] = third[half], half // 3
    meets_others = np.any(surfaces.allowed & ~np.eye(len(surfaces.closed), dtype=np.bool_), axis=1)
    piece = pieces[beside[:, 0]]
    border = np.asarray(counts == 1)
    kept = meets_others[piece] & (
        border | ((counts == 2) & _is_sharp(surfaces, rest_positions, ends, beside, opposite))
    )
    return SharpEdges(
        ends=ends[kept].astype(np.int32),
        opposite=opposite[kept],
        triangles=beside[kept],
    )


def _is_sharp(
    surfaces: ContactSurfaces,
    x: NDArray[np.float64],
    ends: NDArray[np.int32],
    beside: NDArray[np.int32],
    opposite: NDArray[np.int32],
) -> NDArray[np.bool_]:
    """Whether the faces of an edge with two triangles drop by more than the gap of their piece."""
    a, b, c = (x[surfaces.triangles[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    lengths = np.linalg.norm(normals, axis=1)
    normals /= np.maximum(lengths, 1e-300)[:, None]
    first, second = normals[beside[:, 0]], normals[beside[:, 1]]
    half = np.arctan2(np.linalg.norm(first - second, axis=1), np.linalg.norm(first + second, axis=1))
    convex = np.einsum("ej,ej->e", first, x[opposite[:, 1]] - x[ends[:, 0]]) < 0.0
    length = np.linalg.norm(x[ends[:, 1]] - x[ends[:, 0]], axis=1)
    gap = np.where(surfaces.allowed, surfaces.gaps, np.inf).min(axis=1)[surfaces.triangle_piece[beside[:, 0]]]
    with np.errstate(over="ignore"):
        return convex & (0.5 * length * np.tan(half) > gap)
