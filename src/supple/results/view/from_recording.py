"""Converts recordings to the data that the page draws."""

from __future__ import annotations

import numpy as np

from supple.results.recording.frame import RecordedFrame
from supple.results.recording.reader import Recording
from supple.results.view.bounds import View, box_corners, farthest, view_of_scene
from supple.results.view.model import Model, RenderFrame


def model_of_recording(recording: Recording) -> Model:
    """The constant data of a recording."""
    view = view_of(recording)
    return Model(recording.bodies, recording.obstacles, view, recording.stitches, recording.joints)


def render_frame_of(model: Model, frame: RecordedFrame) -> RenderFrame:
    """One frame of a recording."""
    return RenderFrame(
        model,
        frame.time,
        frame.state.positions,
        frame.obstacle_poses,
        internal=frame.state.internal,
        broken_stitches=frame.state.broken_stitches,
        laws=frame.laws,
        pinned=frame.system.pinned_vertices.astype(np.int64),
    )


def view_of(recording: Recording) -> View:
    """See `view_of_scene`; over all frames, of which at most about 200 are read."""
    points = np.zeros((0, 3))
    for frame in recording[:: max(1, len(recording) // 200)]:
        x = np.concatenate(list(frame.positions.values()))
        x = np.concatenate([points, x[np.isfinite(x).all(axis=1)]])
        points = farthest(x) if len(x) else x
    if not len(points):
        points = box_corners(np.zeros(3), np.ones(3))
    g = recording.gravity
    size = np.linalg.norm(g)
    up = -g / size if size > 0.0 else np.array([0.0, 1.0, 0.0])
    return view_of_scene(points, up, recording.obstacles)


def evenly(count: int, most: int) -> list[int]:
    """At most `most` numbers below `count`, evenly spaced, with the first and the last one."""
    return [int(i) for i in np.unique(np.linspace(0, count - 1, min(count, most)).round())]
