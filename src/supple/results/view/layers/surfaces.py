"""Bodies and obstacles as shaded surfaces."""

from __future__ import annotations

from typing import Any

import numpy as np

from supple.results.view.layers.layer import Layer, quaternion, single
from supple.results.view.model import RenderFrame
from supple.results.view.surfaces import body_surface, boundary_surface, obstacle_surfaces


class SkinView(Layer):
    """One mesh for each body, or only the lines of its boundary."""

    def __init__(self, scene: Any, frame: RenderFrame, *, lines: bool = False) -> None:
        model, self._parts = frame.model, []
        for i, body in enumerate(model.bodies):
            surface = boundary_surface(body) if lines else body_surface(model, body).creased(model)
            handle = scene.add_mesh_simple(
                f"/bodies/{i} {body.name}",
                single(surface.at(frame)),
                surface.triangles.astype(np.uint32),
                color=surface.color,
                wireframe=lines,
                side="double",
            )
            self._parts.append((handle, surface))
        self.nodes = [handle for handle, _ in self._parts]

    def update(self, frame: RenderFrame) -> None:
        for handle, surface in self._parts:
            handle.vertices = single(surface.at(frame))


class ObstacleView(Layer):
    """One mesh for each obstacle."""

    def __init__(self, scene: Any, frame: RenderFrame, dark: bool = False) -> None:
        self._parts = []
        for number, flat in enumerate(obstacle_surfaces(frame.model, dark)):
            if flat.is_floor:  # it is drawn as a disc
                continue
            surface = flat.creased(frame.model)
            pose = surface.pose(frame)
            handle = scene.add_mesh_simple(
                f"/obstacles/{number} {surface.name}",
                single(surface.vertices),
                surface.triangles.astype(np.uint32),
                color=surface.color,
                opacity=surface.opacity if surface.opacity < 1.0 and not surface.container else None,
                side="back" if surface.container else "double",
                wxyz=quaternion(pose[:, :3]),
                position=pose[:, 3],
                cast_shadow=surface.opacity == 1.0,
            )
            self._parts.append([handle, surface, pose])
        self.nodes = [handle for handle, _, _ in self._parts]

    def update(self, frame: RenderFrame) -> None:
        for part in self._parts:
            handle, surface, before = part
            pose = surface.pose(frame)
            if not np.array_equal(pose, before):
                handle.wxyz, handle.position = quaternion(pose[:, :3]), pose[:, 3]
                part[2] = pose
