"""A surface file as a scene: a soft body above a floor, with a size, a material and a number of tets chosen for it."""

from __future__ import annotations

import logging
import re
from pathlib import Path

import numpy as np

from supple.app.scene_file.template import new_scene_of
from supple.app.scene_file.yaml_reader import YamlDocument, parse_yaml
from supple.errors import SceneError
from supple.mesh.meshing.child_process import DEFAULT_TETS
from supple.mesh.meshing.ftetwild import INSTALL, ftetwild_installed
from supple.mesh.meshing.sizes import automatic_tets
from supple.mesh.meshing.units import likely_scale
from supple.mesh.surface import SurfaceMesh

logger = logging.getLogger(__name__)


def read_surface_scene(path: str | Path) -> YamlDocument:
    """The scene of a surface file, as if a scene file beside it described it.

    Raises
    ------
    MeshError : where the file cannot be read.
    """
    path = Path(path)
    text, chosen = scene_of_surface(path, path.name, f"{path.stem}.yaml")
    logger.info("%s; to change it: supple new --surface %s", chosen, path)
    return parse_yaml(text, path)


def scene_of_surface(surface: Path, file: str, name: str, scale: float | None = None) -> tuple[str, str]:
    """The text of a scene file with a surface, and one line about what was chosen.

    Parameters
    ----------
    surface : the file; file : its path in the text
    name : of the scene file, for its comments
    scale : factor of coordinates; None: 0.001 where the surface is longer than 10 m, otherwise 1

    Raises
    ------
    MeshError : where the file cannot be read. SceneError : where the scale is not above 0 and finite.
    """
    loaded = SurfaceMesh.load(surface)
    used = likely_scale(loaded.vertices) if scale is None else scale
    if not 0.0 < used < np.inf:
        raise SceneError(f"scale must be a number above 0 and finite, not {used:g}")
    low, high = (used * corner for corner in loaded.bounds)
    body = re.sub(r"[^A-Za-z0-9_-]+", "_", surface.stem)[:50] or "body"
    report = loaded.check()
    text = new_scene_of(name, file, body, used, (low, high), tets=DEFAULT_TETS, repair=not report.ok)
    size = " x ".join(f"{value:.3g}" for value in high - low)
    unit = f", taken to be in millimetres (scale: {used:g})" if scale is None and used != 1.0 else ""
    line = f"{surface}: {size} m{unit}, {len(loaded.triangles):,} triangles, about {DEFAULT_TETS:,} tets"
    if automatic_tets(loaded) is not None:
        line += " (it is reduced for that, and drawn as it is)"
    if not report.ok:
        line += f"; it is repaired first: {report.problems[0].partition(':')[0]}"
        if report.self_intersecting and not ftetwild_installed():
            line += f" (this needs {INSTALL})"
    return text, line
