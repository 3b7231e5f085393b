"""Binary glTF 2.0 by trimesh: the triangles of its default scene, each mesh where its nodes place it.

glTF has metres and y up, as Supple does. Skins, morph targets and materials are ignored.
"""

from __future__ import annotations

import io
import json
from pathlib import Path

import numpy as np

from supple.mesh.io.cells import TRIANGLE, CellSoup, FormatError, MeshFile
from supple.mesh.io.in_child import read_in_child

_FAN = 6  # of the modes of primitives


def read_glb(data: bytes) -> CellSoup:
    """Triangles of a GLB file."""
    if not data.startswith(b"glTF"):
        raise FormatError("it does not begin as a GLB file does; save glTF as one binary file (.glb)")
    return read_in_child(data, "trimesh", ".glb").soup


def read_file(path: Path) -> MeshFile:
    """The same, in this process."""
    import trimesh

    data = path.read_bytes()
    _refuse_what_is_skipped(data)
    # Without a path, so that no other file can be read.
    scene = trimesh.load_scene(io.BytesIO(data), file_type="glb", process=False, skip_materials=True)
    meshes = scene.dump()
    points, triangles, count = [np.zeros((0, 3))], [np.zeros((0, 3), dtype=np.int64)], 0
    for mesh in meshes:
        if isinstance(mesh, trimesh.Trimesh):
            points.append(np.asarray(mesh.vertices, dtype=np.float64))
            triangles.append(np.asarray(mesh.faces, dtype=np.int64) + count)
            count += len(mesh.vertices)
    if len(triangles) == 1:
        raise FormatError("its scene has no triangles")
    return MeshFile(CellSoup.of_rows(np.concatenate(points), np.concatenate(triangles), TRIANGLE))


def _refuse_what_is_skipped(data: bytes) -> None:
    """Raise where trimesh would leave out a part without an error: fans of triangles, and what an extension packs."""
    document = json.loads(data[20 : 20 + int.from_bytes(data[12:16], "little")])
    needed = document.get("extensionsRequired")
    if needed:
        raise FormatError(f"it needs the extension {str(needed[0])[:60]!r}; export it without")
    modes = [each.get("mode") for mesh in document.get("meshes", []) for each in mesh.get("primitives", [])]
    if _FAN in modes:
        raise FormatError("it has fans of triangles; export it with triangles")
