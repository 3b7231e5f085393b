"""Camera positions, and the bounds of what is drawn, all of which they see."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray


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


ANGLE = 35.0  # vertical field of view [degrees]
_ROOM = 1.2
PRESETS = ("corner", "front", "side", "top", "back")


def eye_of(preset: str, view: View) -> NDArray[np.float64]:
    """Position (3,) [m] of the camera from which the whole scene is visible."""
    # Slightly farther away than necessary, because bodies move.
    corner = view.center + _ROOM * (view.eye(ANGLE) - view.center)
    if preset == "corner":
        return corner
    offset = corner - view.center
    distance = float(np.linalg.norm(offset))
    level = offset - float(offset @ view.up) * view.up
    across = np.eye(3)[int(np.argmax(np.abs(level)))]
    ahead = across * np.sign(level @ across)
    # Exactly from above, the up direction of the picture would be undefined.
    directions = {"front": ahead, "side": np.cross(view.up, ahead), "top": view.up + 1e-3 * ahead, "back": -ahead}
    direction = directions[preset] + (0.0 if preset == "top" else 0.08) * view.up
    return view.center + distance * direction / np.linalg.norm(direction)


def set_initial_camera(server: Any, view: View) -> None:
    """Set the camera for new visitors."""
    server.scene.set_up_direction(tuple(view.up))
    camera = server.initial_camera
    camera.position, camera.look_at = tuple(eye_of("corner", view)), tuple(view.center)
    camera.up, camera.fov = tuple(view.up), float(np.radians(ANGLE))
    camera.near, camera.far = view.radius * 1e-2, view.radius * 1e3


def look_from(client: Any, preset: str, view: View) -> None:
    """Move the camera of one visitor to a preset; in a narrow picture, farther away."""
    away = eye_of(preset, view) - view.center
    away *= np.sin(np.radians(0.5 * ANGLE)) / np.sin(_half_angle(client.camera))
    _move(client, view.center, away, view.up)


def fit(client: Any, points: NDArray[np.float64]) -> None:
    """Move the camera of one visitor so that points (n, 3) [m] fill its picture; it keeps its direction."""
    camera = client.camera
    low, high = points.min(axis=0), points.max(axis=0)
    radius = max(0.5 * float(np.linalg.norm(high - low)), 1e-6)
    away = np.asarray(camera.position) - np.asarray(camera.look_at)
    length = float(np.linalg.norm(away))
    away = away / length if length > 0.0 else np.array([0.0, 0.0, 1.0])
    _move(client, 0.5 * (low + high), 1.05 * radius / np.sin(_half_angle(camera)) * away)


def follow(client: Any, way: NDArray[np.float64]) -> None:
    """Move the camera of one visitor, and the point that it looks at, by `way` (3,) [m]."""
    camera = client.camera
    eye, center = np.asarray(camera.position), np.asarray(camera.look_at)
    _move(client, center + way, eye - center)


def stay_above(client: Any, floor: NDArray[np.float64], view: View) -> None:
    """Raise the camera of one visitor where it is below a floor, of which `floor` (3,) is a point [m]."""
    camera = client.camera
    missing = _LOWEST * view.radius - float((np.asarray(camera.position) - floor) @ view.up)
    if missing > 0.0:
        center = np.asarray(camera.look_at)
        _move(client, center, np.asarray(camera.position) + missing * view.up - center)


_LOWEST = 0.03  # height of a camera over a floor, as a share of the radius of the scene


def _half_angle(camera: Any) -> float:
    """Half of the smaller angle of view of a camera [rad]."""
    half = 0.5 * float(np.clip(camera.fov, 0.02, 3.0))
    return half if camera.aspect >= 1.0 else float(np.arctan(np.tan(half) * max(camera.aspect, 0.05)))


def _move(
    client: Any, center: NDArray[np.float64], away: NDArray[np.float64], up: NDArray[np.float64] | None = None
) -> None:
    with client.atomic():
        if up is not None:
            client.camera.up_direction = tuple(up)
        client.camera.position = tuple(center + away)
        # Last: viser moves `look_at` together with the position.
        client.camera.look_at = tuple(center)
