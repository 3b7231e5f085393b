"""Obstacles as scripted vertices: pinned, without a body.

The implicit solver has one array of positions: the bodies' vertices, and after them the vertices of the obstacles. An
obstacle's vertices follow their script as pins do, so that a body is pushed out of the way, or a report names what
blocks it. A half-space has two vertices: a point of its plane, and the tip of its normal.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from supple.model.stitched_points import with_stitched_points
from supple.model.system import System
from supple.scene.motion import Motion
from supple.scene.obstacles.obstacle import Obstacle


@dataclass(frozen=True, eq=False)
class ObstacleRange:
    """The vertices of one obstacle.

    Attributes
    ----------
    index : among the scene's obstacles; vertices : (k,); anchors : (k, 3) at time 0 [m]
    triangles : (t, 3) rows of the vertices; none for a half-space
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
        return self.obstacle.plane is not None

    def targets(self, time: float) -> NDArray[np.float64]:
        """Positions (k, 3) of the vertices at `time` [m]."""
        if self.obstacle.motion is None:
            return self.anchors
        rotation, translation = self.obstacle.pose(time)
        return self.anchors @ rotation.T + translation


def with_obstacles(system: System) -> tuple[System, tuple[ObstacleRange, ...]]:
    """The system with the obstacles' vertices appended and pinned, and their ranges.

    Points of rigid bodies that something is stitched to come before them; see `with_stitched_points`.
    """
    system = with_stitched_points(system)
    diagonal = max(float(np.linalg.norm(np.ptp(system.rest_points[p.points], axis=0))) for p in system.bodies)
    ranges: list[ObstacleRange] = []
    n = len(system.rest_positions)
    for index, obstacle in enumerate(system.obstacles):
        points, triangles = _surface(obstacle, diagonal)
        vertices = np.arange(n, n + len(points), dtype=np.int32)
        own = triangles.astype(np.int32)
        ranges.append(ObstacleRange(obstacle, index, vertices, np.ascontiguousarray(points), own))
        n += len(points)
    if not ranges:
        return system, ()
    added = np.concatenate([part.anchors for part in ranges])
    # They are never free, but some formulas divide by the masses of all vertices.
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
    """(k, 3) positions of all obstacles' vertices at `time` [m]."""
    return np.concatenate([part.targets(time) for part in ranges]) if ranges else np.zeros((0, 3))


def _surface(obstacle: Obstacle, size: float) -> tuple[NDArray[np.float64], NDArray[np.integer]]:
    """Vertices (k, 3) at time 0 and triangles (t, 3)."""
    if obstacle.plane is None:
        return obstacle.triangles()
    point, normal = obstacle.plane
    return np.stack([point, point + size * normal]), np.zeros((0, 3), dtype=np.int64)
