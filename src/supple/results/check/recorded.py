"""A recording for the checks: their arrays, from the scene that it describes and not from those of a solver."""

from __future__ import annotations

from collections.abc import Iterator
from functools import singledispatch
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.materials.elastic import EdgesAndVolume
from supple.materials.elastic_tets.active import GROWTH, MUSCLE, ActiveTets
from supple.materials.elastic_tets.laws import joined_materials, tet_material
from supple.results.check.geometry import quadratic_tets
from supple.results.check.load_forces import CablePath, CavitySurface, LoadPattern
from supple.results.check.trajectory import Floats, Part, Stitches, Trajectory, TrajectoryFrame, Weld
from supple.results.recording.reader import Recording
from supple.scene.body import PlacedBody
from supple.scene.contact_pairs import pair_table
from supple.scene.forces import Force
from supple.scene.joints.axis_joint import AxisJoint
from supple.scene.joints.joint import Joint
from supple.scene.joints.placed import placed_joints
from supple.scene.loads.body_force import BodyForce
from supple.scene.loads.growth import Growth
from supple.scene.loads.load import Load
from supple.scene.loads.muscle import Muscle
from supple.scene.loads.spring import Spring
from supple.scene.loads.surface_loads import Pressure, Traction, Wind
from supple.scene.scene import Scene
from supple.scene.stitches.measures import StitchEnds


class RecordedTrajectory(Trajectory):
    """The frames of a recording."""

    def __init__(self, source: Recording) -> None:
        scene = source.scene
        bodies, rows = list(scene.bodies), source.bodies
        starts = {part.name: (part.vertices.start, part.tets.start) for part in rows}
        rest = np.concatenate([body.mesh.vertices for body in bodies])
        tets = np.concatenate([part.body.mesh.tets + part.vertices.start for part in rows]).astype(np.int32)
        corners = rest[tets]
        edges = corners[:, 1:] - corners[:, :1]
        volumes = np.einsum("ij,ij->i", edges[:, 0], np.cross(edges[:, 1], edges[:, 2])) / 6.0
        curved, quadratic = [part for part in rows if part.body.mesh.order == 2], None
        if curved:
            numbers = np.concatenate([np.arange(part.tets.start, part.tets.stop) for part in curved])
            nodes = np.concatenate([part.body.mesh.nodes + part.vertices.start for part in curved])
            quadratic = numbers, nodes
            volumes[numbers] = quadratic_tets.volumes(rest[nodes])
        masses = np.concatenate([body.lumped_masses() for body in bodies])
        applied = list(_applied(scene, starts, masses))
        self._active = tuple(_active(scene, starts))
        super().__init__(
            path=source.path,
            source=source,
            knows=frozenset({"recording", "tets", "times", "masses", "gravity", "material", "free"}),
            times=source.times,
            dt=source.dt,
            gravity=source.gravity,
            bodies=tuple(_part(part) for part in rows),
            rest_positions=rest,
            masses=masses,
            tets=tets,
            rest_volumes=volumes,
            material=joined_materials([tet_material(b.material, len(b.mesh.tets), b.mesh.order) for b in bodies]),
            compliances=tuple(_compliances(body) for body in bodies),
            quadratic=quadratic,
            obstacles=source.obstacles,
            pinned_vertices=_pinned(scene, starts),
            untouching=_untouching(scene),
            welds=_welds(scene),
            joints=placed_joints(bodies, scene.joints, scene.obstacles),
            joint_limits=tuple(map(_limits, scene.joints)),
            loads={f"{work}.{k}": pattern for k, (work, pattern) in enumerate(applied) if pattern is not None},
            other_loads=frozenset(work for work, pattern in applied if pattern is None),
            cavities=tuple(CavitySurface(str(c.name), c.surface(bodies) + starts[c.body][0]) for c in scene.cavities),
            cables=tuple(_cable(cable, bodies, starts) for cable in scene.cables),
            stitches=_stitches(scene),
            acting=_acting(scene),
            driving=_driving(scene),
            unfinished=source.unfinished,
        )

    def frame(self, number: int) -> TrajectoryFrame:
        frame = self.records[number]
        state, details, before = frame.state, frame.report.details, self.records.broken_stitches(max(number - 1, 0))
        return TrajectoryFrame(
            number,
            frame.time,
            np.ascontiguousarray(state.positions),
            state.velocities,
            frame.det_F,
            frame.obstacle_poses,
            state.internal,
            tuple(map(ActiveTets.at, self._active, details.active.values())),
            {**details.load_vectors, **details.load_values},
            details.cavity_pressure,
            details.cable_tension,
            state.broken_stitches,
            np.setdiff1d(state.broken_stitches, before),
        )


Patterns = Iterator[tuple[str, LoadPattern | None]]
Starts = dict[str, tuple[int, int]]
"""By name of the body, the numbers of its first vertex and of its first tet."""


def _part(rows: Any) -> Part:
    touches = rows.body.touches_with_skin
    return Part(rows.name, rows.vertices, rows.tets, rows.boundary, rows.skin, rows.rigid, touches)


def _compliances(body: PlacedBody) -> tuple[float, float] | None:
    law = body.material
    if not isinstance(law, EdgesAndVolume):
        return None
    return float(law.edge_compliance), float(law.volume_compliance)


def _pinned(scene: Scene, starts: Starts) -> NDArray[np.int64]:
    found = [np.zeros(0, dtype=np.int64)]
    for pin in scene.pins:
        body = scene.body(pin.body)
        rows = pin.select(body.place(body.mesh.vertices)).astype(np.int64)
        found.append(rows + starts[pin.body][0])
    return np.concatenate(found)


def _untouching(scene: Scene) -> tuple[tuple[int, int], ...]:
    collide = pair_table(scene).collide
    obstacle = np.arange(len(collide)) >= len(scene.bodies)
    passing = np.argwhere(np.triu(~collide & ~(obstacle[:, None] & obstacle[None, :])))
    return tuple((int(i), int(j)) for i, j in passing)


def _welds(scene: Scene) -> tuple[Weld, ...]:
    number = {body.name: k for k, body in enumerate(scene.bodies)}
    vertices, weld_of = scene.welding.vertices.astype(np.int64), scene.welding.weld
    welds = enumerate(scene.welds)
    return tuple(Weld(number[weld.body], number[weld.rigid], vertices[weld_of == k]) for k, weld in welds)


def _limits(joint: Joint) -> tuple[float, float]:
    ends = getattr(getattr(joint, "motor", None), "max_force", None), getattr(joint, "max_velocity", None)
    effort, rate = (np.inf if end is None else float(end) for end in ends)
    return effort, rate


def _stitches(scene: Scene) -> Stitches | None:
    if not scene.stitches:
        return None
    tets, springs = scene.stitching.tets, scene.stitching.springs
    laws = np.column_stack([tets.mu, tets.lam]), np.column_stack([springs.stiffness, springs.rest_lengths])
    return Stitches(StitchEnds.of(scene.stitching, scene.bodies), tets.rest_shape_inverse, *laws)


def _acting(scene: Scene) -> str | None:
    bodies = {body.name for body in scene.bodies}
    if scene.pins:
        return "pins hold bodies"
    if scene.obstacles:
        return "bodies may rest on obstacles"
    if any(joint.second not in bodies for joint in scene.joints):
        return "joints hold bodies"
    return "forces or soft targets act on bodies" if _forces(scene) else None


def _forces(scene: Scene) -> bool:
    fixed = any(name is None for cable in scene.cables for name, _ in cable.points)
    return bool(scene.forces or scene.loads or scene.soft_targets or fixed)


def _driving(scene: Scene) -> str | None:
    if _forces(scene):
        return "forces or soft targets do work"
    if any(pin.motion is not None for pin in scene.pins):
        return "scripted pins do work"
    driven = any(isinstance(joint, AxisJoint) and joint.motor is not None for joint in scene.joints)
    return "motors do work" if driven else None


def _active(scene: Scene, starts: Starts) -> Iterator[ActiveTets]:
    """Growths and muscles, without their values."""
    for load in scene.loads:
        if isinstance(load, Growth):
            rows, directions = load.growing(scene.body(load.body))
            yield ActiveTets(GROWTH, rows + starts[load.body][1], directions)
        elif isinstance(load, Muscle):
            rows, directions = load.fibres(scene.body(load.body))
            curve = np.array(load.force_length or ([1.0], [1.0]), dtype=np.float64).T
            yield ActiveTets(MUSCLE, rows + starts[load.body][1], directions, 0.0, load.strength, curve)


def _applied(scene: Scene, starts: Starts, masses: Floats) -> Iterator[tuple[str, LoadPattern | None]]:
    """The names of the works of all loads, in the order of their values in a frame, and how forces follow from these;
    None where they do not follow from one value."""
    for force in scene.forces:
        yield "forces", _force(force, scene.body(force.body), starts) if force.is_total else None
    for load in scene.loads:
        yield from patterns_of(load, scene, starts, masses)


@singledispatch
def patterns_of(load: Load, scene: Scene, starts: Starts, masses: Floats) -> Patterns:
    """The names of the works of a load, and how its forces follow from a value; None where they do not, as of a kind
    that has not registered its own."""
    yield load.kind, None


@patterns_of.register
def _(load: Traction, scene: Scene, starts: Starts, masses: Floats) -> Patterns:
    body = scene.body(load.body)
    shares = np.zeros(len(body.points))
    for triangles, weight in _weighted(body, load.triangles(body)):
        a, b, c = body.points[triangles].transpose(1, 0, 2)
        areas = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 6.0
        shares += weight * np.bincount(triangles.ravel(), np.repeat(areas, 3), len(shares))
    yield "tractions", _vector("tractions", body, shares, starts)


@patterns_of.register
def _(load: Pressure, scene: Scene, starts: Starts, masses: Floats) -> Patterns:
    body = scene.body(load.body)
    for triangles, _ in _weighted(body, load.triangles(body)):  # the weight is in the value
        yield "pressures", LoadPattern("pressure", "pressures", triangles + starts[load.body][0])


@patterns_of.register
def _(load: Wind, scene: Scene, starts: Starts, masses: Floats) -> Patterns:
    body = scene.body(load.body)
    triangles = body.triangles[load.triangles(body)] + starts[load.body][0]
    yield "wind", LoadPattern("drag", "wind", triangles, stiffness=load.density * load.drag)


@patterns_of.register
def _(load: BodyForce, scene: Scene, starts: Starts, masses: Floats) -> Patterns:
    names = load.bodies or tuple(starts)
    spans = [starts[name][0] + np.arange(len(scene.body(name).mesh.vertices)) for name in names]
    rows = np.concatenate(spans)
    yield "body_forces", LoadPattern("vector", "body_forces", rows, masses[rows]) if load.is_uniform else None


@patterns_of.register
def _(load: Spring, scene: Scene, starts: Starts, masses: Floats) -> Patterns:
    yield "springs", _spring(load, scene, starts)


def _weighted(body: PlacedBody, rows: NDArray[np.int64]) -> Iterator[tuple[NDArray[np.int32], float]]:
    """Triangles (t, 3), and with which factor a load per area acts on them: on whole sides of quadratic tets by the
    extrapolation 4/3 of four triangles without 1/3 of the one between the corners."""
    triangles = body.triangles
    if body.mesh.order == 1:
        yield triangles[rows], 1.0
        return
    whole = np.flatnonzero(np.bincount(rows // 4, minlength=len(triangles) // 4) == 4)
    inside = np.isin(rows // 4, whole)
    corners = np.column_stack([triangles[4 * whole + k, k] for k in range(3)])
    for part, weight in ((triangles[rows[~inside]], 1.0), (triangles[rows[inside]], 4.0 / 3.0), (corners, -1.0 / 3.0)):
        if len(part):
            yield part, weight


def _force(force: Force, body: PlacedBody, starts: Starts) -> LoadPattern:
    rows = force.select(body.place(body.points))
    return _vector("forces", body, np.bincount(rows, minlength=len(body.points)) / len(rows), starts)


def _vector(work: str, body: PlacedBody, shares: Floats, starts: Starts) -> LoadPattern:
    """A force with shares (k,) at the points of a body, as one on its vertices."""
    points = body.embedded
    spread = np.repeat(shares, np.diff(points.start)) * points.weights
    weights = np.bincount(points.vertices, spread, len(body.mesh.vertices)).astype(np.float64)
    return LoadPattern("vector", work, np.arange(len(weights)) + starts[body.name][0], weights)


def _spring(spring: Spring, scene: Scene, starts: Starts) -> LoadPattern:
    """The difference of its ends as sum w x + offset."""
    ends = [spring.corners(key, scene.bodies) for key in ("first", "second")]
    offset, vertices, weights = ends[0][3] - ends[1][3], [], []
    for (name, corners, shares, _), sign in zip(ends, (1.0, -1.0), strict=True):
        if name is not None:
            vertices.append(corners + starts[name][0])
            weights.append(sign * shares)
    rows = np.concatenate(vertices), np.concatenate(weights)
    return LoadPattern("spring", "springs", *rows, offset=offset, stiffness=spring.stiffness)


def _cable(cable: Any, bodies: list[PlacedBody], starts: Starts) -> CablePath:
    corners = cable.corners(bodies)
    held = [(k, own + starts[name][0], shares) for k, (name, own, shares, _) in enumerate(corners) if name is not None]
    vertices, column = np.unique(np.concatenate([own for _, own, _ in held]), return_inverse=True)
    weights = np.zeros((len(corners), len(vertices)))
    for (k, _, shares), columns in zip(held, column.reshape(len(held), -1), strict=True):
        np.add.at(weights[k], columns, shares)
    return CablePath(cable.name, vertices, weights, np.array([offset for *_, offset in corners]))
