"""Binary glTF 2.0: one mesh for each body, a morph target for each frame, and their weights animated. Rigid bodies and
obstacles have animated nodes.

Source: Khronos, "glTF 2.0 Specification", sections 3.7.2.2 (morph targets) and 3.11 (animations). glTF is y up, in
metres, as in Supple.
"""

from __future__ import annotations

import json
import logging
import struct
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.results.export.recorded_fields import fields_on
from supple.results.recording.reader import Recording
from supple.results.view.from_recording import evenly, model_of_recording, render_frame_of
from supple.results.view.model import RenderFrame
from supple.results.view.normals import vertex_normals
from supple.results.view.surfaces import RigidSurface, SoftSurface, surfaces_of
from supple.runtime.replacing import whole_file

logger = logging.getLogger(__name__)

# The size of the weights grows with the square of this number, and importers are slow with many targets.
_MOST_FRAMES = 300
_FLOAT, _UNSIGNED = 5126, 5125
_VERTICES, _INDICES = 34962, 34963


def write_glb(recording: Recording, output: Path) -> None:
    """Write bodies (their skins, where they have one) and obstacles; at most 300 frames, evenly spaced."""
    frames = evenly(len(recording), _MOST_FRAMES)
    if len(frames) < len(recording):
        logger.warning("%s: holds %d of %d frames, evenly spaced", output, len(frames), len(recording))
    model = model_of_recording(recording)
    glb = _Glb([render_frame_of(model, recording[k]) for k in frames])
    for plain in surfaces_of(model):
        surface = plain.creased(model)
        fields = []
        if isinstance(surface, SoftSurface) and recording.fields:
            render_frames = zip(frames, glb.render_frames, strict=True)
            fields = [fields_on(surface, recording, recording[k], render_frame) for k, render_frame in render_frames]
        glb.add(surface, fields)
    with whole_file(output) as fresh:
        fresh.write_bytes(glb.to_bytes())


class _Glb:
    """A glTF document and its one buffer, to which meshes are added."""

    def __init__(self, render_frames: list[RenderFrame]) -> None:
        self.render_frames = render_frames
        self.blob = bytearray()
        self.document: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": "Supple"},
            "scene": 0,
            "scenes": [{"nodes": []}],
            **{kind: [] for kind in ("nodes", "meshes", "materials", "accessors", "bufferViews")},
        }
        self.channels: list[dict[str, Any]] = []
        self.samplers: list[dict[str, Any]] = []
        times = np.array([render_frame.time for render_frame in render_frames])
        self.times = self._accessor((times - times[0])[:, None], "SCALAR", bounds=True)

    def add(self, surface: SoftSurface | RigidSurface, fields: list[dict[str, NDArray]]) -> None:
        """Add a mesh: of a rigid one, the poses of its node are animated; of a soft one, target k gives frame k.

        fields : of a soft one for each frame, by name; they become attributes of vertices such as `_VON_MISES`
        """
        triangles = surface.triangles
        if isinstance(surface, RigidSurface):
            x, normals = surface.vertices, vertex_normals(surface.vertices, triangles)
            material = self._material(surface, surface.opacity)
            node = self._mesh_node(surface.name, x, normals, triangles, material, [], {})
            self._place(node, np.stack([surface.pose(render_frame) for render_frame in self.render_frames]))
            return
        x0 = surface.at(self.render_frames[0])
        n0 = vertex_normals(x0, triangles)
        targets = []
        for k, render_frame in enumerate(self.render_frames[1:], 1):
            x = surface.at(render_frame)
            normals = vertex_normals(x, triangles)
            targets.append({"POSITION": self._vectors(x - x0, bounds=True), "NORMAL": self._vectors(normals - n0)})
            if fields:
                targets[-1] |= self._attributes({name: fields[k][name] - first for name, first in fields[0].items()})
        own = self._attributes(fields[0]) if fields else {}
        node = self._mesh_node(surface.name, x0, n0, triangles, self._material(surface, 1.0), targets, own)
        if targets:
            self._animate(node, "weights", self._weights)

    def to_bytes(self) -> bytes:
        """The whole file."""
        document = {**self.document, "buffers": [{"byteLength": len(self.blob)}]}
        if self.channels:
            document["animations"] = [{"name": "recording", "channels": self.channels, "samplers": self.samplers}]
        text = json.dumps(document, separators=(",", ":")).encode()
        chunks = b"".join(
            struct.pack("<I4s", len(data) + -len(data) % 4, kind) + data + pad * (-len(data) % 4)
            for kind, data, pad in ((b"JSON", text, b" "), (b"BIN\0", self.blob, b"\0"))
        )
        return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks

    @cached_property
    def _weights(self) -> int:
        """Target k has weight 1 in frame k and 0 in all others; the first frame is the mesh itself."""
        k = len(self.render_frames)
        return self._accessor(np.eye(k, k - 1, -1).reshape(-1, 1), "SCALAR")

    def _attributes(self, fields: dict[str, NDArray]) -> dict[str, int]:
        """Accessors of fields (k, components); a tensor of nine components as three vectors, its rows."""
        found = {}
        for name, values in fields.items():
            key = f"_{name.upper()}"
            if values.shape[1] == 9:
                found |= {f"{key}_{row}": self._vectors(values[:, 3 * row : 3 * row + 3]) for row in range(3)}
            else:
                kind = "SCALAR" if values.shape[1] == 1 else f"VEC{values.shape[1]}"
                found[key] = self._accessor(values, kind, target=_VERTICES)
        return found

    def _mesh_node(
        self,
        name: str,
        x: NDArray,
        normals: NDArray,
        triangles: NDArray,
        material: int,
        targets: list[dict[str, int]],
        fields: dict[str, int],
    ) -> int:
        primitive: dict[str, Any] = {
            "attributes": {"POSITION": self._vectors(x, bounds=True), "NORMAL": self._vectors(normals), **fields},
            "indices": self._append(triangles.astype("<u4").reshape(-1, 1), _UNSIGNED, "SCALAR", {}, _INDICES),
            "material": material,
        }
        mesh: dict[str, Any] = {"name": name, "primitives": [primitive]}
        if targets:
            primitive["targets"], mesh["weights"] = targets, [0.0] * len(targets)
        node = self._added("nodes", {"name": name, "mesh": self._added("meshes", mesh)})
        self.document["scenes"][0]["nodes"].append(node)
        return node

    def _place(self, node: int, poses: NDArray[np.float64]) -> None:
        """Place a node by the first of its poses (frames, 3, 4), and animate it where they change."""
        rotations = _quaternions(poses[:, :, :3])
        self.document["nodes"][node].update(translation=poses[0, :, 3].tolist(), rotation=rotations[0].tolist())
        if np.any(poses != poses[0]):
            self._animate(node, "translation", self._vectors(poses[:, :, 3]))
            self._animate(node, "rotation", self._accessor(rotations, "VEC4"))

    def _animate(self, node: int, path: str, values: int) -> None:
        self.samplers.append({"input": self.times, "output": values, "interpolation": "LINEAR"})
        self.channels.append({"sampler": len(self.samplers) - 1, "target": {"node": node, "path": path}})

    def _material(self, drawn: SoftSurface | RigidSurface, opacity: float) -> int:
        linear = (
            (np.array(drawn.color) / 255.0 + 0.055) / 1.055
        ) ** 2.4  # sRGB; all our colors are above its linear part
        surface = {"baseColorFactor": [*linear.tolist(), opacity], "metallicFactor": drawn.look.metallic}
        surface["roughnessFactor"] = drawn.look.roughness
        more: dict[str, Any] = {"doubleSided": True, "alphaMode": "BLEND"} if opacity < 1.0 else {}
        return self._added("materials", {"pbrMetallicRoughness": surface, **more})

    def _vectors(self, values: NDArray, *, bounds: bool = False) -> int:
        return self._accessor(values, "VEC3", bounds=bounds, target=_VERTICES)

    def _accessor(self, values: NDArray, kind: str, *, bounds: bool = False, target: int | None = None) -> int:
        data = np.ascontiguousarray(np.nan_to_num(values), dtype="<f4")
        limits: dict[str, Any] = {"min": data.min(axis=0).tolist(), "max": data.max(axis=0).tolist()} if bounds else {}
        return self._append(data, _FLOAT, kind, limits, target)

    def _append(self, data: NDArray, component: int, kind: str, limits: dict[str, Any], target: int | None) -> int:
        view: dict[str, Any] = {"buffer": 0, "byteOffset": len(self.blob), "byteLength": data.nbytes}
        if target is not None:
            view["target"] = target
        self.blob += data.tobytes()
        accessor = {"bufferView": self._added("bufferViews", view), "componentType": component, "count": len(data)}
        return self._added("accessors", {**accessor, "type": kind, **limits})

    def _added(self, kind: str, item: dict[str, Any]) -> int:
        """The number of an item that is added to those of its kind."""
        self.document[kind].append(item)
        return len(self.document[kind]) - 1


def _quaternions(R: NDArray[np.float64]) -> NDArray[np.float64]:
    """(k, 4) as (x, y, z, w) of rotations (k, 3, 3), each with the sign that is nearer to the one before it."""
    from scipy.spatial.transform import Rotation

    q = Rotation.from_matrix(R).as_quat()
    signs = np.cumprod(np.where(np.einsum("ij,ij->i", q[1:], q[:-1]) < 0.0, -1.0, 1.0))
    q[1:] *= signs[:, None]
    return q
