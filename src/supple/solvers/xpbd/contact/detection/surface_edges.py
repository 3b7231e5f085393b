"""The edges of surfaces, with the triangles beside them.

Flat and reentrant ones of soft bodies belong to them: where bodies are dented, such an edge becomes a ridge, on which
an edge of another body rests while all vertices keep their gap from all faces. On rigid bodies and obstacles, they stay
what they are: before another edge could pass through one of them it would pass through a ridge. Neither do their points
need to be kept from triangles at which no ridge ends: where they push, they push aside, as if the face were not flat.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.contact.search.surfaces import ContactSurfaces

# The sine of the angle between an edge's triangles below which they are in one plane.
FLAT = 1e-6


@dataclass(frozen=True, eq=False)
class SurfaceEdges:
    """Edges, those of bodies first, and their neighbourhood.

    Attributes
    ----------
    ends : (e, 2) points; opposite : (e, 2) the third corners of the two triangles, -1 where there is none
    triangles : (e, 2) the triangles themselves, -1 where there is none
    blunt : (n,) the points of rigid pieces at which no ridge ends
    """

    ends: NDArray[np.int32]
    opposite: NDArray[np.int32]
    triangles: NDArray[np.int32]
    blunt: NDArray[np.bool_]


def surface_edges(surfaces: ContactSurfaces, rest: NDArray[np.float64]) -> SurfaceEdges:
    """The edges of all pieces that may touch something, with one or two triangles; of rigid pieces only ridges.

    `rest` : (n, 3) points at rest [m]
    """
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
    may_touch = np.any(surfaces.allowed | surfaces.allowed.T, axis=1)
    piece = pieces[beside[:, 0]]
    kept = may_touch[piece] & (counts <= 2)
    rigid = np.ones(len(surfaces.closed), dtype=np.bool_)
    rigid[surfaces.point_piece[: len(surfaces.rows)][surfaces.embedded.single >= 0]] = False
    dull = rigid[piece] & (counts <= 2)
    dull &= ~_are_ridges(rest, triangles, ends, opposite, beside, surfaces.closed[piece])
    blunt = np.zeros(len(rest), dtype=np.bool_)
    blunt[ends[dull]] = True
    blunt[ends[~dull]] = False
    kept &= ~dull
    return SurfaceEdges(
        ends=ends[kept].astype(np.int32),
        opposite=opposite[kept],
        triangles=beside[kept],
        blunt=blunt,
    )


def _are_ridges(
    rest: NDArray[np.float64],
    triangles: NDArray[np.int32],
    ends: NDArray[np.int32],
    opposite: NDArray[np.int32],
    beside: NDArray[np.int32],
    closed: NDArray[np.bool_],
) -> NDArray[np.bool_]:
    """(e,) which edges of closed surfaces are convex; of open ones, those that are not flat, and the border."""
    a, b, c = rest[triangles[beside[:, 0]]].transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    aside = rest[opposite[:, 1]] - rest[ends[:, 0]]
    height = np.einsum("ej,ej->e", aside, normals)
    scale = FLAT * np.linalg.norm(aside, axis=1) * np.linalg.norm(normals, axis=1)
    return (opposite[:, 1] < 0) | (np.where(closed, -height, np.abs(height)) > scale)
