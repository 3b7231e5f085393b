"""A robot as the data of a scene file: rigid bodies, joints, and gravity along -z.

Bodies have the coordinates of their links. The root is held, unless a joint of the kind "floating" joins it to the
world. All joints are at zero where the scene places the bodies, or at the nearest end of their limits.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from supple.app.scene_file.entries.mesh_sources import MeshStore
from supple.app.scene_file.urdf.elements import Problem
from supple.app.scene_file.urdf.groups import Group, groups_of
from supple.app.scene_file.urdf.inertia import DENSITY, box_of, of_ball, projected
from supple.app.scene_file.urdf.notes import Notes
from supple.app.scene_file.urdf.robot import Inertia, Placement, Robot, RobotJoint
from supple.app.scene_file.urdf.shapes import Shapes, entries, rotation_vector
from supple.scene.rigid.mass_properties import of_solid

# As many as a scene file may have; checked before the text of the scene is written and read.
_MOST_BODIES = 10_000
_LIGHT = 0.01  # the mass of a link that has none, as a share of what it carries

_KINDS = {"fixed": "fixed", "revolute": "hinge", "continuous": "hinge", "prismatic": "slider", "planar": "planar"}


def described(robot: Robot, folder: Path, meshes: MeshStore, notes: Notes) -> tuple[dict[str, Any], dict[str, int]]:
    """The data of a scene file, and the lines of the links and joints, by the names of bodies and joints there.

    Raises
    ------
    Problem : where there is nothing to simulate, too much, or a mesh cannot be read.
    """
    shapes = Shapes(folder, meshes, notes)
    robot = shapes.usable(robot)
    groups = groups_of(robot, notes)
    bodies = [name for group in groups for name in group.bodies]
    if len(bodies) > _MOST_BODIES:
        raise Problem(f"{len(bodies)} links have a mass; at most {_MOST_BODIES} are read")
    if not bodies:
        raise Problem("no link has a mass or a collision geometry; give <inertial> to those that move")
    names, joint_names = _names(bodies, "link", notes), _names(list(robot.joints), "joint", notes)
    start = start_of(robot, notes)
    frames = _frames(robot, start)
    surfaces: dict[str, list[dict[str, Any]]] = {name: [] for name in bodies}
    for name, body in ((name, body) for group in groups for name, body in group.carrier.items() if body is not None):
        for geometry in robot.links[name].collisions:
            surfaces[body] += entries(geometry, frames[name].relative_to(frames[body]))
    inertia = {name: _inertia(robot, name, surfaces[name], shapes, notes) for name in bodies}
    for group in reversed(groups):
        if group.is_light:
            inertia[group.bodies[0]] = _light(group, groups, inertia)
    data: dict[str, Any] = {"bodies": [], "joints": _joints(robot, groups, start, frames, names, joint_names)}
    for name in bodies:
        entry = {"name": names[name], "surfaces": surfaces[name], "position": frames[name].translation.tolist()}
        entry["rotation"] = rotation_vector(frames[name].rotation).tolist()
        given = inertia[name]
        if given is None:
            entry["rigid"] = {"density": DENSITY}
        else:
            entry["rigid"] = {
                "mass": given.mass,
                "inertia": given.in_frame().tolist(),
                "center": given.placement.translation.tolist(),
            }
            entry["surfaces"] = surfaces[name] or entries(box_of(given), Placement())
        data["bodies"].append(entry)
    unseen = [names[name] for name in bodies if not surfaces[name]]
    for name in unseen:
        notes.add("link without collision geometry: it touches nothing", name)
    if unseen and len(bodies) > 1:
        data["contact_pairs"] = [{"first": unseen, "second": "*", "collide": False}]
    data |= {"gravity": [0.0, 0.0, -9.81], "solver": {"kind": "implicit"}}
    lines = {names[name]: robot.links[name].line for name in bodies}
    return data, lines | {joint_names[name]: joint.line for name, joint in robot.joints.items()}


def _names(given: list[str], kind: str, notes: Notes) -> dict[str, str]:
    """A name that a scene allows for each of the given ones."""
    names: dict[str, str] = {}
    taken = {".", ".."}
    for name in given:
        allowed = "".join("_" if c in '/\\:*?"<>|' or not c.isprintable() else c for c in name)[:90]
        free, k = allowed, 1
        while free in taken:
            k += 1
            free = f"{allowed}_{k}"
        if free != name:
            notes.add("renamed", f"{kind} {name!r} is {free!r}")
        names[name] = free
        taken.add(free)
    return names


def start_of(robot: Robot, notes: Notes) -> dict[str, float]:
    """By joint, the coordinate at which it begins: zero, or the nearest one of its limits; that of `mimic` follows."""
    start: dict[str, float] = {}
    for joint in robot.joints.values():
        chain: list[RobotJoint] = []
        here: RobotJoint | None = joint
        while here is not None and here not in chain and here.name not in start:
            chain.append(here)
            here = robot.joints.get(here.mimic.joint) if here.mimic is not None else None
        for one in reversed(chain):
            wish = 0.0
            if one.mimic is not None:
                wish = one.mimic.multiplier * start.get(one.mimic.joint, 0.0) + one.mimic.offset
            low, high = one.limits or (-np.inf, np.inf)
            start[one.name] = float(np.clip(wish, low, high))
            if low > 0.0 or high < 0.0:
                notes.add("zero is outside of the limits: it begins at their nearest end", f"joint {one.name!r}")
    return start


def _frames(robot: Robot, start: dict[str, float]) -> dict[str, Placement]:
    """Where the links' frames are in the world, parents first, with the root at the origin."""
    frames = {robot.root: Placement()}
    for name in robot.downwards()[1:]:
        joint = robot.above[name]
        frames[name] = frames[joint.parent].then(joint.placement).then(joint.moved(start[joint.name]))
    return frames


def _inertia(robot: Robot, name: str, surfaces: list[dict[str, Any]], shapes: Shapes, notes: Notes) -> Inertia | None:
    """That of a link, as a body can have it; None where it has no mass."""
    given = robot.links[name].inertia
    if given is None:
        return None
    tensor = projected(given)
    if tensor is given.tensor:
        return given
    if tensor is not None:
        notes.add("inertia that no solid has, replaced by the nearest one", f"link {name!r}")
    elif surfaces:
        notes.add("inertia is zero: that of its collision geometry", f"link {name!r}")
        solid = of_solid(shapes.surface(surfaces), f"link {name!r}")
        return Inertia(
            given.mass, given.mass / solid.mass * solid.inertia, Placement(translation=given.placement.translation)
        )
    else:
        notes.add("inertia is zero: that of a ball of 1000 kg/m^3", f"link {name!r}")
        tensor = of_ball(given.mass)
    return Inertia(given.mass, tensor, given.placement)


def _light(group: Group, groups: list[Group], inertia: dict[str, Inertia | None]) -> Inertia:
    """That of a link without mass between joints: a small part of the lightest body that it carries."""
    carried = [
        inertia[other.bodies[0]]
        for other in groups
        if other.above is not None and other.above.parent in group.links and other.bodies
    ]
    masses = [(one.mass, float(np.linalg.eigvalsh(one.tensor)[0])) for one in carried if one is not None]
    mass, moment = min(masses, default=(1.0, 1e-3))
    return Inertia(_LIGHT * mass, _LIGHT * moment * np.eye(3), Placement())


def _joints(
    robot: Robot,
    groups: list[Group],
    start: dict[str, float],
    frames: dict[str, Placement],
    names: dict[str, str],
    joint_names: dict[str, str],
) -> list[dict[str, Any]]:
    carrier = {name: body for group in groups for name, body in group.carrier.items()}
    entries = []
    for group in groups:
        for body in group.bodies:
            # The first body of a group has its joint; the others are fixed to those above them.
            joint = group.above if group.above is not None and body == group.bodies[0] else robot.above.get(body)
            if joint is None:
                entries.append({"kind": "fixed", "first": names[body], "name": f"{names[body]} to the world"[:100]})
            elif joint.kind != "floating":
                parent = carrier[joint.parent]
                ends = {"first": names[body]} | ({} if parent is None else {"second": names[parent]})
                entries.append({**_joint(joint, start[joint.name], frames), **ends, "name": joint_names[joint.name]})
    return entries


def _joint(joint: RobotJoint, start: float, frames: dict[str, Placement]) -> dict[str, Any]:
    frame = frames[joint.parent].then(joint.placement)
    entry: dict[str, Any] = {"kind": _KINDS[joint.kind], "point": frame.translation.tolist()}
    if joint.kind == "fixed":
        return entry
    entry["axis"] = (frame.rotation @ joint.axis).tolist()
    if joint.kind == "planar":
        return entry
    if joint.limits is not None:
        entry["limits"] = list(joint.limits)
    if start != 0.0:
        entry["start"] = start
    given = {"damping": joint.damping, "friction": joint.friction}
    given |= {"max_effort": joint.effort, "max_velocity": joint.velocity}
    return entry | {key: value for key, value in given.items() if value > 0.0}
