"""From a scene to a scene file: the inverse of `supple.app.scene_file.loader`.

Every kind is written by its declared fields, as `supple.app.scene_file.entries` reads them. Meshes and long arrays are
files beside the scene file. Their names contain a hash of what they hold, so that the files of an earlier version stay
as they are until the scene file has been replaced, in one moment.
"""

from __future__ import annotations

import hashlib
import io
import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import singledispatch
from pathlib import Path
from typing import Any

import numpy as np

from supple.app.scene_file.entries.body import RIGID, ROD, SHARED, SOFT
from supple.app.scene_file.loader import validated
from supple.app.scene_file.yaml_files import parse_yaml, yaml_text
from supple.errors import MeshError, SceneError
from supple.kinds.kind import Declared, Kind, declared, same
from supple.kinds.validators import Instance, OneOf, Validator
from supple.materials.elastic_tets.regions import Regions
from supple.materials.own.energy_material import FormulaText
from supple.materials.own.formula import Formula
from supple.mesh.io import ply, vtk_xml
from supple.mesh.mesh_file import load_mesh
from supple.mesh.origin import origin_of
from supple.mesh.surface import SurfaceMesh
from supple.mesh.tetmesh import TetMesh
from supple.runtime.replacing import remove_abandoned, whole_file
from supple.scene.inputs import Input, MotorInput
from supple.scene.loads.load import Rows
from supple.scene.loads.muscle import ForceLength
from supple.scene.loads.over_time import OverTimeOf
from supple.scene.loads.points import Point, PointList, PointValidator
from supple.scene.motion import MotionValidator
from supple.scene.registry import PARTS
from supple.scene.rigid.rigid_body import RigidBody
from supple.scene.rod import Rod
from supple.scene.scene import Scene
from supple.scene.selection import InBox, Vertices
from supple.scene.shell import Shell

_INLINE = 64  # numbers of an array that a reader can still survey in the text

_OWN = re.compile(r"\.?(?P<stem>\w+-[0-9a-f]{12})(?P<temporary>\.supple-[\w-]+)?(?P<suffix>\.(?:vtu|ply|npy))")


class Files:
    """The files beside a scene file, by their names relative to it.

    Parameters
    ----------
    path : of the scene file
    """

    def __init__(self, path: Path) -> None:
        self.scene = path
        self.folder = path.parent / f"{path.stem}_files"
        self.contents: dict[str, bytes] = {}
        self._named: dict[int, tuple[Any, dict[str, Any]]] = {}

    def mesh(self, mesh: SurfaceMesh | TetMesh, label: str) -> dict[str, Any]:
        """The entry of a mesh: its own file where that is in the folder and holds exactly it, or else a new one."""
        if id(mesh) not in self._named:
            self._named[id(mesh)] = mesh, self._entry(mesh, label)
        return self._named[id(mesh)][1]

    def _entry(self, mesh: SurfaceMesh | TetMesh, label: str) -> dict[str, Any]:
        origin = origin_of(mesh)
        if origin is not None and origin.is_relative_to(self.scene.parent.absolute()):
            with suppress(MeshError):
                if _equal(load_mesh(origin), mesh):
                    return {"file": origin.relative_to(self.scene.parent.absolute()).as_posix()}
        if isinstance(mesh, TetMesh):
            return {"file": self.add(label, ".vtu", vtk_xml.written_cells(mesh.vertices, mesh.nodes))}
        return {"file": self.add(label, ".ply", ply.written(mesh.vertices, mesh.triangles)), "merge": False}

    def array(self, array: np.ndarray, label: str) -> Any:
        """An array as lists, or of a long one the entry of its file."""
        if array.size <= _INLINE:
            return array.tolist()
        data = io.BytesIO()
        np.save(data, array, allow_pickle=False)
        return {"file": self.add(label, ".npy", data.getvalue())}

    def add(self, label: str, suffix: str, data: bytes) -> str:
        """The name of the file with this content."""
        stem = re.sub(r"\W+", "_", label).strip("_")[:40]
        end = f"-{hashlib.sha256(data).hexdigest()[:12]}{suffix}"
        name = next((name for name in self.contents if name.endswith(end)), f"{self.folder.name}/{stem}{end}")
        self.contents[name] = data
        return name

    def write(self, text: str) -> None:
        """Write all files, the scene file at last, and delete those of an earlier version of it.

        Raises
        ------
        OutputError : where the system refuses; then the earlier version is still there.
        """
        fresh: list[Path] = []
        try:
            with whole_file(self.scene) as temporary:
                temporary.write_text(text, encoding="utf-8")
                for name, data in self.contents.items():
                    path = self.scene.parent / name
                    if not path.exists() or path.read_bytes() != data:
                        fresh.append(path)
                        with whole_file(path) as new:
                            new.write_bytes(data)
        except BaseException:
            for path in fresh:
                path.unlink(missing_ok=True)
            with suppress(OSError):  # unless it holds others
                self.folder.rmdir()
            raise
        for path in self.folder.iterdir() if self.folder.is_dir() else ():
            match = _OWN.fullmatch(path.name)
            if match is not None and match["temporary"]:
                remove_abandoned(self.folder / (match["stem"] + match["suffix"]))
            elif match is not None and path.name not in text:
                path.unlink(missing_ok=True)


def save_scene(scene: Scene, path: str | Path) -> None:
    """Write a scene; see `Scene.save`."""
    path = Path(path)
    if path.suffix.lower() not in (".yaml", ".yml"):
        raise SceneError(f"{path}: a scene file ends with .yaml; give such a name")
    files = Files(path)
    data: dict[str, Any] = {"bodies": [_body(body, files) for body in scene.bodies]}
    for key, part in PARTS.items():
        items = getattr(scene, key)
        if key != "bodies" and items:
            data[key] = [_entry(item, part.kinds, files, _label(key, i, item)) for i, item in enumerate(items)]
    data["gravity"] = np.asarray(scene.gravity).tolist()
    text = yaml_text(data)
    validated(parse_yaml(text, path))
    files.write(text)


def _label(key: str, i: int, item: Any) -> str:
    return str(getattr(item, "name", None) or f"{key} {i}")


def _body(body: Any, files: Files) -> dict[str, Any]:
    data = _fields(body, files, body.name, SHARED)
    if isinstance(body, RigidBody):
        shape = files.mesh(body.shape, body.name)
        data |= {"mesh": shape} if isinstance(body.shape, TetMesh) else {"surfaces": [shape]}
        return data | {"rigid": _fields(body, files, body.name, RIGID)}
    if isinstance(body, Shell):
        shell = _fields(body.material, files, body.name)
        return data | {"surfaces": [files.mesh(body.surface, body.name)], "shell": shell}
    if isinstance(body, Rod):
        own = _fields(body, files, body.name, ROD)
        return data | {"rod": own | _fields(body.material, files, body.name)}
    material = body.material
    materials = material.materials if isinstance(material, Regions) else (material,)
    described = [
        written(declared(type(body))["material"].validator, one, Field(body, "material", files, f"{body.name} {k}"))
        for k, one in enumerate(materials)
    ]
    data |= {"mesh": files.mesh(body.mesh, body.name)} | described[0]
    rows = [np.flatnonzero(np.asarray(material.index) == k) for k in range(len(materials))] if described[1:] else []
    regions = [
        one | {"tets": files.array(tets, f"{body.name} {k} tets")}
        for k, (one, tets) in enumerate(zip(described, rows, strict=False))
        if k and len(tets)
    ]
    return data | ({"regions": regions} if regions else {}) | _fields(body, files, body.name, SOFT)


@dataclass(frozen=True)
class Field:
    """A field that is written: the thing that has it, its name, where files go, and the beginning of their names."""

    thing: Kind
    name: str
    files: Files
    label: str


def _entry(thing: Kind, kinds: Sequence[Any], files: Files, label: str) -> dict[str, Any]:
    """One object of a list or a key whose objects are of `kinds`."""
    if type(thing) not in kinds:
        raise SceneError(
            f"{thing.label}: scene files do not know its class {type(thing).__name__}; make it known with "
            "supple.scene.registry.register, a material with supple.materials.registry.MATERIALS.append"
        )
    return ({"kind": thing.kind} if len(kinds) > 1 else {}) | _fields(thing, files, label)


def _fields(thing: Kind, files: Files, label: str, fields: Mapping[str, Declared] | None = None) -> dict[str, Any]:
    """The keys of its declared fields that have another value than the default."""
    data: dict[str, Any] = {}
    for name, one in (declared(type(thing)) if fields is None else fields).items():
        value = getattr(thing, name)
        if not same(value, one.default):
            here = Field(thing, name, files, f"{label} {name}")
            data |= {name: None} if value is None else written(one.validator, value, here)
    return data


@singledispatch
def written(validator: Validator, value: Any, of: Field) -> dict[str, Any]:
    """The keys that a checked value of a field has in a scene file, not None.

    Raises
    ------
    SceneError : where a scene file cannot hold it.
    """
    return {of.name: _plain(value, validator, of)}


def _plain(value: Any, validator: Validator, of: Field) -> Any:
    if isinstance(value, Kind):
        return _fields(value, of.files, of.label)
    if isinstance(value, Mapping):
        return {key: _plain(item, validator, replace(of, label=f"{of.label} {key}")) for key, item in value.items()}
    if isinstance(value, str | bool):
        return value
    if isinstance(value, tuple) and value and isinstance(value[0], str):
        return list(value)
    if not callable(value):
        array = np.asarray(value)
        if array.dtype.kind in "biuf":
            return of.files.array(array, of.label)
    what = f"the input {value.name!r}" if isinstance(value, Input) else f"a {type(value).__name__}"
    remedy = {MotionValidator: "Keyframes", OverTimeOf: "a Curve"}.get(type(validator), "a constant")
    raise SceneError(f"{of.thing.label}: {of.name} is {what}, which a scene file cannot hold; give {remedy}")


@written.register
def _(validator: OneOf, value: Kind, of: Field) -> dict[str, Any]:
    return {of.name: _entry(value, validator.classes, of.files, of.label)}


@written.register
def _(validator: Instance, value: SurfaceMesh, of: Field) -> dict[str, Any]:
    return {of.name: of.files.mesh(value, of.label)}


@written.register
def _(validator: Vertices, value: Any, of: Field) -> dict[str, Any]:
    return {"box" if isinstance(value, InBox) else of.name: _plain(value, validator, of)}


@written.register
def _(validator: Rows, value: Any, of: Field) -> dict[str, Any]:
    return {"box" if isinstance(value, InBox) else validator.things: _plain(value, validator, of)}


@written.register
def _(validator: OverTimeOf, value: Any, of: Field) -> dict[str, Any]:
    if validator.inputs and isinstance(value, MotorInput):
        return {of.name: {"input": value.name, "value": value.value.item()}}
    return {of.name: _plain(value, validator, of)}


@written.register
def _(validator: PointValidator, value: Point, of: Field) -> dict[str, Any]:
    return {of.name: _point(value)}


@written.register
def _(validator: PointList, value: Sequence[Point], of: Field) -> dict[str, Any]:
    return {of.name: [_point(point) for point in value]}


def _point(point: Point) -> dict[str, Any]:
    body, place = point
    where = {"vertex": place} if isinstance(place, int) else {"place": np.asarray(place).tolist()}
    return ({} if body is None else {"body": body}) | where


@written.register
def _(validator: ForceLength, value: Any, of: Field) -> dict[str, Any]:
    return {of.name: {key: part.tolist() for key, part in zip(("stretches", "values"), value, strict=True)}}


@written.register
def _(validator: FormulaText, value: Any, of: Field) -> dict[str, Any]:
    formula = getattr(of.thing.recorded(), "psi", None)  # pyright: ignore[reportAttributeAccessIssue]
    if not isinstance(formula, Formula):
        raise SceneError(f"{of.thing.label}: psi has a function that a text cannot hold; give another formula")
    return {of.name: value if isinstance(value, str) else formula.text}


def _equal(first: SurfaceMesh | TetMesh, second: SurfaceMesh | TetMesh) -> bool:
    a, b = (one.nodes if isinstance(one, TetMesh) else one.triangles for one in (first, second))
    return type(first) is type(second) and np.array_equal(first.vertices, second.vertices) and np.array_equal(a, b)
