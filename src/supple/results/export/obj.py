"""A folder of Wavefront OBJ files, one for each frame; nearly every program reads them."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np

from supple.results.drawing import obstacle_pictures, pictures, view_of
from supple.results.recording.reader import Recording
from supple.runtime.replacing import whole_folder


def write_obj_folder(recording: Recording, output: Path) -> None:
    """Write frame_00000.obj, frame_00001.obj, ...: bodies as objects, and the obstacles in their places."""
    digits = max(5, len(str(len(recording) - 1)))
    objects = [*pictures(recording), *obstacle_pictures(recording.obstacles, view_of(recording))]
    faces, start = [], 1
    for picture in objects:
        faces.append("".join(f"f {a} {b} {c}\n" for a, b, c in (picture.triangles + start).tolist()))
        start += len(picture.at(recording[0]))
    with whole_folder(output) as folder:
        for k, frame in enumerate(recording):
            text = io.StringIO()
            text.write(f"# Supple: frame {frame.index}, t = {frame.time:.9g} s, metres, y up\n")
            for picture, face in zip(objects, faces, strict=True):
                text.write(f"o {'_'.join(picture.name.split())}\n")
                np.savetxt(text, picture.at(frame), fmt="v %.9g %.9g %.9g")
                text.write(face)
            (folder / f"frame_{k:0{digits}}.obj").write_text(text.getvalue(), encoding="utf-8", newline="\n")
