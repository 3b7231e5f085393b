"""The edges of surfaces, with the triangles beside them.

Flat and reentrant ones belong to them: where bodies are dented, such an edge becomes a ridge, on which an edge of
another body rests while all vertices keep their gap from all faces.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.contact.search.surfaces import ContactSurfaces


@dataclass(frozen=True, eq=False)
class SurfaceEdges:
    """Edges, those of bodies first, and their neighbourhood.

    Attributes
    ----------
    ends : (e, 2) points; opposite : (e, 2) the third corners of the two triangles, -1 where there is none
    triangles : (e, 2) the triangles themselves, -1 where there is none
    """

    ends: NDArray[np.int32]
    opposite: NDArray[np.int32]
    triangles: NDArray[np.int32]


def surface_edges(surfaces: ContactSurfaces) -> SurfaceEdges:
    """The edges of all pieces that may touch something, with one or two triangles."""
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
    return SurfaceEdges(
        ends=ends[kept].astype(np.int32),
        opposite=opposite[kept],
        triangles=beside[kept],
    )
