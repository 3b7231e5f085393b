"""Converts recordings to the data that the page draws."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from supple.results.drawing import view_of
from supple.results.recording.frame import RecordedFrame
from supple.results.recording.reader import Recording
from supple.results.view.model import Model, ModelBody, Moment


def model_of_recording(recording: Recording) -> Model:
    """The constant data of a recording."""
    bodies = tuple(
        ModelBody(body.name, body.vertices, body.tets, body.triangles, body.skin, i, body.rigid)
        for i, body in enumerate(recording.bodies)
    )
    tets = np.ascontiguousarray(recording.tets, dtype=np.int32)
    return Model(
        bodies,
        recording.obstacles,
        recording.rest_positions,
        tets,
        view_of(recording),
        recording.stitches,
        joints=recording.joints,
    )


def moment_of_frame(model: Model, frame: RecordedFrame) -> Moment:
    """One frame of a recording."""
    return Moment(
        model,
        frame.time,
        frame.state.positions,
        frame.state.velocities,
        frame.obstacle_poses,
        internal=frame.state.internal,
        laws=replace(frame.recording.laws, active=frame.active),
        pinned=frame.recording.pinned_vertices.astype(np.int64),
    )
