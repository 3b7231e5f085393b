"""Binary glTF 2.0: the triangles of its default scene, each mesh where its nodes place it.

Source: Khronos, "glTF 2.0 Specification", sections 3.5 (scenes and nodes), 3.6 (buffers and accessors) and 4.4 (GLB).
Skins, morph targets and materials are ignored. glTF has metres and y up, as Supple does.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.mesh.io.cells import TRIANGLE, CellSoup, FormatError

_MAGIC, _JSON, _BINARY = 0x46546C67, 0x4E4F534A, 0x004E4942
_NUMBERS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC3": 3}
_TRIANGLES, _STRIP, _FAN = 4, 5, 6
_MOST_POINTS = 30_000_000  # of all nodes: many may place the same mesh


def read(data: bytes) -> CellSoup:
    """Triangles of a GLB file."""
    document, binary = _chunks(data)
    reader = _Accessors(document, binary)
    points: list[NDArray[np.float64]] = []
    triangles: list[NDArray[np.int64]] = []
    count = 0
    for number, place in _placed_meshes(document):
        for primitive in _list(_item(document, "meshes", number), "primitives"):
            found = _primitive(reader, primitive)
            if found is None:
                continue
            x, rows = found
            with np.errstate(all="ignore"):  # what is not finite is reported later, with its vertex
                if np.linalg.det(place[:3, :3]) < 0.0:  # a mirror turns triangles around
                    rows = rows[:, ::-1]
                points.append(x @ place[:3, :3].T + place[:3, 3])
            triangles.append(rows + count)
            count += len(x)
            if count > _MOST_POINTS:
                raise FormatError(f"its scene has more than {_MOST_POINTS} vertices; export a simpler one")
    if not triangles:
        raise FormatError("its scene has no triangles")
    return CellSoup.of_rows(np.concatenate(points), np.concatenate(triangles), TRIANGLE)


def _chunks(data: bytes) -> tuple[dict[str, Any], bytes]:
    """The description, and the binary chunk."""
    if len(data) < 20 or struct.unpack_from("<I", data)[0] != _MAGIC:
        raise FormatError("it does not begin as a GLB file does; save glTF as one binary file (.glb)")
    version, length = struct.unpack_from("<II", data, 4)
    if version != 2:
        raise FormatError(f"it has version {version} of glTF; only version 2 can be read")
    if length > len(data):
        raise FormatError(f"it should have {length} bytes, and has {len(data)}: it is truncated")
    found: dict[int, bytes] = {}
    at = 12
    while at + 8 <= length:
        size, kind = struct.unpack_from("<II", data, at)
        if at + 8 + size > length:
            raise FormatError(f"a chunk of {size} bytes at byte {at} goes beyond its end")
        found.setdefault(kind, data[at + 8 : at + 8 + size])
        at += 8 + size
    try:
        document = json.loads(found.get(_JSON, b""))
    except (ValueError, RecursionError):
        raise FormatError("its JSON chunk cannot be read") from None
    if not isinstance(document, dict):
        raise FormatError("its JSON chunk is no description of a scene")
    needed = document.get("extensionsRequired", [])
    if needed:
        first = needed[0] if isinstance(needed, list) else needed
        raise FormatError(f"it needs the extension {str(first)[:60]!r}; export it without")
    return document, found.get(_BINARY, b"")


def _list(parent: dict[str, Any], key: str) -> list[Any]:
    value = parent.get(key, [])
    if not isinstance(value, list):
        raise FormatError(f"{key} is not a list")
    return value


def _item(parent: dict[str, Any], key: str, number: Any) -> dict[str, Any]:
    """Object `number` of the list `key`."""
    items = _list(parent, key)
    if isinstance(number, bool) or not isinstance(number, int) or not 0 <= number < len(items):
        raise FormatError(f"it names {key}[{number!r}], and has {len(items)} {key}")
    if not isinstance(items[number], dict):
        raise FormatError(f"{key}[{number}] is not an object")
    return items[number]


def _numbers(parent: dict[str, Any], key: str, default: list[float]) -> NDArray[np.float64]:
    value = parent.get(key, default)
    try:
        if isinstance(value, list) and len(value) == len(default):
            return np.array([float(number) for number in value])
    except (TypeError, ValueError, OverflowError):
        pass
    raise FormatError(f"{key} of a node is not {len(default)} numbers")


def _placed_meshes(document: dict[str, Any]) -> Iterator[tuple[int, NDArray[np.float64]]]:
    """Number of each mesh of the default scene, and its (4, 4) place; without scenes, of all roots."""
    if _list(document, "scenes"):
        roots = _list(_item(document, "scenes", document.get("scene", 0)), "nodes")
    else:
        nodes = _list(document, "nodes")
        below = [child for node in nodes if isinstance(node, dict) for child in _list(node, "children")]
        children = {child for child in below if isinstance(child, int)}
        roots = [number for number in range(len(nodes)) if number not in children]
    waiting = [(number, np.eye(4)) for number in reversed(roots)]
    seen: set[int] = set()
    while waiting:
        number, above = waiting.pop()
        node = _item(document, "nodes", number)
        if number in seen:
            raise FormatError(f"nodes[{number}] is below two nodes, or below itself")
        seen.add(number)
        with np.errstate(all="ignore"):
            place = above @ _local(node)
        if "mesh" in node:
            yield node["mesh"], place
        waiting += [(child, place) for child in reversed(_list(node, "children"))]


def _local(node: dict[str, Any]) -> NDArray[np.float64]:
    """The (4, 4) transformation of a node: its matrix (column by column), or translation, rotation and scale."""
    if "matrix" in node:
        return _numbers(node, "matrix", [0.0] * 16).reshape(4, 4).T
    x, y, z, w = _numbers(node, "rotation", [0.0, 0.0, 0.0, 1.0])
    R = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    place = np.eye(4)
    place[:3, :3] = R * _numbers(node, "scale", [1.0, 1.0, 1.0])
    place[:3, 3] = _numbers(node, "translation", [0.0, 0.0, 0.0])
    return place


class _Accessors:
    """Arrays of the binary chunk."""

    def __init__(self, document: dict[str, Any], binary: bytes) -> None:
        self._document, self._binary = document, binary

    def array(self, number: Any, kind: str) -> NDArray[Any]:
        """Accessor `number` of the type `kind`: (count, width)."""
        accessor = _item(self._document, "accessors", number)
        if accessor.get("type") != kind or accessor.get("componentType") not in _NUMBERS:
            raise FormatError(f"accessors[{number}] is not of type {kind}, or of unknown numbers")
        if "sparse" in accessor or "bufferView" not in accessor:
            raise FormatError(f"accessors[{number}] is sparse; export the file without sparse accessors")
        view = _item(self._document, "bufferViews", accessor["bufferView"])
        buffer = _item(self._document, "buffers", view.get("buffer"))
        if "uri" in buffer or view["buffer"] != 0:
            raise FormatError("its arrays are in another file; save it as one file (.glb)")
        number_type, width = np.dtype(_NUMBERS[accessor["componentType"]]), _WIDTHS[kind]
        element = number_type.itemsize * width
        count, stride = _size(accessor, "count", None), _size(view, "byteStride", element)
        begin = _size(view, "byteOffset", 0) + _size(accessor, "byteOffset", 0)
        if stride < element or count == 0 or begin + (count - 1) * stride + element > len(self._binary):
            raise FormatError(f"accessors[{number}] goes beyond the {len(self._binary)} bytes of the file")
        return np.ndarray((count, width), number_type, self._binary, begin, (stride, number_type.itemsize))


def _size(parent: dict[str, Any], key: str, default: int | None) -> int:
    value = parent.get(key, default)
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value < 2**48:
        raise FormatError(f"{key} is {value!r}; it must be a whole number of zero or more")
    return value


def _primitive(reader: _Accessors, primitive: Any) -> tuple[NDArray[np.float64], NDArray[np.int64]] | None:
    """Points (n, 3) and triangles (m, 3) of one part of a mesh; None for points and lines."""
    if not isinstance(primitive, dict) or not isinstance(primitive.get("attributes"), dict):
        raise FormatError("a primitive has no attributes")
    mode = primitive.get("mode", _TRIANGLES)
    if mode not in (_TRIANGLES, _STRIP, _FAN) or "POSITION" not in primitive["attributes"]:
        return None
    points = reader.array(primitive["attributes"]["POSITION"], "VEC3").astype(np.float64)
    if "indices" in primitive:
        flat = reader.array(primitive["indices"], "SCALAR").ravel()
        if flat.dtype.kind != "u":
            raise FormatError("indices of a primitive are not whole numbers")
        flat = flat.astype(np.int64)
        if len(flat) and flat.max() >= len(points):
            raise FormatError(f"a primitive names vertex {flat.max()}, and has {len(points)} vertices")
    else:
        flat = np.arange(len(points))
    return points, _rows(flat, mode)


def _rows(flat: NDArray[np.int64], mode: int) -> NDArray[np.int64]:
    """Triangles (m, 3) of a list of corners."""
    if mode == _TRIANGLES:
        if len(flat) % 3:
            raise FormatError(f"a primitive of triangles has {len(flat)} corners, which is no multiple of three")
        return flat.reshape(-1, 3)
    j = np.arange(max(len(flat) - 2, 0))
    if mode == _FAN:
        return flat[np.column_stack([0 * j, j + 1, j + 2])]
    odd = j % 2  # every second triangle of a strip runs the other way
    return flat[np.column_stack([j, j + 1 + odd, j + 2 - odd])]
