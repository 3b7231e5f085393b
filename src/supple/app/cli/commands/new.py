"""`supple new`."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from supple.app.cli.arguments import Shell
from supple.errors import SceneError


def new(
    scene: Path = Path("scene.yaml"),
    /,
    *,
    surface: Path | None = None,
    scale: float | None = None,
    shell: Shell = False,
    overwrite: Annotated[bool, Parameter(negative="")] = False,
) -> None:
    """Write a scene file with comments, to begin with: a ball, or a surface of yours, above a floor.

    Parameters
    ----------
    scene
        The file to write (.yaml).
    surface
        STL, OBJ, PLY, OFF, GLB, glTF, DAE, 3MF, VTP, VTK, VTU, MSH, INP, MESH or USD file that becomes the body.
    scale
        Factor of the surface's coordinates; without it, 0.001 where the surface is longer than 10 m, otherwise 1.
    shell
        The surface becomes a thin sheet, such as cloth; it may be open.
    overwrite
        Replace the file where it exists.
    """
    from supple.app.scene_file.new_scenes import new_scene, scene_of_surface
    from supple.mesh.io.mesh_files import READERS
    from supple.runtime.replacing import whole_file

    if scene.suffix.lower() in READERS:
        raise SceneError(f"{scene}: is a mesh, not a scene file; give it as supple new --surface {scene}")
    if scene.suffix.lower() not in (".yaml", ".yml"):
        raise SceneError(f"{scene}: a scene file ends in .yaml; name it {scene.name}.yaml")
    if scene.exists() and not overwrite:
        raise SceneError(f"{scene}: exists already; give another name, or --overwrite")
    if not scene.absolute().parent.is_dir():
        raise SceneError(f"{scene}: the folder {scene.absolute().parent} does not exist")
    if surface is None:
        if scale is not None:
            raise SceneError("--scale is of a surface; give --surface, too")
        if shell:
            raise SceneError("--shell is of a surface; give --surface, too")
        text = new_scene(scene.name)
    else:
        file = Path(os.path.relpath(surface.absolute(), scene.absolute().parent)).as_posix()
        text, chosen = scene_of_surface(surface, file, scene.name, scale, shell)
        print(chosen)
    with whole_file(scene) as fresh:
        fresh.write_text(text, encoding="utf-8")
    print(next(line[2:] for line in text.splitlines() if line.startswith("# About")))
    print(f"wrote {scene}; try: supple view {scene}")
