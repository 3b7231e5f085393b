"""A folder of Wavefront OBJ files, one for each frame; nearly every program reads them."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np

from supple.results.recording.reader import Recording
from supple.results.view.from_recording import model_of_recording, render_frame_of
from supple.results.view.surfaces import surfaces_of
from supple.runtime.replacing import whole_folder


def write_obj_folder(recording: Recording, output: Path) -> None:
    """Write frame_00000.obj, frame_00001.obj, ...: bodies as objects, and the obstacles in their places."""
    digits = max(5, len(str(len(recording) - 1)))
    model = model_of_recording(recording)
    objects = surfaces_of(model)
    faces, start = [], 1
    for surface in objects:
        faces.append("".join(f"f {a} {b} {c}\n" for a, b, c in (surface.triangles + start).tolist()))
        start += len(surface.at_rest(model))
    with whole_folder(output) as folder:
        for k, frame in enumerate(recording):
            render_frame, text = render_frame_of(model, frame), io.StringIO()
            text.write(f"# Supple: frame {frame.index}, t = {frame.time:.9g} s, metres, y up\n")
            for surface, face in zip(objects, faces, strict=True):
                text.write(f"o {'_'.join(surface.name.split())}\n")
                np.savetxt(text, surface.at(render_frame), fmt="v %.9g %.9g %.9g")
                text.write(face)
            (folder / f"frame_{k:0{digits}}.obj").write_text(text.getvalue(), encoding="utf-8", newline="\n")
