"""Surfaces of scenes by trimesh and pycollada: glTF 2.0 (.glb, .gltf), COLLADA (.dae) and 3MF, each where it is placed.

glTF has metres and y up, as Supple does; the others name their unit, and COLLADA the axis that points up. Skins, morph
targets and materials are ignored.
"""

from __future__ import annotations

import io
import json
from base64 import b64encode
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from urllib.parse import unquote
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from supple.mesh.io.cells import TRIANGLE, CellSoup, FormatError, MeshFile
from supple.mesh.io.in_child import read_in_child
from supple.mesh.io.text import file_beside

_FAN = 6  # of the modes of primitives
_MOST_BYTES = 2**30  # of all buffers of a .gltf file together
# Of COLLADA, what no geometry needs.
_UNREAD = (
    "bind_material", "library_materials", "library_effects", "library_images", "library_lights", "library_cameras",
    "library_animations", "library_physics_models",
)  # fmt: skip
# Of 3MF, in metres.
_UNITS = {"micron": 1e-6, "millimeter": 1e-3, "centimeter": 1e-2, "inch": 0.0254, "foot": 0.3048, "meter": 1.0}


def read_glb(data: bytes) -> MeshFile:
    """Triangles of a GLB file."""
    if not data.startswith(b"glTF"):
        raise FormatError("it does not begin as a GLB file does: is it glTF?")
    return read_in_child(data, "trimesh", ".glb")


def read_gltf(data: bytes, path: Path) -> MeshFile:
    """Triangles of a .gltf file, with the buffers beside it or in it."""
    try:
        document = json.loads(data)
        size = 0
        for buffer in document.get("buffers", []):
            uri = buffer.get("uri", "")
            if not uri.startswith("data:"):
                content = file_beside(path, unquote(uri))
                if (size := size + len(content)) > _MOST_BYTES:
                    raise FormatError(f"its buffers have more than {_MOST_BYTES >> 20} MiB together")
                buffer["uri"] = "data:application/octet-stream;base64," + b64encode(content).decode()
        data = json.dumps(document).encode()
    except (ValueError, AttributeError, TypeError, RecursionError):
        raise FormatError("it is not JSON of glTF: damaged, or not a .gltf file") from None
    return read_in_child(data, "trimesh", ".gltf")


def read_dae(data: bytes) -> MeshFile:
    """Triangles of a COLLADA file."""
    if b"<!DOCTYPE" in data or b"<!ENTITY" in data:
        raise FormatError("it declares entities of XML, which are not read")
    _require("collada")
    return read_in_child(data, "trimesh", ".dae")


def read_3mf(data: bytes) -> MeshFile:
    """Triangles of a 3MF file."""
    if not data.startswith(b"PK"):
        raise FormatError("it is not a 3MF file, which is a ZIP archive")
    if b"3dmodel.model" not in data.lower():
        raise FormatError("it is a ZIP archive without a model of 3MF; unpack it")
    _require("lxml", "networkx")
    return read_in_child(data, "trimesh", ".3mf")


def _require(*packages: str) -> None:
    for name in packages:
        if find_spec(name) is None:
            raise FormatError(f"it needs {name}, which is not installed; pip install 'supple[formats]'")


def read_file(path: Path) -> MeshFile:
    """The same, in this process."""
    if path.suffix == ".dae":
        return _read_dae(path)
    import trimesh

    data, kind = path.read_bytes(), path.suffix[1:]
    if kind != "3mf":
        _refuse_what_is_skipped(data)
    # Without a path, so that no other file can be read.
    scene = trimesh.load_scene(io.BytesIO(data), file_type=kind, process=False, skip_materials=True)
    meshes = [mesh for mesh in scene.dump() if isinstance(mesh, trimesh.Trimesh)]
    unit = 1.0
    if kind == "3mf":
        units = {str(mesh.units or "millimeter").removesuffix("s") for mesh in meshes}
        unit = _UNITS[units.pop()] if units <= _UNITS.keys() and len(units) == 1 else 1e-3
    return _joined([(np.asarray(mesh.vertices) * unit, np.asarray(mesh.faces)) for mesh in meshes])


def _joined(parts: list[tuple[NDArray, NDArray]], notes: tuple[str, ...] = (), up: str = "y") -> MeshFile:
    if not any(len(triangles) for _, triangles in parts):
        raise FormatError("its scene has no triangles" + "".join(f"; {note}" for note in notes))
    if any(np.ndim(points) != 2 or np.shape(points)[1] != 3 for points, _ in parts):
        raise FormatError("its points do not have three coordinates each")
    starts = np.cumsum([0, *(len(points) for points, _ in parts)])
    points = np.concatenate([points for points, _ in parts]).astype(np.float64)
    triangles = [rows.astype(np.int64) + start for (_, rows), start in zip(parts, starts, strict=False)]
    return MeshFile(CellSoup.of_rows(points, np.concatenate(triangles), TRIANGLE), notes=notes, up=up)


def _refuse_what_is_skipped(data: bytes) -> None:
    """Raise where trimesh would leave out a part without an error: fans of triangles, and what an extension packs."""
    text = data[20 : 20 + int.from_bytes(data[12:16], "little")] if data.startswith(b"glTF") else data
    document = json.loads(text)
    needed = document.get("extensionsRequired")
    if needed:
        raise FormatError(f"it needs the extension {str(needed[0])[:60]!r}; export it without")
    modes = [node.get("mode") for mesh in document.get("meshes", []) for node in mesh.get("primitives", [])]
    if _FAN in modes:
        raise FormatError("it has fans of triangles; export it with triangles")


def _read_dae(path: Path) -> MeshFile:
    """All geometries of the scene, in metres."""
    import collada
    from collada.common import DaeError

    tree = ElementTree.parse(path)
    for parent in tree.iter():  # errors of materials would hide what is made of them
        for child in list(parent):
            if child.tag.rpartition("}")[2] in _UNREAD:
                parent.remove(child)
    data = io.BytesIO(ElementTree.tostring(tree.getroot()))
    document = collada.Collada(data, ignore=[DaeError])
    asset = document.assetInfo
    unit = 1.0 if asset is None or asset.unitmeter is None else float(asset.unitmeter)
    up = str((asset and asset.upaxis) or "Y_UP")[0].lower()
    if document.scene is None:
        raise FormatError("it has no scene")
    parts: list[tuple[NDArray, NDArray]] = []
    for geometry in document.scene.objects("geometry"):
        # The matrix of a placement that mirrors turns triangles inside out.
        order = [0, 2, 1] if np.linalg.det(np.asarray(geometry.matrix)[:3, :3]) < 0.0 else [0, 1, 2]
        for primitive in geometry.primitives():
            triangles = _triangles(primitive)
            if triangles is not None:
                parts.append((unit * np.asarray(triangles.vertex), np.asarray(triangles.vertex_index)[:, order]))
    return _joined(parts, tuple(_left_out(document)), up)


def _triangles(primitive: Any) -> Any:
    """A set of triangles or polygons as triangles; None of lines, and of what is empty."""
    made = primitive.triangleset() if hasattr(primitive, "triangleset") else primitive
    is_set = type(made).__name__.endswith("TriangleSet") and made.vertex is not None
    return made if is_set and made.vertex_index is not None and len(made.vertex_index) else None


def _left_out(document: Any) -> list[str]:
    """What of a document pycollada has not read."""
    notes = []
    skins = sum(str(node.tag).endswith("}instance_controller") for node in document.xmlnode.iter())
    if skins:
        notes.append(f"its {skins} surfaces with skins or morphs were left out; export it without")
    if document.errors:
        first = " ".join(str(document.errors[0]).split())[:100]
        notes.append(f"{len(document.errors)} of its parts cannot be read, the first: {first}")
    return notes
