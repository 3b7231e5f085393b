"""Measures of the shape of tets."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.mesh.topology import TET_EDGES, TET_FACETS


def min_dihedrals(vertices: NDArray[np.float64], tets: NDArray[np.int32]) -> NDArray[np.float64]:
    """Smallest of the six dihedral angles of each tet (m,) [degrees], between 0 and 70.53 (the regular tet)."""
    corners = vertices[tets]
    normals = []
    for facet in TET_FACETS:
        a, b, c = (corners[:, k] for k in facet)
        n = np.cross(b - a, c - a)
        normals.append(n / np.linalg.norm(n, axis=1, keepdims=True))
    # Facets i and j, opposite vertices i and j, meet at an angle of pi minus that between their outward normals.
    largest_cosine = np.full(len(tets), -1.0)
    for i, j in TET_EDGES:
        np.maximum(largest_cosine, -np.einsum("ij,ij->i", normals[i], normals[j]), out=largest_cosine)
    return np.degrees(np.arccos(np.clip(largest_cosine, -1.0, 1.0)))


def radius_ratios(vertices: NDArray[np.float64], tets: NDArray[np.int32]) -> NDArray[np.float64]:
    """Three times the inscribed over the circumscribed radius of each tet (m,), in (0, 1].

    r = 3 V / (sum of facet areas); R = |a² (b x c) + b² (c x a) + c² (a x b)| / (12 V), with a, b, c the edges from
    vertex 0.
    """
    corners = vertices[tets]
    a, b, c = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 0]
    bc, ca, ab = np.cross(b, c), np.cross(c, a), np.cross(a, b)
    volume = np.abs(np.einsum("ij,ij->i", a, bc)) / 6.0
    opposite_first = np.cross(corners[:, 2] - corners[:, 1], corners[:, 3] - corners[:, 1])
    areas = sum(0.5 * np.linalg.norm(n, axis=1) for n in (bc, ca, ab, opposite_first))
    squares = [np.einsum("ij,ij->i", e, e)[:, None] for e in (a, b, c)]
    center = np.linalg.norm(squares[0] * bc + squares[1] * ca + squares[2] * ab, axis=1)
    return 3.0 * (3.0 * volume / areas) / (center / (12.0 * volume))
