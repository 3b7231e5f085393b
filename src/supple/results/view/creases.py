"""Normals of drawn surfaces: smooth, but for creases."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

# Between the normals of two triangles. The facets of a coarse ball differ by less: a tet mesh of a tenth of the
# diameter as edge length has about 12 degrees, one of half of it 33; the edges of machine parts have 45 and more.
CREASE = np.radians(40.0)


def split_at_creases(
    x: NDArray[np.float64], triangles: NDArray[np.int32]
) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
    """Vertices x (k, 3) once for each smooth part around them: which vertex (j,) each is, and triangles (t, 3) of them.

    Two triangles are of one part where they share an edge, with no third one, and their normals differ by less than
    `CREASE`.
    """
    normals = _area_vectors(x, triangles)
    lengths = np.linalg.norm(normals, axis=1)
    normals /= np.where(lengths > 0.0, lengths, 1.0)[:, None]
    # Half-edge 3 t + k goes from corner k of triangle t to the next one.
    start, end = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    _, edge, count = np.unique(
        np.minimum(start, end) * np.int64(len(x)) + np.maximum(start, end), return_inverse=True, return_counts=True
    )
    order = np.argsort(edge, kind="stable")
    paired = order[count[edge[order]] == 2].reshape(-1, 2)
    owner = paired // 3
    # A triangle without area has no normal, and makes no crease.
    flat = (lengths[owner] == 0.0).any(axis=1)
    smooth = flat | (np.einsum("ij,ij->i", normals[owner[:, 0]], normals[owner[:, 1]]) > np.cos(CREASE))
    a, b = paired[smooth].T
    following = 3 * (np.arange(len(start)) // 3) + (np.arange(len(start)) % 3 + 1) % 3
    turned = start[a] == end[b]  # neighbours with the same orientation
    links = np.concatenate(
        [
            np.stack([a, np.where(turned, following[b], b)], axis=1),
            np.stack([following[a], np.where(turned, b, following[b])], axis=1),
        ]
    )
    graph = coo_array((np.ones(len(links), dtype=bool), (links[:, 0], links[:, 1])), shape=(len(start), len(start)))
    parts, label = connected_components(graph, directed=False)
    rows = np.empty(parts, dtype=np.int64)
    rows[label] = start
    return rows, label.reshape(-1, 3).astype(np.int32)


def vertex_normals(x: NDArray[np.float64], triangles: NDArray[np.int32]) -> NDArray[np.float64]:
    """Unit normals (k, 3) at vertices x (k, 3): of the triangles around each, weighted by area."""
    area = _area_vectors(x, triangles)
    normals = np.stack(
        [np.bincount(triangles.ravel(), np.repeat(area[:, i], 3), minlength=len(x)) for i in range(3)], axis=1
    )
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.where(length > 0.0, normals / np.where(length > 0.0, length, 1.0), [0.0, 1.0, 0.0])


def _area_vectors(x: NDArray[np.float64], triangles: NDArray[np.int32]) -> NDArray[np.float64]:
    a, b, c = (x[triangles[:, i]] for i in range(3))
    return np.cross(b - a, c - a)
