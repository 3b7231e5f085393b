"""Camera positions from which a whole scene is seen."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.results.view.bounds import View

ANGLE = 35.0  # vertical field of view [degrees]
PRESETS = ("corner", "front", "side", "top", "back")
# Of the direction from which a scene is seen: to the side, up, and ahead. A bowl must show its inside.
_CORNER = (0.45, 0.5, 0.84)
_MARGIN = 1.12  # of the distance of the camera: margin beside the bodies


def direction_of(preset: str, view: View) -> NDArray[np.float64]:
    """Unit vector (3,) from a scene to the camera."""
    up = view.up
    side = np.eye(3)[int(np.argmin(np.abs(up)))]
    ahead = np.cross(side, up)
    side = np.cross(up, ahead / np.linalg.norm(ahead))
    direction: NDArray[np.float64] = np.array(_CORNER) @ np.stack([side, up, np.cross(side, up)])
    if preset != "corner":
        level = direction - float(direction @ up) * up
        across = np.eye(3)[int(np.argmax(np.abs(level)))]
        ahead = across * np.sign(level @ across)
        # Exactly from above, the up direction of the picture would be undefined.
        others = {"front": ahead, "side": np.cross(up, ahead), "top": up + 1e-3 * ahead, "back": -ahead}
        direction = others[preset] + (0.0 if preset == "top" else 0.08) * up
    return direction / np.linalg.norm(direction)


def upright(up: NDArray[np.float64], away: NDArray[np.float64]) -> NDArray[np.float64]:
    """The upward direction (3,) of a picture: `up`, or another one where the camera, at `away` (3,), looks along it."""
    return up if np.linalg.norm(np.cross(up, away)) >= 1e-6 else np.eye(3)[int(np.argmin(np.abs(away)))]


def fitted(
    points: NDArray[np.float64],
    away: NDArray[np.float64],
    up: NDArray[np.float64],
    slopes: tuple[float, float],
    *,
    centered: bool = True,
) -> tuple[NDArray[np.float64], float]:
    """The point (3,) at which a camera looks, and its distance [m], so that points fill its picture.

    Parameters
    ----------
    points : (k, 3) [m]; away : unit vector (3,) to the camera; up : unit vector (3,)
    slopes : tangents of half the horizontal, and of half the vertical angle of view
    centered : whether the points are in the middle of the picture, or the middle of their bounds is
    """
    right = np.cross(up, away)
    right /= np.linalg.norm(right)
    axes = np.stack([right, np.cross(away, right), away])
    target, distance = 0.5 * (points.min(axis=0) + points.max(axis=0)), 0.0
    for _ in range(6):
        across, along = (points - target) @ axes[:2].T, (points - target) @ away
        distance = max(_MARGIN * float((np.abs(across) / slopes + along[:, None]).max()), 1e-6)
        if not centered:
            break
        depth = distance - along
        for axis, x in enumerate(across.T):
            last, first = (x / depth).argmax(), (x / depth).argmin()
            shift = (x[last] * depth[first] + x[first] * depth[last]) / (depth[first] + depth[last])
            target = target + shift * axes[axis]
    return target, distance


def set_initial_camera(server: Any, view: View) -> None:
    """Set the camera for new visitors."""
    server.scene.set_up_direction(tuple(view.up))
    away, half = direction_of("corner", view), float(np.tan(np.radians(0.5 * ANGLE)))
    center, distance = fitted(view.outline, away, view.up, (half, half))
    camera = server.initial_camera
    camera.position, camera.look_at = tuple(center + distance * away), tuple(center)
    camera.up, camera.fov = tuple(view.up), float(np.radians(ANGLE))
    camera.near, camera.far = view.radius * 1e-2, view.radius * 1e3


def look_from(client: Any, preset: str, view: View) -> None:
    """Move the camera of one visitor to a preset."""
    _fit(client, view.outline, direction_of(preset, view), view.up)


def fit(client: Any, points: NDArray[np.float64]) -> None:
    """Move the camera of one visitor so that points (n, 3) [m] fill its picture; it keeps its direction."""
    away = np.asarray(client.camera.position) - np.asarray(client.camera.look_at)
    length = float(np.linalg.norm(away))
    _fit(client, points, away / length if length > 0.0 else np.array([0.0, 0.0, 1.0]))


def follow(client: Any, displacement: NDArray[np.float64]) -> None:
    """Move the camera of one visitor, and the point that it looks at, by `displacement` (3,) [m]."""
    camera = client.camera
    eye, center = np.asarray(camera.position), np.asarray(camera.look_at)
    _move(client, center + displacement, eye - center)


def stay_above(client: Any, floor: NDArray[np.float64], view: View, *, was_above: bool = True) -> bool:
    """Raise the camera of one visitor where it is below a floor, of which `floor` (3,) is a point [m].

    Not as long as it never was above: browsers begin with a camera of their own, and are sent the one of the scene.

    Returns
    -------
    Whether it was above.
    """
    camera = client.camera
    missing = _LOWEST * view.radius - float((np.asarray(camera.position) - floor) @ view.up)
    if was_above and missing > 0.0:
        center = np.asarray(camera.look_at)
        _move(client, center, np.asarray(camera.position) + missing * view.up - center)
    return was_above or missing <= 0.0


_LOWEST = 0.03  # height of a camera over a floor, as a share of the radius of the scene


def _fit(
    client: Any, points: NDArray[np.float64], away: NDArray[np.float64], up: NDArray[np.float64] | None = None
) -> None:
    camera = client.camera
    half = float(np.tan(0.5 * np.clip(camera.fov, 0.02, 3.0)))
    upwards = np.asarray(camera.up_direction, dtype=np.float64) if up is None else up
    upwards = upright(upwards, away)
    slopes = (half * max(camera.aspect, 0.05), half)
    center, distance = fitted(points, away, upwards, slopes, centered=up is not None)
    _move(client, center, distance * away, up)


def _move(
    client: Any, center: NDArray[np.float64], away: NDArray[np.float64], up: NDArray[np.float64] | None = None
) -> None:
    with client.atomic():
        if up is not None:
            client.camera.up_direction = tuple(up)
        client.camera.position = tuple(center + away)
        # Last: viser moves `look_at` together with the position.
        client.camera.look_at = tuple(center)
