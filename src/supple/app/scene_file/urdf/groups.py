"""Which links of a robot are bodies, and which belong to others.

Links that fixed joints connect move as one, as a group. In a group, every link with mass is a body; the collision
geometries of a link without mass belong to the nearest body above it, or to the first one of its group. A group
without any mass is

    the world, where it has the root of the robot; its links with collision geometries are bodies that are held
    one body with the mass of its collision geometries, where it has some
    one light body, where groups with mass are joined to it: such are the links between the axes of one joint
    left out, otherwise
"""

from __future__ import annotations

from dataclasses import dataclass, field

from supple.app.scene_file.urdf.notes import Notes
from supple.app.scene_file.urdf.robot import Robot, RobotJoint


@dataclass(eq=False)
class Group:
    """Links that move as one.

    Attributes
    ----------
    links : parents first; above : the joint that moves it, None of the root's
    bodies : links that become bodies; carrier : by link, the body that it belongs to, None for the world
    is_light : whether its body gets a little mass, for want of another
    """

    links: list[str]
    above: RobotJoint | None
    bodies: list[str] = field(default_factory=list)
    carrier: dict[str, str | None] = field(default_factory=dict)
    is_light: bool = False


def groups_of(robot: Robot, notes: Notes) -> list[Group]:
    """The groups of a robot that are simulated, parents first."""
    above = robot.above
    groups: list[Group] = []
    of_link: dict[str, Group] = {}
    for name in robot.downwards():
        joint = above.get(name)
        if joint is not None and joint.kind == "fixed":
            group = of_link[joint.parent]
            group.links.append(name)
        else:
            group = Group([name], joint)
            groups.append(group)
        of_link[name] = group
    needed: set[str] = set()  # links to which a group with mass is joined
    for group in reversed(groups):
        _choose_bodies(group, robot, needed, notes)
        if group.bodies and group.above is not None:
            needed.add(group.above.parent)
        bodies = set(group.bodies)
        first = group.bodies[0] if bodies and group.above is not None else None
        for name in group.links:
            parent = first if name == group.links[0] else group.carrier[above[name].parent]
            group.carrier[name] = name if name in bodies else parent
    return [group for group in groups if group.bodies or group.above is None]


def _choose_bodies(group: Group, robot: Robot, needed: set[str], notes: Notes) -> None:
    massive = [name for name in group.links if robot.links[name].inertia is not None]
    shaped = [name for name in group.links if robot.links[name].collisions]
    if group.above is None:
        # Beside those with mass, of those with shapes: those that no body carries.
        chosen, carried = {*massive, *shaped}, set[str]()
        for name in group.links:
            joint = robot.above.get(name)
            is_carried = joint is not None and joint.parent in carried
            if name in chosen and (robot.links[name].inertia is not None or not is_carried):
                group.bodies.append(name)
            if name in chosen or is_carried:
                carried.add(name)
    elif massive:
        group.bodies = massive
    elif shaped:
        notes.add("link that moves and has no mass: that of its collision geometry, of 1000 kg/m^3", shaped[0])
        group.bodies = group.links[:1]
    elif needed.intersection(group.links):
        notes.add("link that moves, has no mass and carries others: a hundredth of theirs", group.links[0])
        group.bodies, group.is_light = group.links[:1], True
    else:
        notes.add("link that moves, has no mass and carries nothing, left out", group.links[0])
