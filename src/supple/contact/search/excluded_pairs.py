"""Pairs of points and triangles that never collide: close at rest within a body, or stitched or welded to each other.

Of stitches, these are the pairs of `supple.scene.stitches.masks`. Between things that are stitched to each other, they
are also the pairs that are nearer at the start than the gap of contact, where the point or all corners of the triangle
are stitched: otherwise contact would push faces apart that are stitched to each other.

Of welds, they are the pairs of the rigid body with the welded points and their neighbours that are nearer at the start
than the longest edge there.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from supple.contact.mesh.obstacles import ObstaclePoses
from supple.contact.search.point_lists import PairFinder
from supple.contact.search.surfaces import ContactSurfaces
from supple.model.system import System
from supple.scene.stitches.masks import Pair, stitched_triangles


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


def stitched_contacts(system: System, surfaces: ContactSurfaces, poses: ObstaclePoses) -> Pair:
    """(q,) points and (q,) triangles of `surfaces` that never collide."""
    # The last entry is for nodes that do not exist.
    nodes = np.append(_points_of_vertices(system, surfaces), -1)[system.stitching.nodes()]
    points, triangles = stitched_triangles(nodes, surfaces.triangles, len(surfaces.point_piece))
    start = _start(system, surfaces, poses)
    near_points, near_triangles = _touching(surfaces, start, nodes)
    welded_points, welded_triangles = _welded(system, surfaces, start)
    return (
        np.concatenate([points, near_points, welded_points]),
        np.concatenate([triangles, near_triangles, welded_triangles]),
    )


def stitched_points(
    system: System, surfaces: ContactSurfaces, poses: ObstaclePoses
) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
    """For each triangle, the points that are stitched to it: starts (t + 1,) and points."""
    points, triangles = stitched_contacts(system, surfaces, poses)
    order = np.lexsort((points, triangles))
    starts = np.searchsorted(triangles[order], np.arange(len(surfaces.triangles) + 1))
    return starts.astype(np.int64), points[order].astype(np.int32)


def _touching(surfaces: ContactSurfaces, start: NDArray[np.float64], nodes: NDArray[np.int64]) -> Pair:
    """Pairs of things that stitches with these nodes (k, 4) join, which are near at the start; see the module."""
    first, second = np.repeat(nodes[:, 0], 3), nodes[:, 1:].ravel()
    both = (first >= 0) & (second >= 0)
    one, other = surfaces.point_piece[first[both]], surfaces.point_piece[second[both]]
    joined = np.zeros_like(surfaces.allowed)
    joined[one, other] = joined[other, one] = True
    joined &= surfaces.allowed
    nothing = np.zeros(0, dtype=np.int64)
    if not joined.any():
        return nothing, nothing
    points, triangles = pairs_closer_than(surfaces, start, float(surfaces.gaps[joined].max()), joined)
    stitched = np.zeros(len(start), dtype=np.bool_)
    stitched[nodes[nodes >= 0]] = True
    kept = stitched[points] | stitched[surfaces.triangles[triangles]].all(axis=1)
    return points[kept].astype(np.int64), triangles[kept].astype(np.int64)


def _welded(system: System, surfaces: ContactSurfaces, start: NDArray[np.float64]) -> Pair:
    """Pairs of soft and rigid bodies that are welded to each other; see the module."""
    welding, names = system.welding, [part.name for part in system.bodies]
    joined = np.zeros_like(surfaces.allowed)
    for weld in system.scene.welds:
        both = (surfaces.owner[:, None] == names.index(weld.body)) & (surfaces.owner == names.index(weld.rigid))
        joined |= both | both.T
    joined &= surfaces.allowed
    welded = np.zeros(len(start), dtype=np.bool_)
    point = _points_of_vertices(system, surfaces)[welding.vertices[welding.weld >= 0]]
    welded[point[point >= 0]] = True
    ring = surfaces.triangles[welded[surfaces.triangles].any(axis=1)]
    if not joined.any() or not len(ring):
        return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
    longest = float(np.linalg.norm(start[ring] - start[ring[:, [1, 2, 0]]], axis=2).max())
    welded[ring] = True
    points, triangles = pairs_closer_than(surfaces, start, max(longest, float(surfaces.gaps[joined].max())), joined)
    kept = welded[points] | welded[surfaces.triangles[triangles]].all(axis=1)
    return points[kept].astype(np.int64), triangles[kept].astype(np.int64)


def _start(system: System, surfaces: ContactSurfaces, poses: ObstaclePoses) -> NDArray[np.float64]:
    """(n, 3) where the scene places the points [m]."""
    placed = np.concatenate([part.body.place(system.rest_positions[part.vertices]) for part in system.bodies])
    start = np.zeros((len(surfaces.point_piece), 3))
    start[: len(surfaces.rows)] = surfaces.embedded.positions(placed)
    surfaces.place_obstacles(poses, 0.0, start)
    return start


def _points_of_vertices(system: System, surfaces: ContactSurfaces) -> NDArray[np.int64]:
    """(n + a,) the point of each vertex and anchor; -1 for vertices inside bodies."""
    anchors = system.stitching.anchors
    row = np.full(len(system.points) + 1, -1, dtype=np.int64)  # the last one for what is not a point
    row[surfaces.rows] = np.arange(len(surfaces.rows))
    point = row[system.stitching.points_of_nodes(system.points)]
    for k in np.unique(anchors.owner):
        mesh = anchors.obstacles[k].surface_mesh
        assert mesh is not None  # others cannot be stitched to
        first = len(surfaces.rows) + int(np.argmax(surfaces.fixed_owners == k))
        mine = np.flatnonzero(anchors.owner == k)
        # An obstacle's points are those of its vertices that triangles use, in order.
        place = np.searchsorted(mesh.used_vertices, anchors.vertices[mine])
        point[system.stitching.first_anchor + mine] = first + place
    return point
