"""The part of a recording that no frame changes: bodies, skins, obstacles, laws, and what acts on them.

It is written by the codec of checkpoints: a tree of JSON, and beside it an array for each path in the tree.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any, NamedTuple

import h5py
import numpy as np
from numpy.typing import NDArray

from supple.errors import MeshError, SceneError
from supple.materials.elastic_tets.active import ActiveTets
from supple.materials.own.formula import Formula
from supple.mesh.skin import mixed
from supple.mesh.surface import SurfaceMesh
from supple.model.loads.applied import LoadPattern
from supple.model.state import Status
from supple.results.checkpoint.values import Known, Rows, Sizes, check, decoded, encoded
from supple.results.recording.actions import (
    RecordedCable,
    RecordedCavity,
    RecordedJoint,
    RecordedStitches,
    StitchLaws,
)
from supple.results.recording.checked_hdf5 import CheckedFile
from supple.results.recording.details import RecordedDetails, RecordedField, RecordedSensor
from supple.results.recording.physics import RecordedLaw, RecordedPhysics, RecordedWeld
from supple.scene.body import LOOKS
from supple.scene.joints.joint import Conditions, Function
from supple.scene.obstacles.obstacle import Obstacle
from supple.scene.registry import PARTS
from supple.scene.stitches.elements import PairNames


@dataclass(frozen=True, eq=False)
class SkinnedSurface:
    """Triangles whose vertices follow tets.

    Attributes
    ----------
    corners : (k, 4) int32, rows of the body's vertices: the tet that carries each surface vertex; (k, 10) the nodes of
        a quadratic one
    weights : (k, 4) barycentric coordinates in it, or (k, 10) shape functions, summing to one; negative
        where the vertex lies outside
    triangles : (t, 3) int32, rows of `corners`
    """

    corners: Annotated[NDArray[np.int32], Rows("k", "width", below="own")]
    weights: Annotated[NDArray[np.float64], Rows("k", "width")]
    triangles: Annotated[NDArray[np.int32], Rows("t", 3, below="k")]

    def positions(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Where the surface's vertices (k, 3) are when the body's are at x (n, 3) [m]."""
        return mixed(self.corners, self.weights, np.ascontiguousarray(x, dtype=np.float64))


RecordedLoad = LoadPattern
FORMAT_VERSION = 6
_GROUP, _HEADER = "supple", "supple/header"


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
    look : how it is drawn, see `supple.results.view.look`
    """

    name: str
    material: str
    vertices: slice
    tets: slice
    triangles: Annotated[NDArray[np.int32], Rows("t", 3, below="own")]
    skin: SkinnedSurface | None
    rigid: bool = False
    touches_with_skin: bool = False
    look: str = "rubber"

    @property
    def sizes(self) -> Sizes:
        return {"own": self.vertices.stop - self.vertices.start}

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
    parameters: Mapping[str, Any]
    vertices: Annotated[NDArray[np.float64], Rows("corners", 3)]
    triangles: Annotated[NDArray[np.int32], Rows("t", 3, below="corners")]

    @classmethod
    def of(cls, obstacle: Obstacle) -> RecordedObstacle:
        """As the scene has it."""
        surface = None if obstacle.surface_mesh is None else obstacle.surface_mesh.compact()
        return cls(
            obstacle.name or obstacle.label,
            type(obstacle).__name__,
            {"friction": float(obstacle.friction), **obstacle.values()},
            np.zeros((0, 3)) if surface is None else surface.vertices,
            np.zeros((0, 3), dtype=np.int32) if surface is None else surface.triangles,
        )

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
        return _obstacles()[self.kind](**values)


def _obstacles() -> dict[str, type[Obstacle]]:
    return {kind.__name__: kind for kind in PARTS["obstacles"].kinds}


class QuadraticRows(NamedTuple):
    """Which tets are quadratic, ascending, and their nodes."""

    rows: Annotated[NDArray[np.int32], Rows("k", below="m")]
    nodes: Annotated[NDArray[np.int32], Rows("k", 10, below="n")]


@dataclass(eq=False, repr=False)
class RecordedScene:
    """All that no frame changes; see `Recording`."""

    supple_version: str
    dt: float
    steps: int
    solver: str | None
    scene_text: str | None
    rest_positions: Annotated[NDArray[np.float64], Rows("n", 3)]
    tets: Annotated[NDArray[np.int32], Rows("m", 4, below="n")]
    quadratic: QuadraticRows | None
    rest_volumes: Annotated[NDArray[np.float64], Rows("m")]
    masses: Annotated[NDArray[np.float64], Rows("n")]
    gravity: Annotated[NDArray[np.float64], Rows(3)]
    pinned_vertices: Annotated[NDArray[np.integer], Rows("pinned", below="n")]
    bodies: tuple[RecordedBody, ...]
    obstacles: tuple[RecordedObstacle, ...]
    physics: RecordedPhysics
    untouching: tuple[tuple[int, int], ...]
    welds: tuple[RecordedWeld, ...]
    joints: tuple[RecordedJoint, ...]
    loads: dict[str, LoadPattern]
    other_loads: frozenset[str]
    cavities: tuple[RecordedCavity, ...]
    cables: tuple[RecordedCable, ...]
    stitches: RecordedStitches
    details: RecordedDetails
    field_names: tuple[str, ...]
    sensors: tuple[RecordedSensor, ...]
    statuses_of_codes: tuple[str, ...]

    @property
    def sizes(self) -> Sizes:
        """The lengths that the annotations name."""
        counts = {"n": len(self.rest_positions), "m": len(self.tets)}
        return counts | {"bodies": len(self.bodies), "obstacles": len(self.obstacles)}

    def nodes_of(self, body: RecordedBody) -> NDArray[np.int32]:
        """(m, 4) or (m, 10) nodes of a body's tets, rows of all vertices."""
        if self.quadratic is not None:
            rows, nodes = self.quadratic
            begin, end = np.searchsorted(rows, [body.tets.start, body.tets.stop])
            if end > begin:
                return nodes[begin:end]
        return self.tets[body.tets]


_CLASSES: dict[str, type] = {
    kind.__name__: kind
    for kind in (
        ActiveTets, Conditions, Formula, Function,
        LoadPattern, PairNames, QuadraticRows, RecordedBody, RecordedCable, RecordedCavity, RecordedDetails,
        RecordedField, RecordedJoint, RecordedLaw, RecordedObstacle, RecordedPhysics, RecordedScene, RecordedSensor,
        RecordedStitches, RecordedWeld, SkinnedSurface, StitchLaws,
    )
}  # fmt: skip


def write_scene(file: h5py.File, scene: RecordedScene) -> None:
    """Write the part that no frame changes to its group."""
    own = file.require_group(_GROUP)
    own.attrs["format_version"] = FORMAT_VERSION
    tree, arrays = encoded(scene, _CLASSES)
    file[_HEADER] = json.dumps(tree)
    for path, array in arrays.items():
        own[path] = array


def read_scene(file: CheckedFile) -> RecordedScene:
    """The part that no frame changes. All of it is checked.

    Raises
    ------
    OutputError : where the file is not a recording, of another version, or contradictory.
    """
    version = file.attribute(_GROUP, "format_version")
    if version is None:
        kind = file.attribute("VTKHDF", "Type")
        foreign = f"a VTKHDF {kind.decode()} of another program" if isinstance(kind, bytes) else "an HDF5 file"
        raise file.other(foreign)
    if not isinstance(version, (int, np.integer)):
        raise file.broken(f"its format version is {str(version)[:20]!r}")
    if version != FORMAT_VERSION:
        raise file.of_another_version(f"format {version}, this one reads {FORMAT_VERSION}")
    try:
        scene = decoded(json.loads(file.text(_HEADER)), _Arrays(file), _CLASSES)
        check(scene, RecordedScene, Known(), _GROUP)
        _check_consistency(scene)
    except (
        *(ValueError, TypeError, KeyError, IndexError, AttributeError, RecursionError, OverflowError),  # of other data
        *(SceneError, MeshError),  # of other numbers
    ) as error:
        raise file.broken(f"its description of the scene: {' '.join(str(error).split())[:300]}") from None
    return scene


class _Arrays(dict[str, NDArray[Any]]):
    """The arrays beside the tree, read when they are asked for."""

    def __init__(self, file: CheckedFile) -> None:
        super().__init__()
        self._file = file

    def __missing__(self, path: str) -> NDArray[Any]:
        return self._file.array(f"{_GROUP}/{path}")


def _check_consistency(scene: RecordedScene) -> None:
    """Raise `ValueError` for what the annotations cannot say."""
    n, m = len(scene.rest_positions), len(scene.tets)
    if not scene.bodies or not scene.dt > 0.0:
        raise ValueError("it has no bodies, or no time step")
    known = {str(status) for status in Status}
    if not set(scene.statuses_of_codes) <= known:
        raise ValueError("it has a status that is not known here")
    for body in scene.bodies:
        ends = [body.vertices.start, body.vertices.stop], [body.tets.start, body.tets.stop]
        if not (0 <= ends[0][0] < ends[0][1] <= n and 0 <= ends[1][0] < ends[1][1] <= m):
            raise ValueError(f"body {body.name!r} has rows {ends}, outside of {n} vertices and {m} tets")
        if body.rigid and (body.skin is None or [b - a for a, b in ends] != [4, 1]):
            raise ValueError(f"rigid body {body.name!r} does not have four vertices and a surface")
        if body.look not in LOOKS:
            raise ValueError(f"body {body.name!r} has the unknown look {body.look!r}")
        if body.touches_with_skin and body.skin is None:
            raise ValueError(f"body {body.name!r} has no skin to touch with")
        if body.skin is not None and body.skin.corners.shape[1] not in (4, 10):
            raise ValueError(f"the skin of {body.name!r} is not carried by 4 corners or 10 nodes")
    for obstacle in scene.obstacles:
        if obstacle.kind not in _obstacles():
            raise ValueError(f"obstacle {obstacle.name!r} is of an unknown kind, {obstacle.kind!r}; register the kind")
        _ = obstacle.obstacle
    curved = np.zeros(m, dtype=bool)
    if scene.quadratic is not None:
        rows, nodes = scene.quadratic
        if (np.diff(rows) <= 0).any() or not np.array_equal(nodes[:, :4], scene.tets[rows]):
            raise ValueError("its quadratic tets are not ascending rows of its tets, with their corners")
        curved[rows] = True
    scene.physics.check(len(scene.bodies), curved)
    owners = len(scene.bodies) + len(scene.obstacles)
    if not all(0 <= number < owners for pair in scene.untouching for number in pair):
        raise ValueError("what may touch names a body or obstacle that does not exist")
    for weld in scene.welds:
        if not (0 <= weld.soft < len(scene.bodies) and 0 <= weld.rigid < len(scene.bodies) and len(weld.vertices)):
            raise ValueError("a weld names a body that does not exist, or no vertex")
    jointed = [body.rigid for body in scene.bodies] + [True] * len(scene.obstacles)
    for joint in scene.joints:
        joint.check(jointed, len(scene.bodies))
    for name, load in scene.loads.items():
        shape = (len(load.weights), 3) if load.kind in ("pressure", "drag") else load.weights.shape
        inside = not load.vertices.size or 0 <= load.vertices.min() <= load.vertices.max() < n
        if load.weights.ndim != 1 or load.vertices.shape != shape or not inside:
            raise ValueError(f"load {name} does not act on vertices of the scene")
        if not np.isfinite([*load.weights, *load.offset, load.stiffness]).all():
            raise ValueError(f"a number of load {name} is not finite")
    for cable in scene.cables:
        if len(cable.weights) < 2:
            raise ValueError(f"cable {cable.name!r} has no span")
    scene.stitches.check(n)
    scene.details.check()
    for sensor in scene.sensors:
        sensor.check()
