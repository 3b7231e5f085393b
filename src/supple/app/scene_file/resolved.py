"""A scene file that is complete in itself: with all defaults, the options of the command, and copies of its meshes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from supple.app.scene_file.entries.kinds import model_of
from supple.app.scene_file.loader import Run
from supple.app.scene_file.yaml_files import yaml_text
from supple.mesh.io.tetgen_family import SUFFIXES
from supple.solvers.registry import solver_of_kind

SCENE_NAME, INPUTS = "scene.yaml", "inputs"


def resolved_scene(run: Run, *, solver: str | None, dt: float, steps: int) -> dict[str, str | Path]:
    """The files that describe a run: by their names, the text of the scene file, and which files to copy.

    Parameters
    ----------
    run : of a scene file
    solver : kind of a solver with default parameters that is used instead of the file's, or None
    dt, steps : those of the run
    """
    changes: dict[str, Any] = {"dt": dt, "steps": steps}
    if solver is not None:
        changes["solver"] = model_of(type(solver_of_kind(solver)), True).model_validate({"kind": solver})
    assert run.description is not None
    data = run.description.model_copy(update=changes).model_dump(mode="json")
    copies: dict[str, Path] = {}
    _redirect(data, run.folder, {}, copies)
    return {SCENE_NAME: yaml_text(data), **copies}


def _redirect(data: Any, folder: Path, names: dict[str, str], copies: dict[str, Path]) -> None:
    """Let every `file` in the data lead to a copy, and list the copies; `names` has those that were redirected."""
    if isinstance(data, list):
        for item in data:
            _redirect(item, folder, names, copies)
    elif isinstance(data, dict):
        for key, value in data.items():
            if key == "file" and isinstance(value, str):
                if value not in names:
                    names[value] = f"{INPUTS}/{len(names)}/{Path(value).name}"
                    for path in _files_of(folder / value):
                        copies[f"{INPUTS}/{len(names) - 1}/{path.name}"] = path
                data[key] = names[value]
            else:
                _redirect(value, folder, names, copies)


def _files_of(path: Path) -> list[Path]:
    """A mesh file; of TetGen, all files of the mesh."""
    if path.suffix.lower() not in SUFFIXES:
        return [path]
    return [other for suffix in SUFFIXES if (other := path.with_suffix(suffix)).exists()]
