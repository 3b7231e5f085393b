"""Parts of surfaces that touch: pairs of a point and a triangle, or of two edges, nearer than a distance."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.contact.mesh.distances import edges_nearer, points_nearer
from supple.numerics.geometry.box_tree import BoxTree, overlapping


def boxes_of(x: NDArray[np.float64], simplices: NDArray[np.int32], margin: float) -> NDArray[np.float64]:
    """(m, 6) lowest and highest corner of simplices (m, k) of points (s, 3), enlarged by a margin [m]."""
    corners = x[simplices]
    return np.concatenate([corners.min(axis=1) - margin, corners.max(axis=1) + margin], axis=1)


def touching_pairs(
    x: NDArray[np.float64],
    triangles: NDArray[np.int32],
    edges: NDArray[np.int32],
    owner: NDArray[np.int32],
    owners: NDArray[np.bool_],
    reach: float,
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Pairs (k, 2) of points with triangles, and of edges with higher edges, that are nearer than `reach` [m].

    Pairs with a common point are left out.

    Parameters
    ----------
    x : (s, 3) [m]; owner : (s,) which thing each point belongs to; owners : (p, p) the pairs of things that count
    """
    every = np.arange(len(x), dtype=np.int32)[:, None]
    points = _pairs(boxes_of(x, every, 0.0), boxes_of(x, triangles, reach))
    corners = triangles[points[:, 1]]
    kept = owners[owner[points[:, 0]], owner[corners[:, 0]]] & (corners != points[:, :1]).all(axis=1)
    points = points[kept]
    points = points[points_nearer(x, triangles, points, reach)]
    sides = _pairs(boxes_of(x, edges, 0.0), boxes_of(x, edges, reach))
    sides = sides[sides[:, 0] < sides[:, 1]]
    one, other = edges[sides[:, 0]], edges[sides[:, 1]]
    kept = owners[owner[one[:, 0]], owner[other[:, 0]]] & (one[:, :, None] != other[:, None]).all(axis=(1, 2))
    sides = sides[kept]
    return points, sides[edges_nearer(x, edges, sides, reach)]


def _pairs(first: NDArray[np.float64], second: NDArray[np.float64]) -> NDArray[np.int32]:
    """Rows (k, 2) of boxes (m, 6) and boxes (n, 6) that overlap, in ascending order of the first."""
    start, found = overlapping(BoxTree.over(second), first)
    return np.column_stack([np.repeat(np.arange(len(first), dtype=np.int32), np.diff(start)), found])
