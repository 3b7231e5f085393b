"""Merging vertices at the same place."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.mesh.topology import graph_components


def merge_map(points: NDArray[np.float64], tolerance: float) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Which points to keep, and for each point the row among the kept ones that replaces it.

    Points are joined when they are equal, or within `tolerance` [m] of each other (also over a chain of such
    neighbours). The first of each group keeps its place.
    """
    keep, index = _equal(points)
    if tolerance <= 0.0 or len(keep) < 2:
        return keep, index
    from scipy.spatial import KDTree

    close = KDTree(points[keep]).query_pairs(tolerance, output_type="ndarray")
    if len(close) == 0:
        return keep, index
    first, second_index = _first_of_each(graph_components(len(keep), *close.T))
    return keep[first], second_index[index]


def _equal(points: NDArray[np.float64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    points = points + 0.0  # turns -0 into 0
    order = np.lexsort(points.T)
    new = np.ones(len(points), dtype=bool)
    new[1:] = (points[order][1:] != points[order][:-1]).any(axis=1)
    group = np.empty(len(points), dtype=np.int64)
    group[order] = np.cumsum(new) - 1
    return _first_of_each(group)


def _first_of_each(group: NDArray) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """First row of each group, in the order of rows; and for each row the position of its group in that order."""
    _, first, inverse = np.unique(group, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty(len(first), dtype=np.int64)
    rank[order] = np.arange(len(first))
    return first[order], rank[inverse]
