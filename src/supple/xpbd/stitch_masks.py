"""Which of the points and triangles that may touch are stitched to each other."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.scene.obstacles import TriangleObstacle
from supple.scene.stitches.masks import Pair, stitched_triangles
from supple.system import System
from supple.xpbd.contact_surfaces import ContactSurfaces


def stitched_contacts(system: System, surfaces: ContactSurfaces) -> Pair:
    """(q,) points and (q,) triangles of `surfaces` that never collide: see `supple.scene.stitches.masks`."""
    nodes = system.stitching.nodes()
    # The last one for what is no node.
    point = np.append(_points_of_vertices(system, surfaces), -1)
    return stitched_triangles(point[nodes], surfaces.triangles, len(surfaces.point_piece))


def stitched_points(system: System, surfaces: ContactSurfaces) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
    """For each triangle, the points that are stitched to it: starts (t + 1,) and points."""
    points, triangles = stitched_contacts(system, surfaces)
    order = np.lexsort((points, triangles))
    starts = np.searchsorted(triangles[order], np.arange(len(surfaces.triangles) + 1))
    return starts.astype(np.int64), points[order].astype(np.int32)


def _points_of_vertices(system: System, surfaces: ContactSurfaces) -> NDArray[np.int64]:
    """(n + a,) the point of each vertex and anchor; -1 for vertices inside bodies."""
    anchors = system.stitching.anchors
    point = np.full(len(system.masses) + len(anchors), -1, dtype=np.int64)
    point[surfaces.rows] = np.arange(len(surfaces.rows))
    for k in np.unique(anchors.owner):
        obstacle = anchors.obstacles[k]
        assert isinstance(obstacle, TriangleObstacle)
        assert obstacle.surface is not None
        first = len(surfaces.rows) + int(np.argmax(surfaces.fixed_owners == k))
        mine = np.flatnonzero(anchors.owner == k)
        # An obstacle's points are those of its vertices that triangles use, in order.
        place = np.searchsorted(obstacle.surface.used_vertices, anchors.vertices[mine])
        point[len(system.masses) + mine] = first + place
    return point
