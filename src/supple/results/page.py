"""A page that plays a recording in a browser: one file that needs no installation and no network.

The player is the client of viser (three.js), which is in the wheel of viser; the page contains the frames, compressed.
"""

from __future__ import annotations

import html
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.results.drawing import (
    STITCH_COLOR,
    View,
    evenly,
    obstacle_pictures,
    opened,
    pictures,
    view_of,
)
from supple.results.recording.frame import RecordedFrame
from supple.results.recording.reader import Recording
from supple.results.view.gate import new_token
from supple.results.view.server import gated_server
from supple.runtime.replacing import whole_file

# Bytes of moving vertices before compression, which at least halves them; pages of longer recordings have fewer frames.
_MOST_BYTES = 36_000_000
_ANGLE = 35.0  # of the camera, upwards [degrees]
_RESOLUTION = 2.0**-13  # to which vertices are rounded, as a share of the size of the scene: less than a pixel


def write_page(
    recording: Recording | str | Path, output: str | Path, *, frames: Sequence[RecordedFrame] | None = None
) -> Path:
    """Write `output` (such as index.html), which plays the recording in a loop in any browser.

    Parameters
    ----------
    recording : an open recording, or its path; output : the page, replaced where it exists.
    frames : of the recording, at least one, which the page plays; all without this.

    Raises
    ------
    OutputError : where the recording cannot be read, or the page cannot be written.
    """
    output = Path(output)
    with opened(recording) as source, whole_file(output) as fresh:
        with gated_server(new_token()) as server:
            page = _serialize(server, source, frames or source)
        fresh.write_text(titled(page, ", ".join(body.name for body in source.bodies)), encoding="utf-8")
    return output


def titled(page: str, title: str) -> str:
    """A page of viser with our title."""
    return page.replace("<title>Viser</title>", f"<title>{html.escape(title[:80])} · Supple</title>", 1)


def _serialize(server: Any, recording: Recording, played: Sequence[RecordedFrame]) -> str:
    drawn = pictures(recording)
    view = view_of(recording)
    _set_stage(server, view)
    first = played[0]
    obstacles = _add_obstacles(server, recording, first, view)
    quantum = quantum_of(view)
    handles = [
        server.scene.add_mesh_simple(
            f"/bodies/{i} {picture.name}", _rounded(picture.at(first), quantum), picture.triangles, color=picture.color
        )
        for i, picture in enumerate(drawn)
    ]
    stitches = _add_stitches(server, recording, first, quantum)
    size = sum(12 * len(picture.at(first)) for picture in drawn) + 24 * len(recording.stitches)
    frames = evenly(played, max(2, _MOST_BYTES // max(1, size)))
    serializer = server.get_scene_serializer()
    previous = first.time
    for frame in frames[1:]:
        serializer.insert_sleep(max(0.0, frame.time - previous))
        previous = frame.time
        for handle, picture in zip(handles, drawn, strict=True):
            handle.vertices = _rounded(picture.at(frame), quantum)
        if stitches is not None:
            stitches.points = _rounded(
                recording.stitches.segments(frame.state.positions, frame.obstacle_poses), quantum
            )
        for number, (handle, before) in obstacles.items():
            pose = frame.obstacle_poses[number]
            if not np.array_equal(pose, before):
                handle.wxyz, handle.position = _quaternion(pose[:, :3]), pose[:, 3]
                obstacles[number] = handle, pose
    serializer.insert_sleep(recording.dt)
    return serializer.as_html()


def _set_stage(server: Any, view: View) -> None:
    eye, up = view.eye(_ANGLE), view.up
    server.scene.set_up_direction(tuple(up))
    camera = server.initial_camera
    camera.position, camera.look_at, camera.up = tuple(eye), tuple(view.center), tuple(up)
    camera.fov = np.radians(_ANGLE)
    camera.near, camera.far = view.radius * 1e-2, view.radius * 1e3


def _add_obstacles(
    server: Any, recording: Recording, first: RecordedFrame, view: View
) -> dict[int, tuple[Any, NDArray[np.float64]]]:
    """Draw the obstacles; returns their handles and poses by number."""
    handles = {}
    for obstacle in obstacle_pictures(recording.obstacles, view):
        pose = first.obstacle_poses[obstacle.number]
        handle = server.scene.add_mesh_simple(
            f"/obstacles/{obstacle.number} {obstacle.name}",
            obstacle.vertices.astype(np.float32),
            obstacle.triangles,
            color=obstacle.color,
            opacity=obstacle.opacity if obstacle.opacity < 1.0 and not obstacle.room else None,
            flat_shading=not obstacle.smooth,
            side="back" if obstacle.room else "double",
            wxyz=_quaternion(pose[:, :3]),
            position=pose[:, 3],
            cast_shadow=obstacle.opacity == 1.0,
        )
        handles[obstacle.number] = handle, pose
    return handles


def _add_stitches(server: Any, recording: Recording, first: RecordedFrame, quantum: float) -> Any:
    """Draw stitches as segments; returns their handle, or None where there are none."""
    if not len(recording.stitches):
        return None
    return server.scene.add_line_segments(
        "/stitches",
        _rounded(recording.stitches.segments(first.state.positions, first.obstacle_poses), quantum),
        colors=STITCH_COLOR,
        thickness=2.0,
        thickness_units="screen",
    )


def _quaternion(R: NDArray[np.float64]) -> NDArray[np.float64]:
    """(w, x, y, z) of a rotation (3, 3)."""
    from scipy.spatial.transform import Rotation

    return Rotation.from_matrix(R).as_quat()[[3, 0, 1, 2]]


def quantum_of(view: View) -> float:
    """The power of two to which vertices are rounded: numbers with few bits compress well."""
    return float(2.0 ** np.floor(np.log2(_RESOLUTION * 2.0 * view.radius)))


def _rounded(x: NDArray[np.float64], quantum: float) -> NDArray[np.float32]:
    return (np.round(np.nan_to_num(x) / quantum) * quantum).astype(np.float32)
