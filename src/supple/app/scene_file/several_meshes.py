"""A scene of several mesh files: their bodies stand in a row above one floor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from supple.app.scene_file.entries.mesh_sources import MESH_FILES
from supple.app.scene_file.loader import Run, load_run
from supple.errors import SceneError
from supple.mesh.mesh_file import load_mesh
from supple.mesh.meshing.units import likely_scale
from supple.scene.body import PlacedBody

_GAP = 0.2  # between two bodies, as a share of the second one's length


def load_run_of(paths: Sequence[Path], *, confine: bool = False, shell: bool = False) -> Run:
    """The scene of one file, as of `load_run`, or the bodies of several mesh files along x.

    Raises
    ------
    SceneError : where a file cannot be read, or one of several is not a mesh.
    """
    if len(paths) == 1:
        return load_run(paths[0], confine=confine, shell=shell)
    for path in paths:
        if path.suffix.lower() not in MESH_FILES:
            raise SceneError(f"{path}: only mesh files can be shown together; put the others into one scene file")
    scale = min(likely_scale(load_mesh(path).vertices) for path in paths)  # they are in the same unit
    runs = [load_run(path, confine=confine, scale=scale, shell=shell) for path in paths]
    bodies: list[PlacedBody] = []
    end = 0.0
    for run in runs:
        (body,) = run.scene.bodies
        x = body.place(body.mesh.vertices)[:, 0]
        low, high = float(x.min()), float(x.max())
        start = end + _GAP * (high - low) if bodies else low
        name, taken = body.name, {other.name for other in bodies}
        name = next(n for n in (name, *(f"{name} {k}" for k in range(2, len(paths) + 1))) if n not in taken)
        bodies.append(body.changed(name=name, position=np.add(body.position, (start - low, 0.0, 0.0))))
        end = start + high - low
    return replace(runs[0], scene=replace(runs[0].scene, bodies=bodies), text=None, description=None)
