"""Reading a URDF file: links with inertia and collision geometry, and the joints between them.

What this file does not read is named in `Robot.ignored`.

Source: the specification of URDF, https://wiki.ros.org/urdf/XML.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from supple.app.scene_file.entries.mesh_sources import SURFACE_FILES
from supple.app.scene_file.urdf.elements import Problem, attribute, child_of, ignore_others, numbers, only, parsed
from supple.app.scene_file.yaml_files import printable
from supple.errors import SceneError
from supple.scene.rotation import rotation_matrix

JOINTS = ("fixed", "revolute", "continuous", "prismatic", "floating")


@dataclass(frozen=True, eq=False)
class Placement:
    """Rotation (3, 3) and translation (3,) [m]: a point X is at rotation @ X + translation."""

    rotation: NDArray[np.float64] = field(default_factory=lambda: np.eye(3))
    translation: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3))

    def then(self, inner: Placement) -> Placement:
        """The placement of what `inner` places in this frame."""
        return Placement(self.rotation @ inner.rotation, self.rotation @ inner.translation + self.translation)


@dataclass(frozen=True, eq=False)
class Geometry:
    """A collision geometry: kind "box" (3 lengths), "cylinder" (radius, height), "sphere" (radius) or "mesh" (scale).

    file : of a mesh, relative to the URDF's folder
    """

    kind: str
    numbers: tuple[float, ...]
    placement: Placement
    file: str = ""


@dataclass(frozen=True, eq=False)
class Inertia:
    """mass : [kg]; tensor : (3, 3) about the center [kg m^2], in the axes of `placement`, which has the center."""

    mass: float
    tensor: NDArray[np.float64]
    placement: Placement


@dataclass(frozen=True, eq=False)
class Link:
    """One link; without `inertia` it is a frame without mass."""

    name: str
    inertia: Inertia | None
    collision: Geometry | None


@dataclass(frozen=True, eq=False)
class RobotJoint:
    """One joint: kind of `JOINTS`; placement of the child's frame in the parent's; axis (3,) in the child's.

    limits : lower and upper end, or None; damping, friction : efforts of the joint
    effort : the largest of its motor; velocity : the largest of its coordinate; zero where there is none
    """

    name: str
    kind: str
    parent: str
    child: str
    placement: Placement
    axis: NDArray[np.float64]
    limits: tuple[float, float] | None
    damping: float
    friction: float
    effort: float
    velocity: float


@dataclass(frozen=True, eq=False)
class Robot:
    """A tree of links. ignored : what the file has and this program does not use."""

    name: str
    links: dict[str, Link]
    joints: tuple[RobotJoint, ...]
    root: str
    ignored: tuple[str, ...]


def read_robot(path: Path) -> Robot:
    """Read a URDF file.

    Raises
    ------
    SceneError : where the file cannot be read, or does not describe a tree of links; one line with the path first.
    """
    try:
        return _robot(parsed(path), path.parent)
    except Problem as problem:
        raise SceneError(f"{path}: {problem}") from None


def _robot(root: ElementTree.Element, folder: Path) -> Robot:
    ignored: dict[str, None] = {}
    links = {}
    for element in root.findall("link"):
        link = _link(element, folder, ignored)
        if link.name in links:
            raise Problem(f"two links are called {printable(link.name)!r}; give each a different name")
        links[link.name] = link
    if not links:
        raise Problem("it has no link")
    joints: dict[str, RobotJoint] = {}
    for element in root.findall("joint"):
        joint = _joint(element, links, ignored)
        if joint.name in joints:
            raise Problem(f"two joints are called {printable(joint.name)!r}; give each a different name")
        joints[joint.name] = joint
    for element in root:
        if element.tag not in ("link", "joint", "material"):
            ignored[f"<{printable(str(element.tag))}>"] = None
    return Robot(root.get("name", "robot"), links, tuple(joints.values()), _root(links, joints), tuple(ignored))


def _root(links: dict[str, Link], joints: dict[str, RobotJoint]) -> str:
    """The name of the link that is not a child; raises where the links are not one tree."""
    parents: dict[str, str] = {}
    for joint in joints.values():
        if joint.child in parents:
            raise Problem(f"link {printable(joint.child)!r} is the child of two joints; links must be a tree")
        parents[joint.child] = joint.parent
    roots = [name for name in links if name not in parents]
    if len(roots) > 1:
        text = ", ".join(repr(printable(name)) for name in roots[:5])
        raise Problem(f"links {text} have no parent; join them, so that the links are one tree")
    children: dict[str, list[str]] = {}
    for child, parent in parents.items():
        children.setdefault(parent, []).append(child)
    reached, waiting = set(roots), list(roots)
    while waiting:
        below = children.get(waiting.pop(), [])
        reached.update(below)
        waiting += below
    if len(reached) < len(links):
        here = next(name for name in links if name not in reached)
        for _ in links:  # upwards, into the loop
            here = parents[here]
        raise Problem(f"link {printable(here)!r} is its own ancestor; links must be a tree without loops")
    return roots[0]


def _link(element: ElementTree.Element, folder: Path, ignored: dict[str, None]) -> Link:
    name = attribute(element, "name", "a link")
    what = f"link {printable(name)!r}"
    found = element.findall("collision")
    if len(found) > 1:
        ignored[f"{len(found) - 1} of the {len(found)} collision geometries of {what}"] = None
    collision = _geometry(found[0], what, folder, ignored) if found else None
    inertial = only(element, "inertial", what)
    ignore_others(element, ("inertial", "collision", "visual"), what, ignored)
    return Link(name, None if inertial is None else _inertia(inertial, what), collision)


def _inertia(element: ElementTree.Element, what: str) -> Inertia:
    mass = numbers(child_of(element, "mass", what), "value", what, 1)[0]
    if mass <= 0.0:
        raise Problem(f"{what}: its mass is {mass:g} kg; it must be above zero")
    given = child_of(element, "inertia", what)
    xx, xy, xz, yy, yz, zz = (numbers(given, key, what, 1)[0] for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"))
    return Inertia(mass, np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]), _origin(element, what))


def _geometry(element: ElementTree.Element, what: str, folder: Path, ignored: dict[str, None]) -> Geometry:
    inside = list(child_of(element, "geometry", what))
    if len(inside) != 1:
        raise Problem(f"{what}: its collision geometry has {len(inside)} shapes; give one")
    shape, placement = inside[0], _origin(element, what)
    if shape.tag == "mesh":
        scale = numbers(shape, "scale", what, 3) if "scale" in shape.attrib else (1.0, 1.0, 1.0)
        if not scale[0] == scale[1] == scale[2] > 0.0:
            raise Problem(f"{what}: the scale of its mesh is {scale}; give three equal numbers above zero")
        return Geometry("mesh", scale[:1], placement, _mesh_file(attribute(shape, "filename", what), what, folder))
    keys = {"box": (("size", 3),), "cylinder": (("radius", 1), ("length", 1)), "sphere": (("radius", 1),)}
    if shape.tag not in keys:
        raise Problem(
            f"{what}: geometry <{printable(str(shape.tag))}> does not exist; there are box, cylinder, sphere, mesh"
        )
    lengths = tuple(number for key, count in keys[shape.tag] for number in numbers(shape, key, what, count))
    if min(lengths) <= 0.0:
        raise Problem(f"{what}: its {shape.tag} has a length of {min(lengths):g} m; it must be above zero")
    return Geometry(shape.tag, lengths, placement)


def _mesh_file(name: str, what: str, folder: Path) -> str:
    """The file of a mesh relative to the folder; of a package, below the nearest folder above with its name."""
    path = Path(name.removeprefix("file://"))
    if path.suffix.lower() not in SURFACE_FILES:
        raise Problem(f"{what}: the mesh {printable(name)!r} is not one of {', '.join(SURFACE_FILES)}; convert it")
    if name.startswith("package://"):
        package, _, rest = name.removeprefix("package://").partition("/")
        above = [folder.resolve(), *folder.resolve().parents]
        home = next((one for one in above if one.name == package), None) or next(
            (one / package for one in above[:3] if (one / package).is_dir()), folder
        )
        path = home / rest
    try:
        there = (folder / path).resolve()
        if not there.is_file():
            raise Problem(f"{what}: mesh {printable(name)!r} does not exist")
        return Path(os.path.relpath(there, folder.resolve())).as_posix()
    except (OSError, ValueError):
        raise Problem(f"{what}: the mesh {printable(name)!r} cannot be read") from None


def _joint(element: ElementTree.Element, links: dict[str, Link], ignored: dict[str, None]) -> RobotJoint:
    name = attribute(element, "name", "a joint")
    what = f"joint {printable(name)!r}"
    kind = attribute(element, "type", what)
    if kind not in JOINTS:
        raise Problem(f"{what}: its type {printable(kind)!r} is not supported; there are {', '.join(JOINTS)}")
    parent, child = (attribute(child_of(element, key, what), "link", what) for key in ("parent", "child"))
    for end in (parent, child):
        if end not in links:
            raise Problem(f"{what}: link {printable(end)!r} does not exist")
    if parent == child:
        raise Problem(f"{what}: it joins link {printable(parent)!r} to itself")
    ignore_others(element, ("parent", "child", "origin", "axis", "limit", "dynamics"), what, ignored)
    axis = np.array([1.0, 0.0, 0.0])
    if (given := only(element, "axis", what)) is not None:
        axis = np.array(numbers(given, "xyz", what, 3))
    if kind in ("revolute", "continuous", "prismatic") and not axis.any():
        raise Problem(f"{what}: its axis has no length; give a direction")
    dynamics = only(element, "dynamics", what)
    damping, friction = (
        0.0 if dynamics is None or key not in dynamics.attrib else numbers(dynamics, key, what, 1)[0]
        for key in ("damping", "friction")
    )
    if damping < 0.0 or friction < 0.0:
        raise Problem(f"{what}: its damping or friction is below zero")
    limits = _limits(element, kind, what)
    limit = only(element, "limit", what)
    most = {}
    for key in ("effort", "velocity"):
        most[key] = 0.0 if limit is None or key not in limit.attrib else numbers(limit, key, what, 1)[0]
        if most[key] < 0.0:
            raise Problem(f"{what}: its {key} limit is {most[key]:g}; it must be zero or more")
    return RobotJoint(name, kind, parent, child, _origin(element, what), axis, limits, damping, friction, **most)


def _limits(element: ElementTree.Element, kind: str, what: str) -> tuple[float, float] | None:
    if kind not in ("revolute", "prismatic"):
        return None
    limit = child_of(element, "limit", what)
    low, high = (numbers(limit, key, what, 1)[0] if key in limit.attrib else 0.0 for key in ("lower", "upper"))
    if not low < high:
        raise Problem(f"{what}: its limits are {low:g} and {high:g}; the lower one must be below the upper one")
    return low, high


def _origin(element: ElementTree.Element, what: str) -> Placement:
    """Of the child <origin>: fixed axes, roll about x first, then pitch about y, then yaw about z."""
    origin = only(element, "origin", what)
    if origin is None:
        return Placement()
    place, angles = (
        numbers(origin, key, what, 3) if key in origin.attrib else (0.0, 0.0, 0.0) for key in ("xyz", "rpy")
    )
    R = np.eye(3)
    for angle, axis in zip(angles, np.eye(3), strict=True):
        R = rotation_matrix(angle * axis) @ R
    return Placement(R, np.array(place))
