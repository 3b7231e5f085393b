"""Camera positions."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.output.drawing import View

ANGLE = 35.0  # vertical field of view [degrees]
_ROOM = 1.2
PRESETS = ("corner", "front", "side", "top")


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
    directions = {"front": ahead, "side": np.cross(view.up, ahead), "top": view.up + 1e-3 * ahead}
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
    """Move the camera of one visitor to a preset."""
    with client.atomic():
        client.camera.up_direction = tuple(view.up)
        client.camera.position = tuple(eye_of(preset, view))
        # Last: viser moves `look_at` together with the position.
        client.camera.look_at = tuple(view.center)
