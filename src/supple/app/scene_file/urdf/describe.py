"""A robot as the data of a scene file: rigid bodies, joints, and gravity along -z.

Every link with mass is a rigid body of its first collision geometry. A link without mass is a frame: what is joined to
it is joined to its parent. The root is held, unless a joint of the kind "floating" joins it to the world.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.app.scene_file.urdf.robot import Geometry, Inertia, Link, Placement, Robot, RobotJoint
from supple.errors import SceneError

# The edges of spheres and cylinders, as a share of the radius.
_EDGE = 0.5
# As many as a scene file may have; checked before the text of the scene is written and read.
_MOST_BODIES = 10_000


def described(robot: Robot) -> tuple[dict[str, Any], list[str]]:
    """The data of a scene file, and what of the robot it does not contain.

    Raises
    ------
    SceneError : where a link that moves has no mass, or there are too many links.
    """
    frames = _frames(robot)
    missing = list(robot.ignored)
    bodies, unseen = [], []
    moving = [link for link in robot.links.values() if _is_body(link, robot)]
    if len(moving) > _MOST_BODIES:
        raise SceneError(f"{len(moving)} links have a mass; at most {_MOST_BODIES} are read")
    for link in moving:
        bodies.append(_body(link, frames[link.name]))
        if link.collision is None:
            unseen.append(link.name)
    if not bodies:
        raise SceneError("no link has a mass; give <inertial> to those that move")
    joints = []
    if _is_body(robot.links[robot.root], robot):
        joints.append({"kind": "fixed", "first": robot.root, "name": f"{robot.root} to the world"})
    carriers = _carriers(robot, list(frames))
    parents = {joint.parent for joint in robot.joints}
    for joint in robot.joints:
        if not _is_body(robot.links[joint.child], robot):
            if joint.kind != "fixed" and joint.child in parents:
                raise SceneError(f"link {joint.child!r} moves and has no mass; give it an <inertial>")
            continue
        if joint.kind != "floating":
            joints.append(_joint(joint, carriers[joint.parent], frames[joint.child]))
    pairs = [{"first": unseen, "second": "*", "collide": False}] if unseen and len(bodies) > 1 else []
    solver = {"kind": "implicit"}
    data = {"bodies": bodies, "joints": joints, "contact_pairs": pairs, "gravity": [0.0, 0.0, -9.81], "solver": solver}
    return data, missing


def _is_body(link: Link, robot: Robot) -> bool:
    return link.inertia is not None or (link.name == robot.root and link.collision is not None)


def _carriers(robot: Robot, downwards: list[str]) -> dict[str, str | None]:
    """By link, the nearest one from it upwards that is a body; None for the world. downwards : parents first."""
    above = {joint.child: joint.parent for joint in robot.joints}
    carriers: dict[str, str | None] = {}
    for name in downwards:
        is_body = _is_body(robot.links[name], robot)
        carriers[name] = name if is_body else carriers.get(above.get(name, ""))
    return carriers


def _frames(robot: Robot) -> dict[str, Placement]:
    """Where the links' frames are in the world, parents first, with all joints at zero and the root at the origin."""
    frames = {robot.root: Placement()}
    children: dict[str, list[RobotJoint]] = {}
    for joint in robot.joints:
        children.setdefault(joint.parent, []).append(joint)
    waiting = [robot.root]
    while waiting:
        name = waiting.pop()
        for joint in children.get(name, []):
            frames[joint.child] = frames[name].then(joint.placement)
            waiting.append(joint.child)
    return frames


def _body(link: Link, frame: Placement) -> dict[str, Any]:
    inertia, geometry = link.inertia, link.collision
    if geometry is None:
        assert inertia is not None
        geometry = _box_of(inertia)
    source, turned = _shape(geometry)
    own = geometry.placement.then(turned)
    placed = frame.then(own)
    entry = {
        "name": link.name,
        **source,
        "position": placed.translation.tolist(),
        "rotation": _rotation_vector(placed.rotation).tolist(),
    }
    if inertia is None:  # the root, which is held
        return {**entry, "rigid": {"density": 1000.0}}
    # In the coordinates of the geometry.
    R = own.rotation.T @ inertia.placement.rotation
    center = own.rotation.T @ (inertia.placement.translation - own.translation)
    tensor = R @ inertia.tensor @ R.T
    rigid = {"mass": inertia.mass, "inertia": (0.5 * (tensor + tensor.T)).tolist(), "center": center.tolist()}
    return {**entry, "rigid": rigid}


def _shape(geometry: Geometry) -> tuple[dict[str, Any], Placement]:
    """The entry of a body's shape, and how the shape is turned: cylinders are along y here, and along z in a URDF."""
    numbers = geometry.numbers
    if geometry.kind == "mesh":
        return {"mesh": {"file": geometry.file, "scale": numbers[0]}}, Placement()
    if geometry.kind == "box":
        return {"shape": {"kind": "box", "size": list(numbers), "divisions": [1, 1, 1]}}, Placement()
    shape: dict[str, Any] = {"kind": geometry.kind, "radius": numbers[0], "edge_length": _EDGE * numbers[0]}
    if geometry.kind == "sphere":
        return {"shape": shape}, Placement()
    upright = Placement(np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]))
    return {"shape": {**shape, "height": numbers[1]}}, upright


def _box_of(inertia: Inertia) -> Geometry:
    """The box with the same inertia, for a link without collision geometry."""
    moments, axes = np.linalg.eigh(inertia.tensor)
    if np.linalg.det(axes) < 0.0:
        axes[:, 0] *= -1.0
    squares = 6.0 / inertia.mass * (moments.sum() - 2.0 * moments)
    sides = np.sqrt(np.maximum(squares, 1e-12 * max(float(squares.max()), 1e-12)))
    return Geometry("box", tuple(sides.tolist()), inertia.placement.then(Placement(axes)))


def _joint(joint: RobotJoint, second: str | None, frame: Placement) -> dict[str, Any]:
    kinds = {"fixed": "fixed", "revolute": "hinge", "continuous": "hinge", "prismatic": "slider"}
    entry: dict[str, Any] = {"kind": kinds[joint.kind], "first": joint.child, "name": joint.name}
    if second is not None:
        entry["second"] = second
    entry["point"] = frame.translation.tolist()
    if joint.kind == "fixed":
        return entry
    entry["axis"] = (frame.rotation @ joint.axis).tolist()
    if joint.limits is not None:
        entry["limits"] = list(joint.limits)
    given = {"damping": joint.damping, "friction": joint.friction}
    given |= {"max_effort": joint.effort, "max_velocity": joint.velocity}
    return entry | {key: value for key, value in given.items() if value > 0.0}


def _rotation_vector(R: NDArray[np.float64]) -> NDArray[np.float64]:
    """(3,) whose rotation is R."""
    from scipy.spatial.transform import Rotation

    return Rotation.from_matrix(R).as_rotvec()
