"""The obstacles, at their scripted poses."""

from __future__ import annotations

from typing import Any

import numpy as np

from supple.results.drawing import OBSTACLE_COLOR, obstacle_pictures
from supple.results.view.layers.layer import Layer, single
from supple.results.view.layers.rotation import quaternion
from supple.results.view.model import Moment


class ObstacleView(Layer):
    """One mesh for each obstacle."""

    def __init__(self, scene: Any, moment: Moment) -> None:
        model = moment.model
        self._handles = {}
        for picture in obstacle_pictures(model.obstacles, model.view):
            pose = moment.poses[picture.number]
            handle = scene.add_mesh_simple(
                f"/obstacles/{picture.number} {picture.name}",
                single(picture.vertices),
                picture.triangles.astype(np.uint32),
                color=OBSTACLE_COLOR,
                opacity=picture.opacity if picture.opacity < 1.0 and not picture.room else None,
                flat_shading=not picture.smooth,
                side="back" if picture.room else "double",
                wxyz=quaternion(pose[:, :3]),
                position=pose[:, 3],
                cast_shadow=picture.opacity == 1.0,
            )
            self._handles[picture.number] = handle, pose
        self.nodes = [handle for handle, _ in self._handles.values()]

    def update(self, moment: Moment) -> None:
        for number, (handle, before) in self._handles.items():
            pose = moment.poses[number]
            if not np.array_equal(pose, before):
                handle.wxyz, handle.position = quaternion(pose[:, :3]), pose[:, 3]
                self._handles[number] = handle, pose
