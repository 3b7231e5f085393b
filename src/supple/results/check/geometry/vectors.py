"""Edges of tets and of triangles, and what is computed with them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def edge_vectors(x: Floats, tets: NDArray[np.integer]) -> Floats:
    """(m, 3, 3) whose columns are x1 - x0, x2 - x0, x3 - x0."""
    corners = x[tets]
    return np.ascontiguousarray((corners[:, 1:] - corners[:, :1]).transpose(0, 2, 1))


def determinants(D: Floats) -> Floats:
    """(..., ) of matrices (..., 3, 3)."""
    return np.einsum("...i,...i->...", D[..., 0], np.cross(D[..., 1], D[..., 2]))


def inverses(D: Floats) -> Floats:
    """(m, 3, 3) of matrices; NaN or infinite where they are singular."""
    a, b, c = D[:, :, 0], D[:, :, 1], D[:, :, 2]
    rows = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        return rows / np.einsum("ij,ij->i", a, rows[:, 0])[:, None, None]


def area_vectors(x: Floats, triangles: NDArray[np.integer]) -> Floats:
    """(t, 3) half of the cross products of two sides, outward."""
    a, b, c = x[triangles].transpose(1, 0, 2)
    return 0.5 * np.cross(b - a, c - a)


def enclosed_volume(x: Floats, triangles: NDArray[np.integer]) -> float:
    """What triangles that face outward enclose, by the tetrahedra between them and their center."""
    corners = x[triangles]
    a, b, c = (corners - corners.mean(axis=(0, 1))).transpose(1, 0, 2)
    return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6.0
