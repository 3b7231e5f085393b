"""Which surfaces are closed, and which voids they enclose."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.errors import SceneError
from supple.mesh.surface import SurfaceMesh
from supple.mesh.topology import edge_keys, graph_components


def enclosed_voids(points: NDArray[np.float64], triangles: NDArray[np.integer]) -> list[NDArray[np.int64]]:
    """The triangles of each void, the largest void first.

    Triangles that share an edge belong to the same piece of the surface. A piece that encloses a negative volume is the
    surface of a void.

    Parameters
    ----------
    points : (n, 3) [m]; triangles : (t, 3) a closed surface, counter-clockwise from outside of the body

    Returns
    -------
    For each void, the rows of its triangles, ascending.
    """
    keys = edge_keys(triangles.astype(np.int32), len(points)).ravel()
    order = np.argsort(keys, kind="stable")
    same = keys[order][1:] == keys[order][:-1]
    owner = order // 3
    piece = graph_components(len(triangles), owner[:-1][same], owner[1:][same])
    volumes = np.bincount(piece, weights=signed_volumes(points, triangles))
    voids = [k for k in np.argsort(volumes, kind="stable") if volumes[k] < 0.0]
    return [np.flatnonzero(piece == k) for k in voids]


def signed_volumes(points: NDArray[np.float64], triangles: NDArray[np.integer]) -> NDArray[np.float64]:
    """(t,) volumes between each triangle and the mean of the points; of a closed surface they sum to that inside."""
    a, b, c = (points - points.mean(axis=0))[triangles].transpose(1, 0, 2)
    return np.einsum("ij,ij->i", a, np.cross(b, c)) / 6.0


def is_closed(triangles: NDArray[np.integer]) -> bool:
    """Whether each edge of the triangles (t, 3) has as many triangles on its one side as on its other."""
    ends = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]).astype(np.int64)
    n = int(ends.max()) + 1
    forward, backward = ends[:, 0] * n + ends[:, 1], ends[:, 1] * n + ends[:, 0]
    return bool(np.array_equal(np.sort(forward), np.sort(backward)))


def require_closed(surface: SurfaceMesh, owner: str) -> None:
    """Check that every edge has as many triangles on one side as on the other.

    Raises
    ------
    SceneError : where one has not; the text begins with `owner`.
    """
    keys = edge_keys(surface.triangles, len(surface.vertices)).ravel()
    starts, ends = surface.triangles.ravel(), surface.triangles[:, [1, 2, 0]].ravel()
    signs = np.where(starts < ends, 1, -1)
    order = np.argsort(keys, kind="stable")
    first = np.flatnonzero(np.concatenate([[True], np.diff(keys[order]) != 0]))
    unbalanced = np.add.reduceat(signs[order], first) != 0
    if unbalanced.any():
        count = int(np.count_nonzero(unbalanced))
        raise SceneError(
            f"{owner}: its surface is not closed, or its triangles do not all face the same way ({count} "
            f"{'edge' if count == 1 else 'edges'}); repair it with sp.repair_surface, or give a TetMesh"
        )
