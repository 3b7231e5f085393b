"""Binary glTF 2.0 with animated morph targets and nodes.

Source: Khronos, "glTF 2.0 Specification", sections 3.6.2 (accessors), 3.7.2.2 (morph targets), 3.11 (animations).
Each frame is one of the animation's key times. Skins are not applied.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.mesh.io.cells import FormatError
from supple.mesh.io.libraries.positions_file import Facts, written_series

_TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
_PATHS = ("translation", "rotation", "scale", "weights")


def read_series(path: Path, out: Path) -> Facts:
    """The meshes of the default scene at all key times."""
    document, blob = _chunks(path.read_bytes())
    if document.get("extensionsRequired"):
        raise FormatError(f"it needs the extension {str(document['extensionsRequired'][0])[:60]!r}; export it without")
    glb = _Glb(document, blob)
    meshes = list(glb.placed())
    if not meshes:
        raise FormatError("its scene has no triangles")
    times = np.unique(np.concatenate([np.zeros(0), *(glb.accessor(entry["input"])[:, 0] for entry in glb.samplers)]))
    parts, triangles, count = [], [np.zeros((0, 3), dtype=np.int64)], 0
    for k, mesh in enumerate(meshes):
        triangles.append(mesh.triangles + count)
        parts.append(np.full(len(mesh.base), k))
        count += len(mesh.base)

    def points_of(frame: int) -> NDArray[Any]:
        time = float(times[frame]) if len(times) else None
        return np.concatenate([glb.points(mesh, time) for mesh in meshes])

    cells: dict[str, Any] = {
        "tets": np.zeros((0, 4), dtype=np.int64),
        "triangles": np.concatenate(triangles),
        "part": np.concatenate(parts),
    }
    if len(times):
        cells["times"] = times
    notes = ["skins of glTF are not applied"] if document.get("skins") else []
    return written_series(out, max(1, len(times)), points_of, cells, [mesh.name for mesh in meshes], notes)


def _chunks(data: bytes) -> tuple[dict[str, Any], bytes]:
    if not data.startswith(b"glTF"):
        raise FormatError("it does not begin as a GLB file does; save glTF as one binary file (.glb)")
    at, found = 12, {}
    while at + 8 <= len(data):
        size, kind = int.from_bytes(data[at : at + 4], "little"), data[at + 4 : at + 8]
        found.setdefault(kind, data[at + 8 : at + 8 + size])
        at += 8 + size
    document = json.loads(found.get(b"JSON", b""))
    return document, found.get(b"BIN\0", b"")


@dataclass(eq=False)
class _Placed:
    """A mesh at a node, and the nodes from the root to it."""

    name: str
    nodes: list[int]
    base: NDArray[np.float64]
    triangles: NDArray[np.int64]
    targets: list[NDArray[np.float64]]
    weights: list[float] = field(default_factory=list)


class _Glb:
    def __init__(self, document: dict[str, Any], blob: bytes) -> None:
        self._document, self._blob = document, blob
        self.samplers: list[dict[str, Any]] = []
        self._animated: dict[tuple[int, str], dict[str, Any]] = {}
        for animation in document.get("animations", []):
            for channel in animation["channels"]:
                node, path = channel["target"].get("node"), channel["target"]["path"]
                if node is not None and path in _PATHS:
                    sampler = animation["samplers"][channel["sampler"]]
                    self.samplers.append(sampler)
                    self._animated[node, path] = sampler
        self._read: dict[int, NDArray[Any]] = {}

    def accessor(self, number: int) -> NDArray[Any]:
        """(count, width) of an accessor, sparse ones included."""
        if number not in self._read:
            own = self._document["accessors"][number]
            width, count = _WIDTHS[own["type"]], int(own["count"])
            if "bufferView" in own:
                values = self._view(own["bufferView"], own.get("byteOffset", 0), own["componentType"], count, width)
            else:
                if not 0 <= count * width <= 64 * len(self._blob) + 2**20:
                    raise FormatError(f"accessor {number} claims {count} rows that no data has")
                values = np.zeros((count, width), dtype=_TYPES[own["componentType"]])
            if "sparse" in own:
                few = own["sparse"]
                at, what = few["indices"], few["values"]
                rows = self._view(at["bufferView"], at.get("byteOffset", 0), at["componentType"], few["count"], 1)
                values = values.copy()
                values[rows[:, 0]] = self._view(
                    what["bufferView"], what.get("byteOffset", 0), own["componentType"], few["count"], width
                )
            if own.get("normalized"):
                values = values / float(np.iinfo(values.dtype).max)
            self._read[number] = values
        return self._read[number]

    def _view(self, number: int, offset: int, component: int, count: int, width: int) -> NDArray[Any]:
        view, dtype = self._document["bufferViews"][number], np.dtype(_TYPES[component])
        if view.get("buffer", 0) != 0 or "uri" in self._document["buffers"][0]:
            raise FormatError("its data is in another file; save glTF as one binary file (.glb)")
        begin = view.get("byteOffset", 0) + offset
        stride = view.get("byteStride") or dtype.itemsize * width
        end = begin + stride * (count - 1) + dtype.itemsize * width
        if count < 1 or begin < 0 or end > len(self._blob) or stride < dtype.itemsize * width:
            raise FormatError("an accessor reaches beyond the data: it is truncated or damaged")
        shape, strides = (count, width), (stride, dtype.itemsize)
        return np.ndarray(shape, dtype, self._blob, begin, strides).astype(dtype.newbyteorder("="))

    def placed(self):
        """All meshes of the scene."""
        nodes = self._document.get("nodes", [])
        scenes = self._document.get("scenes", [])
        roots = scenes[self._document.get("scene", 0)]["nodes"] if scenes else range(len(nodes))
        stack = [[root] for root in reversed(list(roots))]
        while stack:
            node_path = stack.pop()
            if len(node_path) > len(nodes):
                raise FormatError("its nodes form a cycle")
            node = nodes[node_path[-1]]
            stack += [[*node_path, child] for child in reversed(node.get("children", []))]
            if "mesh" in node:
                mesh = self._document["meshes"][node["mesh"]]
                found = self._mesh(mesh, node_path, node)
                if found is not None:
                    yield found

    def _mesh(self, mesh: dict[str, Any], node_path: list[int], node: dict[str, Any]) -> _Placed | None:
        base, triangles, targets, count = [], [], [], 0
        for primitive in mesh["primitives"]:
            if primitive.get("mode", 4) != 4:
                if primitive.get("mode") in (5, 6):
                    raise FormatError("it has strips or fans of triangles; export it with triangles")
                continue
            x = self.accessor(primitive["attributes"]["POSITION"]).astype(np.float64)
            rows = self.accessor(primitive["indices"])[:, 0] if "indices" in primitive else np.arange(len(x))
            if len(rows) % 3 or (len(rows) and int(rows.max()) >= len(x)):
                raise FormatError("its triangles name points that do not exist")
            base.append(x)
            triangles.append(rows.astype(np.int64).reshape(-1, 3) + count)
            targets.append(
                [self.accessor(entry["POSITION"]) for entry in primitive.get("targets", []) if "POSITION" in entry]
            )
            count += len(x)
        if not base:
            return None
        if len({len(own) for own in targets}) > 1:
            raise FormatError("the primitives of a mesh have different numbers of morph targets")
        joined = [np.concatenate(entry) for entry in zip(*targets, strict=True)]
        weights = node.get("weights") or mesh.get("weights") or [0.0] * len(joined)
        name = str(node.get("name") or mesh.get("name") or "")
        return _Placed(name, node_path, np.concatenate(base), np.concatenate(triangles), joined, weights)

    def points(self, mesh: _Placed, time: float | None) -> NDArray[np.float64]:
        """The points of a mesh at a time, in the world."""
        weights = self._value(mesh.nodes[-1], "weights", time, len(mesh.targets))
        x = mesh.base.copy()
        for k, weight in enumerate(mesh.weights if weights is None else weights.tolist()):
            if weight != 0.0:
                x += mesh.targets[k] if weight == 1.0 else weight * mesh.targets[k]
        for node in reversed(mesh.nodes):
            x = self._moved(node, x, time)
        return x

    def _moved(self, number: int, x: NDArray[np.float64], time: float | None) -> NDArray[np.float64]:
        node = self._document["nodes"][number]
        if "matrix" in node:
            M = np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T
            return x @ M[:3, :3].T + M[:3, 3]
        scale, turn, shift = (self._value(number, path, time, 1) for path in ("scale", "rotation", "translation"))
        scale = node.get("scale") if scale is None else scale
        turn = node.get("rotation") if turn is None else turn
        shift = node.get("translation") if shift is None else shift
        if scale is not None:
            x = x * np.asarray(scale, dtype=np.float64)
        if turn is not None and not np.array_equal(turn, [0, 0, 0, 1]):
            from scipy.spatial.transform import Rotation

            x = x @ Rotation.from_quat(np.asarray(turn, dtype=np.float64)).as_matrix().T
        return x if shift is None else x + np.asarray(shift, dtype=np.float64)

    def _value(self, node: int, path: str, time: float | None, count: int) -> NDArray[np.float64] | None:
        """An animated value at a time; None where it is not animated."""
        sampler = self._animated.get((node, path))
        if sampler is None or time is None:
            return None
        keys, out = self.accessor(sampler["input"])[:, 0], self.accessor(sampler["output"])
        rows = count if path == "weights" else 1
        if sampler.get("interpolation") == "CUBICSPLINE":
            out = out.reshape(len(keys), 3, rows, -1)[:, 1].reshape(len(keys) * rows, -1)
        if len(out) != len(keys) * rows:
            raise FormatError("an animation has another number of values than of key times")
        out = out.reshape(len(keys), -1).astype(np.float64)
        k = int(np.clip(np.searchsorted(keys, time, side="right") - 1, 0, len(keys) - 1))
        if time <= keys[k] or k + 1 == len(keys) or sampler.get("interpolation") == "STEP":
            return out[k]
        share = (time - keys[k]) / (keys[k + 1] - keys[k])
        a, b = out[k], out[k + 1]
        if path == "rotation":
            b = b if a @ b >= 0.0 else -b
            mixed = (1.0 - share) * a + share * b
            return mixed / np.linalg.norm(mixed)
        return (1.0 - share) * a + share * b
