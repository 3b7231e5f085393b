"""The floor: a grid, which shows its position and the scale, and soft shadows, which show where bodies touch it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.results.view.floor_shadow import floor_shadow
from supple.results.view.layers.layer import Layer, quaternion, turning_z_to
from supple.results.view.look import floor_disc, theme
from supple.results.view.model import RenderFrame
from supple.results.view.surfaces import body_surface, boundary_surface, obstacle_surfaces


class Ground(Layer):
    """A disc with lines on the highest floor; none where the scene has no floor, because a grid would look like one."""

    def __init__(self, scene: Any, frame: RenderFrame, dark: bool) -> None:
        model, self.nodes = frame.model, []
        view, up, shown = model.view, model.view.up, theme(dark)
        floor = floor_shadow(model, 1)
        if floor is None:
            return
        self.nodes.append(_picture(scene, "/floor", floor.disc, floor_disc(dark, _DISC_CELLS)))
        # Slightly above the floor, because two surfaces in the same plane flicker.
        place = floor.disc.mean(axis=0) + 2e-3 * view.radius * up
        cell = 10.0 ** math.floor(math.log10(view.radius))
        grid = scene.add_grid(
            "/ground",
            width=5.0 * view.radius,
            height=5.0 * view.radius,
            cell_size=cell,
            section_size=5.0 * cell,
            cell_color=shown.cell,
            section_color=shown.section,
            fade_distance=8.0 * view.radius,
            shadow_opacity=0.0,
            wxyz=turning_z_to(up),
            position=tuple(place),
        )
        self.nodes.append(grid)

    def update(self, frame: RenderFrame) -> None:
        """The floor does not change."""


def _picture(scene: Any, name: str, corners: NDArray[np.float64], image: NDArray[np.uint8]) -> Any:
    """A picture on the floor, with its corners (4, 3) [m]."""
    first, second = corners[1] - corners[0], corners[3] - corners[0]
    size = float(np.linalg.norm(first))
    axes = np.stack([first / size, second / size, np.cross(first, second) / size**2], axis=1)
    return scene.add_image(
        name, image, size, size, format="png", cast_shadow=False, receive_shadow=False,
        wxyz=quaternion(axes), position=corners.mean(axis=0),
    )  # fmt: skip


_DISC_CELLS = 256
_CELLS = 128  # a picture of this many is made in some milliseconds


class ShadowView(Layer):
    """A picture on the floor; nothing where the scene has no floor."""

    def __init__(self, scene: Any, frame: RenderFrame) -> None:
        model, self.nodes = frame.model, []
        self._shadow = floor_shadow(model, _CELLS)
        if self._shadow is None:
            return
        # The boundary of the tets casts the shadow of a skin: it has fewer triangles.
        bodies = [body_surface(model, body) if body.rigid else boundary_surface(body) for body in model.bodies]
        self._casting = [one for one in (*bodies, *obstacle_surfaces(model)) if one.casts_shadow]
        self._image = _picture(scene, "/shadow", self._shadow.corners, self._shadow.picture(self._cast(frame)))
        self.nodes = [self._image]

    def update(self, frame: RenderFrame) -> None:
        if self.nodes:
            self._image.image = self._shadow.picture(self._cast(frame))  # pyright: ignore[reportOptionalMemberAccess]

    def _cast(self, frame: RenderFrame) -> list[tuple[NDArray[np.float64], NDArray[np.int32]]]:
        return [(surface.at(frame), surface.triangles) for surface in self._casting]
