"""Triangles with individual colors.

A mesh of the page has one color, so that the triangles are sorted into one mesh for each color.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.results.view.layers.layer import single

_LEAST = 16  # smallest capacity of a mesh, in triangles


class ColoredTriangles:
    """Flat triangles in a few colors.

    Parameters
    ----------
    scene : of viser; name : of the meshes, which get a number each; colors : (c, 3) from 0 to 255
    """

    def __init__(self, scene: Any, name: str, colors: NDArray[np.uint8]) -> None:
        self.handles = [
            scene.add_mesh_simple(
                f"{name}/{i}",
                np.zeros((3 * _LEAST, 3), dtype=np.float32),
                _faces(_LEAST),
                color=tuple(int(c) for c in color),
                flat_shading=True,
                side="double",
                visible=False,
            )
            for i, color in enumerate(colors)
        ]
        self._room = [_LEAST] * len(self.handles)

    def update(self, corners: NDArray[np.float64], color: NDArray[np.int64]) -> None:
        """Draw triangles with these corners (t, 3, 3) [m], each in one of the colors (t,)."""
        order = np.argsort(color, kind="stable")
        ends = np.searchsorted(color[order], np.arange(len(self.handles) + 1))
        for i, handle in enumerate(self.handles):
            mine = corners[order[ends[i] : ends[i + 1]]]
            if len(mine) == 0:
                handle.visible = False
                continue
            # The capacity is a power of two: the browser creates new buffers only where it changes.
            room = max(_LEAST, 1 << (len(mine) - 1).bit_length())
            points = np.repeat(mine[:1, :1], 3 * room, axis=0).reshape(-1, 3)
            points[: 3 * len(mine)] = mine.reshape(-1, 3)
            handle.vertices = single(points)
            if room != self._room[i]:
                handle.faces = _faces(room)
                self._room[i] = room
            handle.visible = True


def _faces(count: int) -> NDArray[np.uint32]:
    return np.arange(3 * count, dtype=np.uint32).reshape(-1, 3)
