"""Obstacles: their poses, and their scripted vertices, which are pinned and without a body.

The implicit solver has one array of positions: the bodies' vertices, and after them the vertices of the obstacles. An
obstacle's vertices follow their script as pins do, so that a body is pushed out of the way, or a report names what
blocks it. A half-space has three vertices a, b, c on its plane, whose normal is that of (b - a) x (c - a).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.model.stitched_points import with_stitched_points
from supple.model.system import System
from supple.scene.inputs import Input
from supple.scene.motion import Motion
from supple.scene.obstacles.obstacle import Obstacle


class ObstaclePoses:
    """Rotations (k, 3, 3) and translations (k, 3) [m] of k obstacles, at one time. Each time is evaluated once."""

    def __init__(self, obstacles: Sequence[Obstacle]) -> None:
        self.obstacles = tuple(obstacles)
        self.moving = np.array([obstacle.motion is not None for obstacle in self.obstacles], dtype=np.bool_)
        self._inputs = [one.motion for one in self.obstacles if isinstance(one.motion, Input)]
        self._recent: dict[tuple[Any, ...], tuple[NDArray[np.float64], NDArray[np.float64]]] = {}

    def at(self, time: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Rotations and translations at `time` [s]; read only."""
        if not self.moving.any():
            time = 0.0
        key = (time, *(given.ramp for given in self._inputs))  # where an input was set again, its poses differ
        if key not in self._recent:
            if len(self._recent) >= 4:
                self._recent.pop(next(iter(self._recent)))
            self._recent[key] = self._evaluate(time)
        return self._recent[key]

    def _evaluate(self, time: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        R = np.tile(np.eye(3), (len(self.obstacles), 1, 1))
        t = np.zeros((len(self.obstacles), 3))
        for k in np.flatnonzero(self.moving):
            R[k], t[k] = self.obstacles[k].pose(time)
        return R, t


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


def placed_with_obstacles(
    system: System, ranges: tuple[ObstacleRange, ...], positions: NDArray[np.float64], time: float
) -> NDArray[np.float64]:
    """(n, 3) of a system with obstacles at a time [s], of positions whose first rows are the bodies' vertices [m]."""
    x, own = np.zeros((len(system.rest_positions), 3)), system.bodies[-1].vertices.stop
    x[:own] = positions[:own]
    for part in ranges:
        x[part.vertices] = part.targets(time)
    return x


def _surface(obstacle: Obstacle, size: float) -> tuple[NDArray[np.float64], NDArray[np.integer]]:
    """Vertices (k, 3) at time 0 and triangles (t, 3)."""
    if obstacle.plane is None:
        return obstacle.triangles()
    point, normal = obstacle.plane
    along = np.cross(np.eye(3)[np.abs(normal).argmin()], normal)
    along *= size / np.linalg.norm(along)
    return np.stack([point, point + along, point + np.cross(normal, along)]), np.zeros((0, 3), dtype=np.int64)
