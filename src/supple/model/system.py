"""A scene as flat arrays, the input of solvers.

The bodies' vertices, tets, edges, points and surface triangles are concatenated; a `BodyRange` has the rows of one.
Vertices move. Points touch; they are combinations of vertices: of a soft body its vertices or those of its skin. This
file does not depend on solvers, files or viewers.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import SceneError
from supple.kinds.suggestion import Named
from supple.materials.elastic import EdgesAndVolume
from supple.materials.elastic_tets.edge_springs import EdgeSprings
from supple.materials.elastic_tets.laws import TetLaws, joined_materials, tet_material
from supple.materials.elastic_tets.quadratic import QuadraticTets
from supple.materials.rods.elements import RodElements, joined_rods
from supple.materials.shells.elements import ShellElements, elements_of
from supple.mesh.topology import graph_components
from supple.model.loads.actuators.actuator import Actuator
from supple.model.loads.actuators.build import actuators_of
from supple.model.loads.applied import ActiveLoad, AppliedLoad, Setting
from supple.model.loads.build import applied, applied_force
from supple.model.state import State
from supple.numerics.geometry.embedded_points import EmbeddedPoints
from supple.scene.forces import Force, SoftTarget
from supple.scene.holders import clamped, holders
from supple.scene.joints.welding import Welding, linked_pieces
from supple.scene.motion import Motion, moved_points, points_at_origin, rigid_pose
from supple.scene.obstacles.obstacle import Obstacle
from supple.scene.pins import Pin
from supple.scene.rigid.rigid_body import RigidBody
from supple.scene.rod import Rod
from supple.scene.rows import BodyRows, rows_of
from supple.scene.scene import Scene
from supple.scene.shell import Shell
from supple.scene.stitches.stitching import Stitching, no_stitching


@dataclass(frozen=True, eq=False)
class BodyRange(BodyRows):
    """The rows of the System's arrays that belong to one body."""

    edges: slice
    triangles: slice
    points: slice


@dataclass(frozen=True, eq=False)
class PinRange:
    """The vertices of one pin, and their positions at time 0, before its motion."""

    pin: Pin
    vertices: NDArray[np.int32]
    anchors: NDArray[np.float64]

    @property
    def label(self) -> str:
        return self.pin.label

    @property
    def motion(self) -> Motion:
        return self.pin.motion

    def targets(self, time: float) -> NDArray[np.float64]:
        """Required positions (k, 3) of the pinned vertices at `time` [m]."""
        if self.pin.vertices is None:  # of a rigid body
            R, t = rigid_pose(self.pin.motion, time, self.pin.label)
            return self.anchors @ R.T + t
        return moved_points(self.pin.motion, self.anchors, time, self.pin.label)


@dataclass(frozen=True, eq=False)
class SoftTargetRange:
    """The vertices of one soft target, and the targets of their springs at time 0, before its motion."""

    target: SoftTarget
    vertices: NDArray[np.int32]
    anchors: NDArray[np.float64]

    def targets(self, time: float) -> NDArray[np.float64]:
        """Targets (k, 3) of the springs at `time` [m]."""
        return moved_points(self.target.motion, self.anchors, time, self.target.label)


@dataclass(frozen=True, eq=False)
class System:
    """Flat arrays of a whole scene. All arrays are C-contiguous; indices are int32 and global.

    Attributes
    ----------
    rest_positions : (n, 3) [m] rest shapes, each in its body's own coordinates, before placement
    masses : (n,) lumped, rho V / 4 to each node of a tet; see `PlacedBody.lumped_masses` [kg]
    tets : (m, 4); rest_shape_inverse : (m, 3, 3) Dm^-1 [1/m]; rest_volumes : (m,) [m^3]
    edges : (e, 2); rest_lengths : (e,) [m]
    points : combinations of vertices that touch; those of a soft body are its vertices, or those of its skin
    triangles : (t, 3) surfaces, rows of `points`, counter-clockwise from outside
    components : (n,) the connected piece of a mesh that a vertex belongs to
    gravity : (3,) [m/s^2]
    loads : those of the scene's forces, then of its loads
    actuators : those of the scene's cavities, then of its cables
    stitching : tets and springs that join bodies to each other, and to obstacles
    welding : vertices of soft bodies that are points of rigid ones
    effective_masses : (n,) with which constraints see vertices, where a solver gives them others than `masses` [kg]
    start_states : where a simulation began, then where it continues; vertices in the scene's order
    quadratic : the quadratic ones among the tets, of which `tets` and `rest_shape_inverse` have the corners; or None
    shells : triangles and hinges of all shells; or None
    rods : edges and joints of all rods; or None
    """

    scene: Scene
    bodies: tuple[BodyRange, ...]
    pins: tuple[PinRange, ...]
    rest_positions: NDArray[np.float64]
    masses: NDArray[np.float64]
    tets: NDArray[np.int32]
    rest_shape_inverse: NDArray[np.float64]
    rest_volumes: NDArray[np.float64]
    edges: NDArray[np.int32]
    rest_lengths: NDArray[np.float64]
    triangles: NDArray[np.int32]
    components: NDArray[np.int32]
    gravity: NDArray[np.float64]
    points: EmbeddedPoints = field(default_factory=EmbeddedPoints.none)
    loads: tuple[AppliedLoad, ...] = ()
    actuators: tuple[Actuator, ...] = ()
    soft_targets: tuple[SoftTargetRange, ...] = ()
    stitching: Stitching = field(default_factory=lambda: no_stitching(0))
    welding: Welding = field(default_factory=Welding.none)
    effective_masses: NDArray[np.float64] | None = None
    start_states: tuple[State, ...] = ()
    quadratic: QuadraticTets | None = None
    shells: ShellElements | None = None
    rods: RodElements | None = None

    @property
    def obstacles(self) -> tuple[Obstacle, ...]:
        return tuple(self.scene.obstacles)

    @cached_property
    def pinned_vertices(self) -> NDArray[np.int32]:
        """(k,) vertices of all pins, in the order of `pin_targets`."""
        parts = [pin.vertices for pin in self.pins]
        return np.concatenate(parts).astype(np.int32) if parts else np.zeros(0, dtype=np.int32)

    def pin_targets(self, time: float) -> NDArray[np.float64]:
        """(k, 3) required positions of the pinned vertices at `time` [m]."""
        parts = [pin.targets(time) for pin in self.pins]
        return np.concatenate(parts) if parts else np.zeros((0, 3))

    @cached_property
    def elements(self) -> NDArray[np.int32]:
        """(m + k, 4) the tets, then the stitches: all elements that couple vertices; -1 for a node without a vertex."""
        return np.concatenate([self.tets, self.stitching.elements()]) if len(self.stitching) else self.tets

    @cached_property
    def laws(self) -> TetLaws:
        """The elastic laws of all tets."""
        materials = [tet_material(p.body.material, p.tets.stop - p.tets.start, p.body.mesh.order) for p in self.bodies]
        springs = []
        for part in self.bodies:
            law, rows = part.body.material, part.tets
            if isinstance(law, EdgesAndVolume):
                own = law.edge_compliance, law.volume_compliance
                springs.append(EdgeSprings.of(own, rows, self.rest_positions, self.tets[rows], self.rest_volumes[rows]))
        rest = self.rest_shape_inverse, self.rest_volumes
        return TetLaws(self.tets, *rest, joined_materials(materials), tuple(springs), self.quadratic)

    def laws_at(self, time: float) -> TetLaws:
        """`laws` with the growths and muscles as they are at `time` [s]."""
        active = tuple(load.active(time) for load in self.loads if isinstance(load, ActiveLoad))
        return replace(self.laws, active=active) if active else self.laws

    @cached_property
    def joined_components(self) -> NDArray[np.int32]:
        """(n,) the piece that a vertex belongs to; those that stitches, joints or welds join count as one."""
        pieces = self.stitching.joined_components(self.components)
        begins = {part.name: part.vertices.start for part in self.bodies}
        return linked_pieces(pieces, begins, self.scene.joints, self.welding)

    @cached_property
    def inverse_masses(self) -> NDArray[np.float64]:
        """(n,) 1/m of what constraints see [1/kg], zero where a vertex is pinned."""
        w = 1.0 / (self.masses if self.effective_masses is None else self.effective_masses)
        w[self.pinned_vertices] = 0.0
        return w

    @cached_property
    def rest_points(self) -> NDArray[np.float64]:
        """(p, 3) the points at rest, each in its body's own coordinates [m]."""
        return self.points.positions(self.rest_positions)

    @cached_property
    def rigid_bodies(self) -> tuple[BodyRange, ...]:
        """The rigid ones among the bodies."""
        return tuple(part for part in self.bodies if isinstance(part.body, RigidBody))

    def split(self, values: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
        """Positions or velocities of the points, of vectors (n, 3) of the vertices: one array per body, by name."""
        points = self.points.positions(values) if self.rigid_bodies else values
        of_bodies = {part.name: points[part.points] if part.rigid else values[part.vertices] for part in self.bodies}
        return Named("body", of_bodies)


def build_system(scene: Scene, start: State | None = None) -> System:
    """Flatten a scene.

    Parameters
    ----------
    start : the state that the simulation begins from; pins fix its vertices at their positions there.
    """
    ranges, rest, masses, tets, Dm_inv, volumes, edges, triangles, points = [], [], [], [], [], [], [], [], []
    n = m = e = t = p = 0
    for body in scene.bodies:
        mesh = body.mesh
        embedded, surface = body.touching
        counts = len(mesh.vertices), len(mesh.tets), len(mesh.edges), len(surface), len(embedded)
        rows = [slice(begin, begin + count) for begin, count in zip((n, m, e, t, p), counts, strict=True)]
        ranges.append(BodyRange(body, len(ranges), *rows))
        rest.append(mesh.vertices)
        masses.append(body.lumped_masses())
        tets.append(mesh.tets + n)
        Dm_inv.append(mesh.rest_shape_inverse)
        volumes.append(mesh.volumes)
        edges.append(mesh.edges + n)
        triangles.append(surface + p)
        points.append(embedded.shifted(n))
        n, m, e, t, p = (begin + count for begin, count in zip((n, m, e, t, p), counts, strict=True))
    rest_positions = np.concatenate(rest)
    all_edges = np.concatenate(edges).astype(np.int32)
    lengths = np.linalg.norm(rest_positions[all_edges[:, 0]] - rest_positions[all_edges[:, 1]], axis=1)
    all_masses, start_states = np.concatenate(masses), _start_states(scene, start)
    begins = {part.name: part.vertices.start for part in ranges}
    forces = []
    for force in scene.forces:
        part = next(part for part in ranges if part.name == force.body)
        rows = force.select(part.body.place(part.body.points))
        forces.append(applied_force(force, part.body, part.vertices.start, rows))
    x_start = start_states[0].positions
    setting = Setting(scene.bodies, begins, all_masses, x_start)
    given = [applied(load, setting) for load in scene.loads]
    return System(
        scene=scene,
        bodies=tuple(ranges),
        pins=tuple(PinRange(pin, *_anchored(pin, ranges, start)) for pin in scene.pins),
        rest_positions=np.ascontiguousarray(rest_positions),
        masses=all_masses,
        tets=np.ascontiguousarray(np.concatenate(tets), dtype=np.int32),
        rest_shape_inverse=np.ascontiguousarray(np.concatenate(Dm_inv)),
        rest_volumes=np.concatenate(volumes),
        edges=all_edges,
        rest_lengths=lengths,
        triangles=np.ascontiguousarray(np.concatenate(triangles), dtype=np.int32),
        components=graph_components(n, all_edges[:, 0], all_edges[:, 1]),
        gravity=np.asarray(scene.gravity, dtype=np.float64),
        points=EmbeddedPoints.joined(points),
        loads=(*forces, *(load for parts in given for load in parts)),
        actuators=actuators_of(scene.cavities, scene.cables, scene.bodies, begins, x_start),
        soft_targets=tuple(SoftTargetRange(item, *_anchored(item, ranges, start)) for item in scene.soft_targets),
        stitching=scene.stitching
        if start is None
        else scene.stitching.without(start.broken_stitches, start.separated_stitches),
        welding=scene.welding,
        start_states=start_states,
        quadratic=_quadratic_tets(ranges, rest_positions),
        shells=shells_of(scene),
        rods=rods_of(scene),
    )


def shells_of(scene: Scene) -> ShellElements | None:
    """The triangles and hinges of all shells, clamped where a pin or a weld holds whole triangles."""
    parts = [
        (part.body.points, part.body.triangles, part.vertices.start, part.body.material)
        for part in rows_of(scene.bodies)
        if isinstance(part.body, Shell)
    ]
    return elements_of(parts, holders(scene)) if parts else None


def rods_of(scene: Scene) -> RodElements | None:
    """The edges and joints of all rods, clamped where a pin or a weld holds both ends of an edge."""
    parts = [(part.body, part.vertices) for part in rows_of(scene.bodies) if isinstance(part.body, Rod)]
    if not parts:
        return None
    own = holders(scene)
    return joined_rods([(body.elements(clamped(own[at], body.mesh.line)), at.start) for body, at in parts])


def _quadratic_tets(ranges: list[BodyRange], rest_positions: NDArray[np.float64]) -> QuadraticTets | None:
    own = [part for part in ranges if part.body.mesh.order == 2]
    if not own:
        return None
    rows = np.concatenate([np.arange(part.tets.start, part.tets.stop) for part in own])
    nodes = np.concatenate([part.body.mesh.nodes + part.vertices.start for part in own])
    return QuadraticTets.of(rows, nodes, rest_positions)


def rebuilt_system(scene: Scene, start_states: tuple[State, ...], anchors: Sequence[NDArray[np.float64]]) -> System:
    """The System of an earlier process, with its bits: its `start_states`, and the (k, 3) `anchors` of each pin."""
    system = build_system(scene, start_states[0])
    pins = tuple(replace(pin, anchors=there) for pin, there in zip(system.pins, anchors, strict=True))
    return replace(system, pins=pins, start_states=start_states)


def _start_states(scene: Scene, start: State | None) -> tuple[State, ...]:
    """A start after time 0 continues a simulation that began with the scene's placement."""
    if start is not None and start.time == 0.0:
        return (start,)
    begun = initial_state(scene)
    return (begun,) if start is None else (begun, start)


def _anchored(
    item: Pin | Force | SoftTarget, ranges: list[BodyRange], start: State | None
) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """The selected vertices (k,) and their anchors (k, 3): where they are at time 0, before any motion.

    A start at time 0 moves anchors. One at a later time moves those of pins, which hold their vertices where they are
    then; soft targets still pull to the placement.
    """
    part = next(r for r in ranges if r.name == item.body)
    placed = part.body.place(part.body.mesh.vertices)
    local = item.select(placed)  # of a rigid body, only all: the control points
    if isinstance(item, Pin):
        local = part.body.with_clamped(local)
    vertices = (local + part.vertices.start).astype(np.int32)
    anchors = placed[local]
    if start is not None and start.time == 0.0:
        anchors = start.positions[vertices]
    elif start is not None and isinstance(item, Pin):
        anchors = points_at_origin(item.motion, start.positions[vertices], start.time, item.label)
    return vertices, np.ascontiguousarray(anchors)


def initial_state(
    scene: Scene,
    positions: Mapping[str, ArrayLike] | None = None,
    velocities: Mapping[str, ArrayLike] | None = None,
) -> State:
    """The state at time 0: placement and velocities of the scene, or the given positions and velocities.

    Parameters
    ----------
    positions, velocities : by body name, (n, 3) [m] and [m/s], of a rigid body those of its surface's vertices; others
        start as in the scene.

    Raises
    ------
    SceneError : where a name is unknown, a shape is wrong or a value is not finite.
    """
    names = sorted(body.name for body in scene.bodies)
    positions, velocities = positions or {}, velocities or {}
    for what, given in (("initial_positions", positions), ("initial_velocities", velocities)):
        for name in given:
            if name not in names:
                raise SceneError(f"{what}: body {name!r} does not exist; there are {', '.join(map(repr, names))}")
    x, v = [], []
    for body in scene.bodies:
        placed, moving = body.place(body.mesh.vertices), None
        if body.name in positions:
            placed = body.vertex_values(positions[body.name], f"initial_positions[{body.name!r}]", places=True)
        if body.name in velocities:
            moving = body.vertex_values(velocities[body.name], f"initial_velocities[{body.name!r}]", places=False)
        x.append(placed)
        v.append(body.velocities_at(placed) if moving is None else moving)
    return State(0.0, np.ascontiguousarray(np.concatenate(x)), np.ascontiguousarray(np.concatenate(v)))
