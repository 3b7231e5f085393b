"""Converts snapshots of a live simulation to the data that the page draws."""

from __future__ import annotations

import numpy as np

from supple.app.viewer.protocol.snapshots import Snapshot
from supple.results.view.bounds import box_corners, view_of_scene
from supple.results.view.model import Model, RenderFrame


class RenderFrameBuilder:
    """Converts snapshots to frames. Data that do not change are converted once."""

    def __init__(self) -> None:
        self._model: Model | None = None

    def frame(self, snapshot: Snapshot) -> RenderFrame:
        """The frame of a snapshot."""
        if self._model is None:
            scene = snapshot.description
            view = view_of_scene(box_corners(scene.low, scene.high), np.asarray(scene.up), scene.obstacles)
            self._model = Model(scene.bodies, scene.obstacles, view, scene.stitches, scene.joints)
        rotations, translations = snapshot.obstacle_poses
        poses = np.concatenate([rotations.reshape(-1, 3, 3), translations.reshape(-1, 3, 1)], axis=2)
        values = {}
        if snapshot.tet_values is not None and snapshot.tet_quantity is not None:
            values[snapshot.tet_quantity] = snapshot.tet_values
        return RenderFrame(
            self._model,
            snapshot.time,
            snapshot.positions,
            poses,
            contact_points=snapshot.contact_points,
            contact_forces=snapshot.contact_forces,
            pinned=snapshot.pinned.astype(np.int64),
            springs={grab.grab: (np.array(grab.point), np.array(grab.target)) for grab in snapshot.grabs},
            tet_values=values,
            broken_stitches=snapshot.broken_stitches,
        )
