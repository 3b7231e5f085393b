"""Pairs of points and triangles of one body that never collide: neighbours in the mesh, or close at rest."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from supple.contact.search.point_lists import PairFinder
from supple.contact.search.surfaces import ContactSurfaces


def excluded_pairs(
    surfaces: ContactSurfaces, rest_positions: NDArray[np.float64], closer_than: float
) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
    """For each triangle, the points that it never collides with: starts (t + 1,) and points.

    These are its own corners, all points that share an edge with one of them, and all points of the same piece that are
    closer to it than `closer_than` [m] at rest.

    Parameters
    ----------
    rest_positions : (n, 3) of all points [m]
    """
    n, count, every = len(surfaces.point_piece), surfaces.body_triangles, len(surfaces.triangles)
    triangles = surfaces.triangles[:count]
    if not np.diagonal(surfaces.allowed).any():
        return np.zeros(len(surfaces.triangles) + 1, dtype=np.int64), np.zeros(0, dtype=np.int32)
    ones = np.ones(9 * count, dtype=np.int32)
    joined = csr_array((ones, (np.repeat(triangles, 3, axis=1).ravel(), np.tile(triangles, 3).ravel())), shape=(n, n))
    corners = csr_array(
        (np.ones(3 * count, dtype=np.int32), triangles.ravel(), 3 * np.minimum(np.arange(every + 1), count)),
        shape=(every, n),
    )
    same = np.ascontiguousarray(np.diag(np.diagonal(surfaces.allowed)))
    near_points, near_triangles = pairs_closer_than(surfaces, rest_positions, closer_than, same)
    close = csr_array(
        (np.ones(len(near_points), dtype=np.int32), (near_triangles, near_points)),
        shape=(every, n),
    )
    found = csr_array(corners @ joined + close)
    found.sort_indices()
    return found.indptr.astype(np.int64), found.indices.astype(np.int32)


def pairs_closer_than(
    surfaces: ContactSurfaces, positions: NDArray[np.float64], closer_than: float, pieces: NDArray[np.bool_]
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """(q,) points and (q,) triangles whose distance is below `closer_than` [m].

    Parameters
    ----------
    positions : (n, 3) of all points [m]; pieces : (p, p) whether points of one piece and triangles of another count
    """
    n, t = len(surfaces.point_piece), len(surfaces.triangles)
    finder = PairFinder(np.ones(n, dtype=np.bool_))
    look = np.zeros((n, 3))
    look[:, 0] = closer_than
    none = (pieces, np.zeros(t + 1, dtype=np.int64), np.zeros(0, dtype=np.int32))
    shapes = (positions, surfaces.point_piece, surfaces.triangles, surfaces.triangle_piece)
    finder.gather(shapes, (look, look), none)
    points = np.repeat(np.arange(n, dtype=np.int32), np.diff(finder.starts))
    return points, finder.triangles
