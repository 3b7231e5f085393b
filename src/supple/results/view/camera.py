"""Camera positions from which a whole scene is seen."""

from __future__ import annotations

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
