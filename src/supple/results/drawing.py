"""How a recording is drawn: surfaces of bodies and obstacles, their colors, and the viewpoint.

Pages, videos and exports use it, so that all show the same.
"""

from __future__ import annotations

import colorsys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from supple.results.recording.frame import RecordedFrame
from supple.results.recording.reader import Recording
from supple.results.recording.scene import RecordedBody, RecordedObstacle

# Colors that can also be distinguished with color blindness (after Okabe and Ito, brightened).
BODY_COLORS = (
    (230, 92, 60),
    (64, 156, 225),
    (245, 179, 36),
    (52, 172, 120),
    (206, 112, 178),
    (120, 200, 235),
    (160, 120, 80),
)


def body_color(number: int) -> tuple[int, int, int]:
    """The color (r, g, b) of the body at a place among all, from 0 to 255. The first 64 have different ones."""
    if number < len(BODY_COLORS):
        return BODY_COLORS[number]
    # Hues in steps of the golden section, in turns bright and dark.
    hue, bright = 0.86 + 0.618034 * number, (0.95, 0.6, 0.8)[number % 3]
    r, g, b = colorsys.hsv_to_rgb(hue % 1.0, (0.5, 0.95)[number % 2], bright)
    return round(255 * r), round(255 * g), round(255 * b)


OBSTACLE_COLOR = (176, 180, 188)
STITCH_COLOR = (214, 40, 90)
# A room is one surface between the eye and the bodies; walls can overlap, so that each must be more transparent.
ROOM_OPACITY, WALL_OPACITY = 0.13, 0.05


@dataclass(frozen=True, eq=False)
class Picture:
    """Triangles (t, 3) that move: `vertices` of one frame by `at(frame)`, (k, 3) [m]."""

    body: RecordedBody
    triangles: NDArray[np.int32]
    color: tuple[int, int, int]
    used: NDArray[np.int64]

    @property
    def name(self) -> str:
        return self.body.name

    def rest(self, recording: Recording) -> NDArray[np.float64]:
        """The vertices of a rigid body's surface in its own coordinates (k, 3) [m]."""
        return self.body.points(recording.rest_positions)

    def pose(self, frame: RecordedFrame) -> NDArray[np.float64]:
        """(3, 4) rotation and translation of a rigid body."""
        pose = frame.poses[self.name]
        return np.column_stack([pose.rotation, pose.translation])

    def at(self, frame: RecordedFrame) -> NDArray[np.float64]:
        """Positions of the vertices of the drawn surface, the skin or the boundary."""
        x = frame.state.positions[self.body.vertices]
        return x[self.used] if self.body.skin is None else self.body.skin.positions(x)


def pictures(recording: Recording) -> list[Picture]:
    """One for each body: its skin, or its boundary where it has no skin."""
    made = []
    for i, body in enumerate(recording.bodies):
        color = body_color(i)
        if body.skin is not None:
            made.append(Picture(body, body.skin.triangles, color, np.zeros(0, dtype=np.int64)))
        else:
            used, rows = np.unique(body.triangles, return_inverse=True)
            made.append(Picture(body, rows.reshape(-1, 3).astype(np.int32), color, used.astype(np.int64)))
    return made


@dataclass(frozen=True, eq=False)
class View:
    """The bounds of a whole recording, and its viewpoint.

    Attributes
    ----------
    low, high : (3,) bounds of the bodies in all frames [m]
    up : (3,) unit vector against gravity; y where there is none
    """

    low: NDArray[np.float64]
    high: NDArray[np.float64]
    up: NDArray[np.float64]

    @property
    def center(self) -> NDArray[np.float64]:
        return 0.5 * (self.low + self.high)

    @property
    def radius(self) -> float:
        """Of the ball about `center` that contains all bodies at all times [m]."""
        return max(0.5 * float(np.linalg.norm(self.high - self.low)), 1e-6)

    def eye(self, angle: float) -> NDArray[np.float64]:
        """The viewpoint from which the ball fills a vertical angle of view [degrees], slightly above and aside."""
        side = np.eye(3)[int(np.argmin(np.abs(self.up)))]
        ahead = np.cross(side, self.up)
        side = np.cross(self.up, ahead / np.linalg.norm(ahead))
        direction = 0.45 * side + 0.3 * self.up + 0.84 * np.cross(side, self.up)
        distance = 1.05 * self.radius / np.sin(np.radians(0.5 * angle))
        return self.center + distance * direction / np.linalg.norm(direction)


def view_of(recording: Recording) -> View:
    """Bounds over all frames, of which at most about 200 are read."""
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for frame in recording[:: max(1, len(recording) // 200)]:
        x = np.concatenate(list(frame.positions.values()))
        x = x[np.isfinite(x).all(axis=1)]
        if len(x):
            low, high = np.minimum(low, x.min(axis=0)), np.maximum(high, x.max(axis=0))
    if not np.isfinite(low).all():
        low, high = np.zeros(3), np.ones(3)
    g = recording.gravity
    size = np.linalg.norm(g)
    up = -g / size if size > 0.0 else np.array([0.0, 1.0, 0.0])
    return View(low, high, up)


@dataclass(frozen=True, eq=False)
class ObstaclePicture:
    """An obstacle's triangles at time 0; `RecordedFrame.obstacle_poses[number]` moves them.

    Of a room they face outwards: a page draws only their backs, so that one looks into it as into an open bowl.
    """

    number: int
    name: str
    vertices: NDArray[np.float64]
    triangles: NDArray[np.int32]
    opacity: float
    smooth: bool
    room: bool = False
    color: ClassVar[tuple[int, int, int]] = OBSTACLE_COLOR

    def moves(self, frames: Iterable[RecordedFrame]) -> bool:
        """Whether its pose changes in these frames."""
        poses = np.stack([frame.obstacle_poses[self.number] for frame in frames])
        return bool(np.any(poses != poses[0]))

    def at(self, frame: RecordedFrame) -> NDArray[np.float64]:
        """(k, 3) [m] in a frame."""
        pose = frame.obstacle_poses[self.number]
        return self.vertices @ pose[:, :3].T + pose[:, 3]


def obstacle_pictures(obstacles: Sequence[RecordedObstacle], view: View) -> list[ObstaclePicture]:
    """One for each obstacle. A half-space is drawn as a square about the bodies.

    Obstacles that would hide the bodies are transparent: rooms, and half-spaces that are not a floor.
    """
    made = []
    for number, recorded in enumerate(obstacles):
        obstacle = recorded.obstacle
        vertices, triangles = obstacle.drawn(view.center, 2.5 * view.radius)
        is_wall = obstacle.plane is not None and float(obstacle.plane[1] @ view.up) < 0.5
        opacity = WALL_OPACITY if is_wall else ROOM_OPACITY if obstacle.is_room else 1.0
        triangles = triangles.astype(np.int32)
        if obstacle.is_room and _volume(vertices, triangles) < 0.0:
            triangles = triangles[:, ::-1].copy()
        made.append(
            ObstaclePicture(number, recorded.name, vertices, triangles, opacity, obstacle.smooth, obstacle.is_room)
        )
    return made


def _volume(x: NDArray[np.float64], triangles: NDArray[np.int32]) -> float:
    """Of what a closed surface encloses [m^3]; below zero where its triangles face inwards."""
    a, b, c = (x[triangles[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6.0


def vertex_normals(x: NDArray[np.float64], triangles: NDArray[np.int32]) -> NDArray[np.float64]:
    """Unit normals (k, 3) at vertices x (k, 3): of the triangles around each, weighted by area."""
    a, b, c = (x[triangles[:, i]] for i in range(3))
    area = np.cross(b - a, c - a)
    normals = np.stack(
        [np.bincount(triangles.ravel(), np.repeat(area[:, i], 3), minlength=len(x)) for i in range(3)], axis=1
    )
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.where(length > 0.0, normals / np.where(length > 0.0, length, 1.0), [0.0, 1.0, 0.0])


def evenly(recording: Sequence[RecordedFrame], most: int) -> list[RecordedFrame]:
    """At most `most` frames, evenly spaced, including the first and the last."""
    if len(recording) <= most:
        return list(recording)
    chosen = np.unique(np.linspace(0, len(recording) - 1, most).round().astype(int))
    return [recording[int(i)] for i in chosen]
