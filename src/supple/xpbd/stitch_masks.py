"""Which points and triangles never collide because they are stitched to each other.

For a vertex stitched to a triangle, edge or vertex: the vertex with the triangles that hold all of that (one, two, or
those around), and the corners of that with the triangles around the vertex. Nothing else: a neighbour of the triangle
still collides with the vertex.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from supple.scene.obstacles import TriangleObstacle
from supple.system import System
from supple.xpbd.contact_surfaces import ContactSurfaces


def stitched_contacts(system: System, surfaces: ContactSurfaces) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """(q,) points and (q,) triangles of `surfaces` that are stitched to each other."""
    stitching = system.stitching
    if not len(stitching):
        return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
    point = _points_of_vertices(system, surfaces)
    nodes = np.full((len(stitching), 4), -1, dtype=np.int64)
    tets, springs = stitching.tets.vertices, stitching.springs.vertices
    nodes[: len(tets)], nodes[len(tets) :, :3] = point[tets], point[springs]
    vertex, others = nodes[:, 0], nodes[:, 1:]
    n, k = len(surfaces.point_piece), len(nodes)
    t = len(surfaces.triangles)
    # (t, n): which points are corners of which triangles; (k, n): which points each stitch holds on to.
    corners = _matrix(np.repeat(np.arange(t), 3), surfaces.triangles.ravel(), (t, n))
    stitch, _ = np.nonzero(others >= 0)
    held = _matrix(stitch, others[others >= 0], (k, n))
    whole = (held @ corners.T).tocoo()
    inside = whole.data == held.sum(axis=1)[whole.row]
    around = (_matrix(np.flatnonzero(vertex >= 0), vertex[vertex >= 0], (k, n)) @ corners.T).tocoo()
    both = (held.T @ csr_array((np.ones(around.nnz, dtype=np.int8), (around.row, around.col)), shape=(k, t))).tocoo()
    points = np.concatenate([vertex[whole.row[inside]], both.row])
    triangles = np.concatenate([whole.col[inside], both.col])
    known = points >= 0
    return points[known].astype(np.int64), triangles[known].astype(np.int64)


def _matrix(rows: NDArray, columns: NDArray, shape: tuple[int, int]) -> csr_array:
    """Ones at the given places, also where one is given twice."""
    made = csr_array((np.ones(len(rows), dtype=np.int8), (rows, columns)), shape=shape)
    made.sum_duplicates()
    made.data[:] = 1
    return made


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
