"""Soft shadows of bodies on a floor, from light of the whole sky."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from supple.results.view.bounds import floor_height
from supple.results.view.model import Model

# Of the dark rim of a contact and of the wide shadow around it, as shares of the radius of the scene: the height above
# the floor at which it fades, and its blur; and how dark it becomes.
_COLOR = (30, 34, 48)
_DISC = 5.0  # half the side of that square, as a share of the radius of the scene
_MOST = 2.0**18  # points of one triangle
_LAYERS = ((0.06, 0.02, 0.45), (0.6, 0.09, 0.4))


class FloorShadow:
    """A picture of the shadows on a floor.

    Parameters
    ----------
    point, up : (3,) of the floor [m], and the unit vector out of it
    center, radius : of the scene [m]; the shadows reach two and a half radii from it
    cells : of a side of the picture

    Attributes
    ----------
    corners : (4, 3) where the picture lies on the floor, a little above it [m]
    disc : (4, 3) the square about the disc that is drawn of the floor [m]
    """

    def __init__(
        self,
        point: NDArray[np.float64],
        up: NDArray[np.float64],
        center: NDArray[np.float64],
        radius: float,
        cells: int,
    ) -> None:
        across = np.eye(3)[int(np.argmin(np.abs(up)))]
        first = np.cross(up, across) / np.linalg.norm(np.cross(up, across))
        self._axes: NDArray[np.float64] = np.stack([first, np.cross(up, first)]).astype(np.float64)
        self._up, self._radius, self._half, self._cells = up, radius, 2.5 * radius, cells
        self._origin = center - float((center - point) @ up) * up
        raised = self._origin + 5e-3 * radius * up  # two surfaces in the same plane flicker
        signs = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
        self.corners = raised + self._half * signs @ self._axes
        self.disc = self._origin + _DISC * radius * signs @ self._axes

    def darkness(self, surfaces: list[tuple[NDArray[np.float64], NDArray[np.int32]]]) -> NDArray[np.float64]:
        """(cells, cells) from 0 to 1, rows along the second side; of vertices (k, 3) [m] and triangles (t, 3)."""
        cells = self._cells
        cell = 2.0 * self._half / cells
        light = np.ones((cells, cells))
        samples = np.concatenate([np.zeros((0, 4)), *(_samples(x, t, self._axes, cell) for x, t in surfaces)])
        place = np.floor((samples[:, :3] - self._origin) @ self._axes.T / cell + 0.5 * cells).astype(int)
        height = (samples[:, :3] - self._origin) @ self._up
        inside = ((place >= 0) & (place < cells)).all(axis=1) & (height > -0.1 * self._radius)
        index, height, area = place[inside] @ [1, cells], np.maximum(height[inside], 0.0), samples[inside, 3]
        for fade, blur, darkest in _LAYERS:
            weights = np.exp(-height / (fade * self._radius)) * area / cell**2
            cover = np.bincount(index, weights, minlength=cells**2).reshape(cells, cells)
            blurred = gaussian_filter(1.0 - np.exp(-2.0 * cover), blur * self._radius / cell)
            light *= 1.0 - darkest * np.minimum(blurred, 1.0)
        return 1.0 - light

    def picture(self, surfaces: list[tuple[NDArray[np.float64], NDArray[np.int32]]]) -> NDArray[np.uint8]:
        """(cells, cells, 4) of the color of shadows, as opaque as they are dark; see `darkness`."""
        image = np.empty((self._cells, self._cells, 4), dtype=np.uint8)
        image[..., :3], image[..., 3] = _COLOR, np.round(255.0 * self.darkness(surfaces))
        return image


def floor_shadow(model: Model, cells: int) -> FloorShadow | None:
    """On the floor of a model; None where it has no floor."""
    view = model.view
    height = floor_height(view, model.obstacles)
    return None if height is None else FloorShadow(height * view.up, view.up, view.center, view.radius, cells)


def _samples(
    x: NDArray[np.float64], triangles: NDArray[np.int32], axes: NDArray[np.float64], cell: float
) -> NDArray[np.float64]:
    """Points (s, 3) of triangles, at least one in each cell that they cover, and the area (s,) that each stands for."""
    corners = x[triangles]
    flat = corners @ axes.T
    a, b = flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]
    area = 0.5 * np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
    count = np.ceil(np.minimum(4.0 * area / cell**2, _MOST)).astype(int) + 1
    owner = np.repeat(np.arange(len(triangles)), count)
    # Points of a lattice with irrational steps fill a triangle evenly, and stay where they are from frame to frame.
    k = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
    u, v = (0.5 + 0.7548776662 * k) % 1.0, (0.5 + 0.5698402910 * k) % 1.0
    over = u + v > 1.0
    u, v = np.where(over, 1.0 - u, u), np.where(over, 1.0 - v, v)
    p = corners[owner]
    points = p[:, 0] + u[:, None] * (p[:, 1] - p[:, 0]) + v[:, None] * (p[:, 2] - p[:, 0])
    return np.column_stack([points, (area / count)[owner]])
