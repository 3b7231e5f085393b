"""Named sets of mesh files in a scene file: `set: NAME` of vertices and of regions becomes numbers."""

from __future__ import annotations

import re
from typing import Any

from supple.app.scene_file.document import SceneFileModel
from supple.app.scene_file.entries.bodies import BodyModel
from supple.app.scene_file.entries.mesh_sources import MeshStore
from supple.errors import SceneError
from supple.mesh.sets import MeshSets
from supple.scene.located import at

_SELECTIONS = ("pins", "forces", "soft_targets", "loads", "welds")


def with_numbers(model: SceneFileModel, meshes: MeshStore) -> SceneFileModel:
    """The scene file with vertices and tets instead of their sets; itself where it names no set.

    Raises
    ------
    LocatedError : where a body has no mesh file, or its file has no such set.
    """
    changes: dict[str, Any] = {}
    for key in _SELECTIONS:
        entries = getattr(model, key)
        if any(_set(entry) is not None for entry in entries):
            changes[key] = [_selected(entry, model, meshes, (key, i)) for i, entry in enumerate(entries)]
    if any(region.set is not None for body in model.bodies for region in body.regions or ()):
        changes["bodies"] = [_body(body, meshes, i) for i, body in enumerate(model.bodies)]
    return model.model_copy(update=changes) if changes else model


def _set(entry: Any) -> str | None:
    return getattr(entry, "set", None)  # some loads have no vertices


def _selected(entry: Any, model: SceneFileModel, meshes: MeshStore, place: tuple[str, int]) -> Any:
    if _set(entry) is None:
        return entry
    with at(*place, "set"):
        body = next((body for body in model.bodies if _is_of(entry.body, body)), None)
        if body is None:
            raise SceneError(f"there is no body {entry.body!r}")
        return entry.model_copy(update={"set": None, "vertices": _sets(body, meshes).vertices_of(entry.set).tolist()})


def _is_of(name: str, body: BodyModel) -> bool:
    """Whether a body of that name is made by an entry: it, or one of its copies."""
    return name == body.name if body.copies is None else re.fullmatch(re.escape(body.name) + r"\d+", name) is not None


def _body(body: BodyModel, meshes: MeshStore, number: int) -> BodyModel:
    regions = []
    for k, region in enumerate(body.regions or ()):
        if region.set is None:
            regions.append(region)
            continue
        with at("bodies", number, "regions", k, "set"):
            tets = _sets(body, meshes).tets_of(region.set).tolist()
            regions.append(region.model_copy(update={"set": None, "tets": tets}))
    return body.model_copy(update={"regions": regions or None})


def _sets(body: BodyModel, meshes: MeshStore) -> MeshSets:
    if body.mesh is None or body.mesh.is_surface():
        raise SceneError(f"body {body.name!r} has no file of tets with named sets (.inp or .msh)")
    return meshes.tets(body.mesh).sets
