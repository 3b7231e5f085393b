"""ParaView's older format for series: a .pvd that lists one VTU file for each frame. It also opens recordings."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from supple.files.replacing import whole_file, whole_folder
from supple.output.recording.reader import RecordedFrame, Recording


def write_pvd(recording: Recording, output: Path) -> None:
    """Write a folder with recording.pvd and frame_00000.vtu, ...: with tets, velocities, J and body numbers."""
    digits = max(5, len(str(len(recording) - 1)))
    with whole_folder(output) as folder:
        lines = ['<?xml version="1.0"?>', '<VTKFile type="Collection" version="0.1">', "  <Collection>"]
        for k, frame in enumerate(recording):
            name = f"frame_{k:0{digits}}.vtu"
            _write_vtu(recording, frame, folder / name)
            lines.append(f'    <DataSet timestep="{frame.time!r}" part="0" file="{name}"/>')
        lines += ["  </Collection>", "</VTKFile>", ""]
        (folder / "recording.pvd").write_text("\n".join(lines), encoding="utf-8")


def write_last_vtu(recording: Recording, output: Path) -> None:
    """Write the last frame as one VTU file."""
    with whole_file(output) as fresh:
        _write_vtu(recording, recording[-1], fresh)


def _write_vtu(recording: Recording, frame: RecordedFrame, path: Path) -> None:
    import meshio

    of_point = np.zeros(len(recording.rest_positions), dtype=np.int32)
    of_tet = np.zeros(len(recording.tets), dtype=np.int32)
    for i, body in enumerate(recording.bodies):
        of_point[body.vertices], of_tet[body.tets] = i, i
    mesh = meshio.Mesh(
        frame.state.positions,
        [("tetra", recording.tets)],
        point_data={"velocities": frame.state.velocities, "body": of_point},
        cell_data={"det_F": [frame.det_F], "body": [of_tet]},
    )
    mesh.write(path, file_format="vtu")
