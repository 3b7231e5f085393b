"""Measures of the shape of tets, and of how many there are across a body."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.mesh.topology import TET_EDGES, TET_FACETS, facet_keys


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


@dataclass(frozen=True, eq=False)
class Thickness:
    """How many tets a line from each triangle of the surface goes through, along the inward normal.

    A line through a cube of six tets, or through a layer of regular tets as thick as a cube of six times their volume,
    crosses about three.

    Attributes
    ----------
    areas : (t,) of the triangles [m^2]; tets : (t,) the tet behind each
    crossed : (t,) number of tets until the line leaves the mesh, counted up to a limit
    """

    areas: NDArray[np.float64]
    tets: NDArray[np.int64]
    crossed: NDArray[np.int64]


def thickness(vertices: NDArray[np.float64], tets: NDArray[np.int32], limit: int) -> Thickness:
    """Follow the lines through at most `limit` tets. The count does not depend on the shape of the tets, only on how
    many there are: flat cells count like cubes."""
    m = len(tets)
    facets = tets[:, TET_FACETS]
    keys = facet_keys(facets.reshape(-1, 3), len(vertices))
    order = np.argsort(keys, kind="stable")
    same = np.flatnonzero(keys[order[1:]] == keys[order[:-1]])
    # Facet 4 e + k is opposite node k of tet e; its other side, or -1.
    beyond = np.full(4 * m, -1)
    beyond[order[same]], beyond[order[same + 1]] = order[same + 1], order[same]
    facet = np.flatnonzero(beyond < 0)
    a, b, c = np.moveaxis(vertices[facets.reshape(-1, 3)[facet]], 1, 0)
    outward = np.cross(b - a, c - a)
    start = 0.45 * a + 0.35 * b + 0.2 * c  # no symmetry that would put the line on edges of a regular mesh
    own, crossed = facet // 4, np.zeros(len(facet), dtype=np.int64)
    line = np.arange(len(facet))
    for _ in range(limit):
        tet, entered = facet // 4, facet % 4
        crossed[line] += 1
        corners = vertices[tets[tet]]
        inverse = np.linalg.inv(np.moveaxis(corners[:, 1:] - corners[:, :1], 1, 2))
        at = np.einsum("eij,ej->ei", inverse, start[line] - corners[:, 0])
        slope = -np.einsum("eij,ej->ei", inverse, outward[line])
        at = np.column_stack([1.0 - at.sum(axis=1), at])
        slope = np.column_stack([-slope.sum(axis=1), slope])
        slope[np.arange(len(line)), entered] = 0.0
        with np.errstate(divide="ignore", invalid="ignore"):
            leaves = np.where(slope < 0.0, -at / slope, np.inf).argmin(axis=1)
        facet = beyond[4 * tet + leaves]
        line, facet = line[facet >= 0], facet[facet >= 0]
    return Thickness(0.5 * np.linalg.norm(outward, axis=1), own, crossed)
