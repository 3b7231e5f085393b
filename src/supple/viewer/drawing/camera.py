"""Where the page is seen from."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.output.drawing import View

ANGLE = 35.0  # of the camera, upwards [degrees]
_ROOM = 1.2
PRESETS = ("corner", "front", "side", "top")


def eye_of(preset: str, view: View) -> NDArray[np.float64]:
    """Where the camera stands (3,) [m] so that everything is seen."""
    # A little farther away than everything fills the picture: things are thrown about.
    corner = view.center + _ROOM * (view.eye(ANGLE) - view.center)
    if preset == "corner":
        return corner
    offset = corner - view.center
    distance = float(np.linalg.norm(offset))
    level = offset - float(offset @ view.up) * view.up
    across = np.eye(3)[int(np.argmax(np.abs(level)))]
    ahead = across * np.sign(level @ across)
    # From straight above there is no telling which way is up on the screen.
    directions = {"front": ahead, "side": np.cross(view.up, ahead), "top": view.up + 1e-3 * ahead}
    direction = directions[preset] + (0.0 if preset == "top" else 0.08) * view.up
    return view.center + distance * direction / np.linalg.norm(direction)


def set_initial_camera(server: Any, view: View) -> None:
    """Where those who open the page look from."""
    server.scene.set_up_direction(tuple(view.up))
    camera = server.initial_camera
    camera.position, camera.look_at = tuple(eye_of("corner", view)), tuple(view.center)
    camera.up, camera.fov = tuple(view.up), float(np.radians(ANGLE))
    camera.near, camera.far = view.radius * 1e-2, view.radius * 1e3


def look_from(client: Any, preset: str, view: View) -> None:
    """Take one visitor's camera to a preset."""
    with client.atomic():
        client.camera.up_direction = tuple(view.up)
        client.camera.position = tuple(eye_of(preset, view))
        # Last: viser moves what is looked at along with the camera.
        client.camera.look_at = tuple(view.center)
