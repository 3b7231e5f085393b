"""The obstacles, at their scripted poses."""

from __future__ import annotations

from typing import Any

import numpy as np

from supple.results.view.layers.layer import Layer, single
from supple.results.view.layers.rotation import quaternion
from supple.results.view.model import Moment
from supple.results.view.surfaces import obstacle_surfaces


class ObstacleView(Layer):
    """One mesh for each obstacle."""

    def __init__(self, scene: Any, moment: Moment) -> None:
        self._parts = []
        for number, flat in enumerate(obstacle_surfaces(moment.model)):
            surface = flat.creased(moment.model)
            pose = surface.pose(moment)
            handle = scene.add_mesh_simple(
                f"/obstacles/{number} {surface.name}",
                single(surface.vertices),
                surface.triangles.astype(np.uint32),
                color=surface.color,
                opacity=surface.opacity if surface.opacity < 1.0 and not surface.room else None,
                side="back" if surface.room else "double",
                wxyz=quaternion(pose[:, :3]),
                position=pose[:, 3],
                cast_shadow=surface.opacity == 1.0,
            )
            self._parts.append([handle, surface, pose])
        self.nodes = [handle for handle, _, _ in self._parts]

    def update(self, moment: Moment) -> None:
        for part in self._parts:
            handle, surface, before = part
            pose = surface.pose(moment)
            if not np.array_equal(pose, before):
                handle.wxyz, handle.position = quaternion(pose[:, :3]), pose[:, 3]
                part[2] = pose
