"""What a recording keeps of a scene, from the system that is simulated."""

from __future__ import annotations

from collections.abc import Sequence

import h5py
import numpy as np
from numpy.typing import NDArray

from supple.mesh.skin import Embedding
from supple.model.state import Status
from supple.model.system import BodyRange, System
from supple.results.frame import Frame
from supple.results.readings.fields import Field
from supple.results.recording.actions import cables_of, cavities_of, joints_of, recorded_stitches
from supple.results.recording.details import RecordedDetails, recorded_sensors
from supple.results.recording.physics import recorded_physics, recorded_welds, untouching_pairs
from supple.results.recording.scene import QuadraticRows, RecordedBody, RecordedObstacle, RecordedScene, SkinnedSurface
from supple.scene.rigid.rigid_body import RigidBody

VTK_TETRA, VTK_QUADRATIC_TETRA = 10, 24


def recorded_scene(
    first: Frame, timing: tuple[float, int], solver: str | None, scene_text: str | None, fields: Sequence[Field]
) -> RecordedScene:
    """All that no frame changes; `timing` is the time from frame to frame [s] and the number of frames to come."""
    from supple import __version__

    system = first.system
    curved, loads = system.quadratic, [(f"{load.work}.{k}", load.pattern) for k, load in enumerate(system.loads)]
    return RecordedScene(
        supple_version=__version__,
        dt=float(timing[0]),
        steps=int(timing[1]),
        solver=solver,
        scene_text=scene_text,
        rest_positions=system.rest_positions,
        tets=system.tets,
        quadratic=None if curved is None else QuadraticRows(curved.rows.astype(np.int32), curved.nodes),
        rest_volumes=system.rest_volumes,
        masses=system.masses,
        gravity=system.gravity,
        pinned_vertices=system.pinned_vertices,
        bodies=tuple(map(_body, system.bodies)),
        obstacles=tuple(map(RecordedObstacle.of, system.obstacles)),
        physics=recorded_physics(system),
        untouching=untouching_pairs(system),
        welds=recorded_welds(system),
        joints=joints_of(system),
        loads={name: pattern for name, pattern in loads if pattern is not None},
        other_loads=frozenset(load.work for load in system.loads if load.pattern is None),
        cavities=cavities_of(system),
        cables=cables_of(system),
        stitches=recorded_stitches(system),
        details=RecordedDetails.like(first.report.details),
        field_names=tuple(field.name for field in fields),
        sensors=recorded_sensors(system.scene),
        statuses_of_codes=tuple(str(status) for status in Status),
    )


def _body(part: BodyRange) -> RecordedBody:
    body = part.body
    rigid = isinstance(body, RigidBody)
    skin = None
    if body.skin is not None:
        surface = body.skin.compact()
        corners, weights = _attached(part, surface.vertices)
        skin = SkinnedSurface(corners, weights, surface.triangles)
    return RecordedBody(
        part.name,
        f"rigid, {body.properties.mass:.6g} kg" if isinstance(body, RigidBody) else _one_line(body.material),
        part.vertices,
        part.tets,
        np.asarray(body.mesh.surface.triangles, dtype=np.int32),
        skin,
        rigid,
        bool(body.touches_with_skin),
        body.drawn_look,
    )


def _attached(part: BodyRange, points: NDArray[np.float64]) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """Corners and weights (k, 4) of the skin's vertices, (k, 10) of quadratic tets; of a rigid body those that the
    simulation has."""
    body = part.body
    if isinstance(body, RigidBody):
        return np.tile(np.arange(4, dtype=np.int32), (len(body.weights), 1)), body.weights
    attached = Embedding.of(body.mesh, points)
    return attached.corners, attached.weights


def _one_line(thing: object) -> str:
    text = " ".join(repr(thing).split())
    return text if len(text) <= 500 else text[:499] + "…"


def write_grid(grid: h5py.Group, system: System) -> None:
    """Write what VTK needs to know of the tets."""
    n, m = len(system.rest_positions), len(system.tets)
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
