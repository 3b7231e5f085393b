"""Obstacles as vertices that move by script: pinned, without a body.

The implicit solver sees one array of positions: the bodies' vertices, and after them the corners of the obstacles. An
obstacle's corners are carried to where they must be exactly as pins are, so that a body is pushed out of the way, or
says what blocks it. A half-space is two points: a point of its plane, and the tip of its normal.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from supple.errors import SolverError
from supple.mesh import shapes
from supple.scene.motion import Motion
from supple.scene.obstacles import Box, HalfSpace, Obstacle, Sphere, TriangleObstacle
from supple.system import System

# An icosahedron's faces split into this many along each edge: faces stay within 0.2 % of the radius.
_SPHERE_SPLITS = 12


@dataclass(frozen=True, eq=False)
class ObstacleRange:
    """The vertices of one obstacle.

    Attributes
    ----------
    index : among the scene's obstacles; vertices : (k,); anchors : (k, 3) at time 0 [m]
    triangles : (t, 3) global vertex numbers; none for a half-space
    """

    obstacle: Obstacle
    index: int
    vertices: NDArray[np.int32]
    anchors: NDArray[np.float64]
    triangles: NDArray[np.int32]

    @property
    def label(self) -> str:
        return self.obstacle.label

    @property
    def motion(self) -> Motion:
        return self.obstacle.motion

    @property
    def is_plane(self) -> bool:
        return isinstance(self.obstacle, HalfSpace)

    def targets(self, time: float) -> NDArray[np.float64]:
        """Where the vertices (k, 3) are at `time` [m]."""
        if self.obstacle.motion is None:
            return self.anchors
        rotation, translation = self.obstacle.pose(time)
        return self.anchors @ rotation.T + translation


def with_obstacles(system: System) -> tuple[System, tuple[ObstacleRange, ...]]:
    """The system with the obstacles' vertices appended and pinned, and which ones they are."""
    diagonal = max(float(np.linalg.norm(np.ptp(system.rest_positions[p.vertices], axis=0))) for p in system.bodies)
    ranges: list[ObstacleRange] = []
    n = len(system.rest_positions)
    for index, obstacle in enumerate(system.obstacles):
        points, triangles = _surface(obstacle, diagonal)
        vertices = np.arange(n, n + len(points), dtype=np.int32)
        corners = (triangles + n).astype(np.int32)
        ranges.append(ObstacleRange(obstacle, index, vertices, np.ascontiguousarray(points), corners))
        n += len(points)
    if not ranges:
        return system, ()
    added = np.concatenate([part.anchors for part in ranges])
    # They are never free, but formulas that divide by masses see all vertices.
    light = np.full(len(added), 1e-6 * float(system.masses.min()))
    pieces = int(system.components.max()) + 1
    extended = replace(
        system,
        rest_positions=np.ascontiguousarray(np.concatenate([system.rest_positions, added])),
        masses=np.concatenate([system.masses, light]),
        components=np.concatenate([system.components, pieces + np.arange(len(added), dtype=np.int32)]),
        stitching=system.stitching.on_vertices({part.index: part.vertices for part in ranges}, n),
        pins=system.pins + tuple(ranges),  # pyright: ignore[reportArgumentType] - of a pin, vertices and targets are used
    )
    return extended, tuple(ranges)


def obstacle_positions(ranges: tuple[ObstacleRange, ...], time: float) -> NDArray[np.float64]:
    """(k, 3) of all obstacles' vertices at `time` [m]."""
    return np.concatenate([part.targets(time) for part in ranges]) if ranges else np.zeros((0, 3))


def _surface(obstacle: Obstacle, size: float) -> tuple[NDArray[np.float64], NDArray[np.integer]]:
    """Vertices (k, 3) at time 0 and triangles (t, 3)."""
    if isinstance(obstacle, HalfSpace):
        point, normal = np.asarray(obstacle.point), np.asarray(obstacle.normal)
        return np.stack([point, point + size * normal]), np.zeros((0, 3), dtype=np.int64)
    if isinstance(obstacle, TriangleObstacle):
        assert obstacle.surface is not None
        return obstacle.surface.vertices, obstacle.surface.triangles
    if isinstance(obstacle, Box):
        surface = shapes.box(tuple(np.asarray(obstacle.size, dtype=np.float64)), (1, 1, 1)).surface
        points = surface.vertices @ obstacle.orientation.T + np.asarray(obstacle.center)
        return points, surface.triangles
    if isinstance(obstacle, Sphere):
        directions, triangles = icosphere(_SPHERE_SPLITS)
        corners = directions[triangles]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        nearest = np.abs(np.einsum("ij,ij->i", corners[:, 0], normals)) / np.linalg.norm(normals, axis=1)
        # Bodies must not enter the true ball from outside, nor leave it from inside.
        scale = 1.0 if obstacle.inside else 1.0 / float(nearest.min())
        return np.asarray(obstacle.center) + obstacle.radius * scale * directions, triangles
    raise SolverError(f"{obstacle.label}: Implicit does not know this kind of obstacle; use XPBD, or take it out")


def icosphere(splits: int) -> tuple[NDArray[np.float64], NDArray[np.integer]]:
    """An icosahedron with every edge split into `splits`, projected on the unit sphere: points and triangles."""
    g = (1.0 + 5.0**0.5) / 2.0
    corners = np.array([[-1, g, 0], [1, g, 0], [-1, -g, 0], [1, -g, 0]], dtype=np.float64)
    corners = np.concatenate([corners, np.roll(corners, 1, axis=1), np.roll(corners, 2, axis=1)])
    from scipy.spatial import ConvexHull

    faces = ConvexHull(corners).simplices
    points, triangles = [], []
    count = 0
    number = np.full((splits + 1, splits + 1), -1, dtype=np.int64)
    for a, b, c in corners[faces]:
        if np.dot(np.cross(b - a, c - a), a + b + c) < 0.0:
            b, c = c, b
        for i in range(splits + 1):
            for j in range(splits + 1 - i):
                points.append(a + (b - a) * (i / splits) + (c - a) * (j / splits))
                number[i, j] = count
                count += 1
        for i in range(splits):
            for j in range(splits - i):
                triangles.append([number[i, j], number[i + 1, j], number[i, j + 1]])
                if i + j < splits - 1:
                    triangles.append([number[i + 1, j], number[i + 1, j + 1], number[i, j + 1]])
    all_points = np.array(points)
    all_points /= np.linalg.norm(all_points, axis=1)[:, None]
    _, first, merged = np.unique(np.round(all_points, 9), axis=0, return_index=True, return_inverse=True)
    return all_points[first], merged.reshape(-1)[np.array(triangles)]
