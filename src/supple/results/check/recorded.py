"""A recording for the checks: their arrays, from the scene that it describes and not from those of a solver."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from supple.materials.elastic import EdgesAndVolume
from supple.materials.elastic_tets.laws import joined_materials, tet_material
from supple.results.check.known import Cable, Cavity, Growing, Ints, Weld
from supple.results.check.loads import combined, forces_of
from supple.results.check.rods import StoredByRod
from supple.results.check.shells import StoredByShell
from supple.results.check.trajectory import Snapshot, Trajectory
from supple.results.recording.reader import Recording
from supple.scene.body import PlacedBody
from supple.scene.contact_pairs import pair_table
from supple.scene.holders import clamped, holders
from supple.scene.joints.axis_joint import AxisJoint
from supple.scene.joints.joint import Joint
from supple.scene.joints.placed import placed_joints
from supple.scene.loads.growth import Growth
from supple.scene.loads.over_time import script_of
from supple.scene.pins import Pin
from supple.scene.rod import Rod
from supple.scene.rows import BodyRows
from supple.scene.scene import Scene
from supple.scene.shell import Shell
from supple.scene.stitches.measures import StitchEnds


class RecordedTrajectory(Trajectory):
    """The frames of a recording."""

    knows = frozenset({"recording", "tets", "times", "masses", "gravity", "material", "free"})

    def __init__(self, source: Recording) -> None:
        self.source, self.path, self.times, self.dt = source, source.path, source.times, source.dt
        self.gravity, self.unfinished = source.gravity, source.unfinished
        self.implicit = (source.solver or "").startswith("Implicit")
        self.bodies, self.obstacles = source.bodies, source.obstacles
        self.rows = {part.name: part for part in source.bodies}
        bodies = [part.body for part in source.bodies]
        self.rest_positions = np.concatenate([body.mesh.vertices for body in bodies])
        self.masses = np.concatenate([body.lumped_masses() for body in bodies])
        self.tets = _joined(part.body.mesh.tets + part.vertices.start for part in source.bodies).astype(np.int32)
        self.material = joined_materials([tet_material(b.material, len(b.mesh.tets), b.mesh.order) for b in bodies])
        self.springs = [b.material if isinstance(b.material, EdgesAndVolume) else None for b in bodies]
        self.thin = [(part, _thin(part, source.scene)) for part in source.bodies if isinstance(part.body, (Shell, Rod))]
        curved = [part for part in source.bodies if part.body.mesh.order == 2]
        if curved:
            numbers = _joined(np.arange(part.tets.start, part.tets.stop) for part in curved)
            self.quadratic = numbers, _joined(part.body.mesh.nodes + part.vertices.start for part in curved)
        self._scene_parts(source.scene, bodies)

    def _scene_parts(self, scene: Scene, bodies: list[PlacedBody]) -> None:
        self.allowed = pair_table(scene).collide
        self.joints = placed_joints(bodies, scene.joints, scene.obstacles)
        self.joint_limits = [_limits(joint) for joint in scene.joints]
        number, welding = {body.name: k for k, body in enumerate(bodies)}, scene.welding
        vertices = [welding.vertices[welding.weld == k].astype(np.int64) for k in range(len(scene.welds))]
        ends = [(number[weld.body], number[weld.rigid]) for weld in scene.welds]
        self.welds = [Weld(*pair, own) for pair, own in zip(ends, vertices, strict=True)]
        if scene.stitches:
            self.stitching, self.stitch_ends = scene.stitching, StitchEnds.of(scene.stitching, bodies)
        self.pinned_vertices = _joined([Trajectory.pinned_vertices, *map(self._pinned, scene.pins)])
        begins = [self.rows[cavity.body].vertices.start for cavity in scene.cavities]
        surfaces = [cavity.surface(bodies).astype(np.int64) for cavity in scene.cavities]
        self.cavities = [Cavity(str(c.name), t + n) for c, t, n in zip(scene.cavities, surfaces, begins, strict=True)]
        self.cables = [Cable(cable.name, *combined(cable.corners(bodies), self)) for cable in scene.cables]
        self.growing = [self._growing(load) for load in scene.loads if isinstance(load, Growth)]
        forces = [*scene.forces, *(load for load in scene.loads if not isinstance(load, Growth))]
        self.loads = [forces_of(load, self) for load in forces]
        self.acting, self.driving = _acting(scene), _driving(scene)

    def snapshot(self, number: int) -> Snapshot:
        frame, before = self.records[number], self.records.broken_stitches(max(number - 1, 0))
        state, poses = frame.state, frame.obstacle_poses
        broken = state.broken_stitches, np.setdiff1d(state.broken_stitches, before)
        positions = np.ascontiguousarray(state.positions)
        moving = positions, state.velocities, poses, state.internal
        return Snapshot(self, number, frame.time, *moving, *broken, recorded=frame)

    def _pinned(self, pin: Pin) -> Ints:
        body = self.rows[pin.body].body
        held = body.with_clamped(pin.select(body.place(body.mesh.vertices)))
        return held.astype(np.int64) + self.rows[pin.body].vertices.start

    def _growing(self, load: Growth) -> Growing:
        rows, directions = load.growing(self.rows[load.body].body)
        return Growing(rows + self.rows[load.body].tets.start, directions, script_of(load, "stretch"))


def _joined(parts: Iterable[NDArray]) -> NDArray:
    return np.concatenate(list(parts))


def _thin(part: BodyRows, scene: Scene) -> StoredByShell | StoredByRod:
    body, own = part.body, holders(scene)[part.vertices]
    if isinstance(body, Rod):
        return StoredByRod(body, clamped(own, body.mesh.line))
    assert isinstance(body, Shell)
    held = clamped(own, body.triangles)
    return StoredByShell(body.points, body.triangles.astype(np.int64), body.material, held)


def _limits(joint: Joint) -> tuple[float, float]:
    ends = getattr(getattr(joint, "motor", None), "max_force", None), getattr(joint, "max_velocity", None)
    effort, rate = (np.inf if end is None else float(end) for end in ends)
    return effort, rate


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
