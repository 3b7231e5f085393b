"""The part of a recording that no frame changes: bodies, skins, obstacles and their arrays."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from supple.errors import MeshError, SceneError
from supple.mesh.skin import Embedding
from supple.mesh.surface import SurfaceMesh
from supple.model.state import Status
from supple.model.system import System
from supple.results.frame import Frame
from supple.results.recording.actions.stitches import write_stitches
from supple.results.recording.checked_hdf5 import CheckedFile
from supple.results.recording.physics import write_physics
from supple.results.recording.skinned_surface import SkinnedSurface
from supple.scene.body import PlacedBody
from supple.scene.obstacles.obstacle import Obstacle, Surface
from supple.scene.obstacles.registry import KINDS, restored_obstacle
from supple.scene.rigid.rigid_body import RigidBody

FORMAT_VERSION = 3
VTK_TETRA, VTK_QUADRATIC_TETRA = 10, 24


@dataclass(frozen=True, eq=False)
class RecordedBody:
    """One body of a recording.

    Attributes
    ----------
    name : of the body; material : its kind and parameters, as text
    vertices, tets : rows of the recording's arrays that belong to it
    triangles : (t, 3) its boundary, counter-clockwise from outside, rows of its own vertices
    skin : a finer surface that it carries, or None; its corners are rows of its own vertices
    rigid : whether its vertices are the control points of a rigid body, whose surface is the skin
    touches_with_skin : whether the skin is what touches other things
    """

    name: str
    material: str
    vertices: slice
    tets: slice
    triangles: NDArray[np.int32]
    skin: SkinnedSurface | None
    rigid: bool = False
    touches_with_skin: bool = False

    @property
    def point_count(self) -> int:
        """How many points a frame has of it."""
        own = self.vertices.stop - self.vertices.start
        return len(self.skin.corners) if self.rigid and self.skin is not None else own

    def points(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Positions or velocities (k, 3) as a frame has them, of values x (n, 3) of all vertices of the recording."""
        own = x[self.vertices]
        return self.skin.positions(own) if self.rigid and self.skin is not None else own


@dataclass(frozen=True, eq=False)
class RecordedObstacle:
    """One obstacle of a recording, in its place at time 0.

    Attributes
    ----------
    name : of the obstacle; kind : the name of its class, such as "HalfSpace"
    parameters : friction, and what it was made with
    vertices, triangles : of a TriangleObstacle, otherwise empty
    """

    name: str
    kind: str
    parameters: dict[str, Any]
    vertices: NDArray[np.float64]
    triangles: NDArray[np.int32]

    @cached_property
    def obstacle(self) -> Obstacle:
        """The obstacle itself, without its motion.

        Raises
        ------
        KeyError, TypeError, ValueError, SuppleError : where no known kind of obstacle has these parameters.
        """
        values = {"name": self.name, **self.parameters}
        if len(self.triangles):
            values["surface"] = SurfaceMesh(self.vertices, self.triangles)
        return restored_obstacle(self.kind, values)


def write_scene(file: h5py.File, first: Frame, facts: dict[str, Any], scene_text: str | None) -> None:
    """Write the part that no frame changes; `facts` are added to the header."""
    system = first.system
    n, m = len(system.rest_positions), len(system.tets)
    _write_grid(file.require_group("VTKHDF"), first, n, m)
    own = file.create_group("supple")
    own.attrs["format_version"] = FORMAT_VERSION
    header = facts | {
        "statuses": [str(status) for status in Status],
        "bodies": _described_bodies(system),
        "obstacles": [_describe_obstacle(obstacle) for obstacle in system.obstacles],
        "physics": write_physics(own, system),
    }
    own["header"] = json.dumps(header)
    if scene_text is not None:
        own["scene"] = scene_text
    own["rest_positions"] = system.rest_positions
    own["rest_volumes"] = system.rest_volumes
    own["masses"] = system.masses
    own["gravity"] = system.gravity
    own["tets"] = system.tets
    if system.quadratic is not None:
        own["quadratic/rows"], own["quadratic/nodes"] = system.quadratic.rows, system.quadratic.nodes
    own["triangles"] = np.concatenate([p.body.mesh.surface.triangles + p.vertices.start for p in system.bodies])
    own["pinned_vertices"] = system.pinned_vertices
    write_stitches(own, system)
    for i, part in enumerate(system.bodies):
        body = part.body
        if body.skin is not None:
            skin = body.skin.compact()
            group = own.create_group(f"skins/{i}")
            group["corners"], group["weights"] = _attached(body, skin)
            group["triangles"] = skin.triangles
    for i, obstacle in enumerate(system.obstacles):
        if obstacle.surface_mesh is not None:
            surface = obstacle.surface_mesh.compact()
            group = own.create_group(f"obstacles/{i}")
            group["vertices"], group["triangles"] = surface.vertices, surface.triangles


def _attached(body: PlacedBody, skin: SurfaceMesh) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """Corners and weights (k, 4) of the skin's vertices, (k, 10) of quadratic tets; of a rigid body those that the
    simulation has."""
    if isinstance(body, RigidBody):
        return np.tile(np.arange(4, dtype=np.int32), (len(body.weights), 1)), body.weights
    attached = Embedding.of(body.mesh, skin.vertices)
    return attached.corners, attached.weights


def _write_grid(grid: h5py.Group, first: Frame, n: int, m: int) -> None:
    system = first.system
    grid.attrs.create("Version", np.array([2, 2], dtype=np.int64))
    grid.attrs.create("Type", np.bytes_("UnstructuredGrid"))
    cells = [part.body.mesh.nodes + part.vertices.start for part in system.bodies]
    widths = np.concatenate([np.full(len(nodes), nodes.shape[1], dtype=np.int64) for nodes in cells])
    for name, count in (("NumberOfPoints", n), ("NumberOfCells", m), ("NumberOfConnectivityIds", widths.sum())):
        grid[name] = np.array([count], dtype=np.int64)
    grid["Connectivity"] = np.concatenate([nodes.ravel() for nodes in cells]).astype(np.int64)
    grid["Offsets"] = np.concatenate([[0], np.cumsum(widths)])
    grid["Types"] = np.where(widths == 4, VTK_TETRA, VTK_QUADRATIC_TETRA).astype(np.uint8)
    of_point, of_cell = np.zeros(n, dtype=np.int32), np.zeros(m, dtype=np.int32)
    for i, part in enumerate(system.bodies):
        of_point[part.vertices], of_cell[part.tets] = i, i
    grid["PointData/body"], grid["CellData/body"] = of_point, of_cell


def _described_bodies(system: System) -> list[dict[str, Any]]:
    """The bodies with their rows; those of triangles are of the boundaries of the tets."""
    described, t = [], 0
    for part in system.bodies:
        body, count = part.body, len(part.body.mesh.surface.triangles)
        rigid = isinstance(body, RigidBody)
        described.append(
            {
                "name": part.name,
                "material": f"rigid, {body.properties.mass:.6g} kg" if rigid else _one_line(body.material),
                "vertices": [int(part.vertices.start), int(part.vertices.stop)],
                "tets": [int(part.tets.start), int(part.tets.stop)],
                "triangles": [t, t + count],
                "skin": body.skin is not None,
                "rigid": rigid,
                "collide": "skin" if body.touches_with_skin else "tets",
            }
        )
        t += count
    return described


def _one_line(thing: object) -> str:
    text = " ".join(repr(thing).split())
    return text if len(text) <= 500 else text[:499] + "…"


def _describe_obstacle(obstacle: Obstacle) -> dict[str, Any]:
    numbers = {"friction": float(obstacle.friction), **obstacle.values()}
    return {"name": obstacle.name or obstacle.label, "kind": type(obstacle).__name__, "parameters": numbers}


def read_header(file: CheckedFile) -> dict[str, Any]:
    """The header of a recording, after a check that the file is a recording of a known version.

    Raises
    ------
    OutputError : where it is not.
    """
    version = file.attribute("supple", "format_version")
    if version is None:
        kind = file.attribute("VTKHDF", "Type")
        other = (
            f"a VTKHDF {kind.decode()} of another program"
            if isinstance(kind, bytes)
            else "an HDF5 file of another kind"
        )
        raise file.other(other)
    if not isinstance(version, (int, np.integer)):
        raise file.broken(f"its format version is {str(version)[:20]!r}")
    if version != FORMAT_VERSION:
        raise file.of_another_version(f"format {version}, this one reads {FORMAT_VERSION}")
    try:
        header = json.loads(file.text("supple/header"))
        dt, lists = float(header["dt"]), [header[key] for key in ("statuses", "bodies", "obstacles", "sensors")]
        acting = [header["physics"][key] for key in ("loads", "actuators", "joints", "welds", "untouching")]
    except (ValueError, TypeError, KeyError):
        raise file.broken("its header is not the expected JSON") from None
    if not all(isinstance(item, list) for item in lists) or not header["bodies"] or not dt > 0.0:
        raise file.broken("its header has no bodies, or no time step")
    if not all(isinstance(item, list) for item in acting):
        raise file.broken("the physics in its header is not described as it should be")
    return header


def read_bodies(
    file: CheckedFile, header: dict[str, Any], n: int, m: int, triangles: NDArray[np.int32]
) -> tuple[RecordedBody, ...]:
    """The bodies of a recording with n vertices and m tets."""
    bodies = []
    try:
        for i, described in enumerate(header["bodies"]):
            ends = [(int(a), int(b)) for a, b in (described["vertices"], described["tets"], described["triangles"])]
            (v0, v1), (t0, t1), (f0, f1) = ends
            if not (0 <= v0 < v1 <= n and 0 <= t0 < t1 <= m and 0 <= f0 <= f1 <= len(triangles)):
                raise file.broken(f"body {described['name']!r} has rows {ends}, outside of {n} vertices and {m} tets")
            own = triangles[f0:f1] - np.int32(v0)
            if own.size and (own.min() < 0 or own.max() >= v1 - v0):
                raise file.broken(f"body {described['name']!r} has triangles on vertices of another")
            skin = _read_skin(file, f"supple/skins/{i}", v1 - v0) if described["skin"] else None
            rows = slice(v0, v1), slice(t0, t1)
            names = str(described["name"]), str(described["material"])
            rigid = bool(described["rigid"])
            if rigid and (skin is None or v1 - v0 != 4 or t1 - t0 != 1):
                raise file.broken(f"rigid body {described['name']!r} does not have four vertices and a surface")
            touches = skin is not None and (rigid or described["collide"] == "skin")
            bodies.append(RecordedBody(*names, *rows, np.ascontiguousarray(own), skin, rigid, touches))
    except (KeyError, TypeError, ValueError):
        raise file.broken("the bodies in its header are not described as they should be") from None
    return tuple(bodies)


def _read_skin(file: CheckedFile, path: str, vertices: int) -> SkinnedSurface:
    width = file.array(f"{path}/corners", "i", (None, None)).shape[1]
    if width not in (4, 10):
        raise file.broken(f"{path}/corners has {width} columns; a skin's vertices have 4 corners or 10 nodes")
    corners = file.indices(f"{path}/corners", width, vertices)
    weights = file.array(f"{path}/weights", "f", corners.shape)
    return SkinnedSurface(corners, weights, file.indices(f"{path}/triangles", 3, len(corners)))


def read_obstacles(file: CheckedFile, header: dict[str, Any]) -> tuple[RecordedObstacle, ...]:
    """The obstacles of a recording."""
    obstacles = []
    try:
        for i, described in enumerate(header["obstacles"]):
            vertices, triangles = np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int32)
            name, kind, path = str(described["name"]), str(described["kind"]), f"supple/obstacles/{i}"
            if kind not in KINDS:
                raise file.broken(f"obstacle {name!r} is of an unknown kind, {kind!r}; register the kind first")
            if any(isinstance(one.form, Surface) for one in KINDS[kind].parameters().values()):
                vertices = file.array(f"{path}/vertices", "f", (None, 3))
                triangles = file.indices(f"{path}/triangles", 3, len(vertices))
            obstacles.append(RecordedObstacle(name, kind, dict(described["parameters"]), vertices, triangles))
            _ = obstacles[-1].obstacle
    except (KeyError, TypeError, ValueError, SceneError, MeshError):
        raise file.broken("the obstacles in its header are not described as they should be") from None
    return tuple(obstacles)
