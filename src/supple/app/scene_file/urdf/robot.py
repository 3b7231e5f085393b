"""Reading a URDF file: links with inertia and collision geometry, and the joints between them.

Source: the specification of URDF, https://wiki.ros.org/urdf/XML.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from supple.app.scene_file.urdf.elements import Element, Problem, parsed
from supple.app.scene_file.urdf.notes import Notes
from supple.app.scene_file.yaml_files import printable
from supple.scene.rotation import rotation_matrix

JOINTS = ("fixed", "revolute", "continuous", "prismatic", "planar", "floating")

# Of the shapes of a geometry, the attributes with lengths, and how many each has.
_SHAPES = {
    "box": (("size", 3),),
    "cylinder": (("radius", 1), ("length", 1)),
    "capsule": (("radius", 1), ("length", 1)),
    "sphere": (("radius", 1),),
}
_UNUSED = "not used"

T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class Placement:
    """Rotation (3, 3) and translation (3,) [m]: a point X is at rotation @ X + translation."""

    rotation: NDArray[np.float64] = field(default_factory=lambda: np.eye(3))
    translation: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3))

    def then(self, inner: Placement) -> Placement:
        """The placement of what `inner` places in this frame."""
        return Placement(self.rotation @ inner.rotation, self.rotation @ inner.translation + self.translation)

    def relative_to(self, outer: Placement) -> Placement:
        """This placement in the frame of another."""
        back = outer.rotation.T
        return Placement(back @ self.rotation, back @ (self.translation - outer.translation))


@dataclass(frozen=True, eq=False)
class Geometry:
    """A collision geometry: "box" (3 lengths), "cylinder" or "capsule" (radius, length), "sphere" (radius) or "mesh".

    numbers : its lengths [m], or the three scales of a mesh; file : of a mesh, as the URDF names it
    hull : whether its convex hull counts
    """

    kind: str
    numbers: tuple[float, ...]
    placement: Placement
    file: str = ""
    hull: bool = False


@dataclass(frozen=True, eq=False)
class Inertia:
    """mass : [kg], above zero; tensor : (3, 3) about the center [kg m^2], in the axes of `placement`, which has the
    center; zero where the file has none."""

    mass: float
    tensor: NDArray[np.float64]
    placement: Placement

    def in_frame(self) -> NDArray[np.float64]:
        """(3, 3) about the center, in the axes of the link [kg m^2]."""
        tensor = self.placement.rotation @ self.tensor @ self.placement.rotation.T
        return 0.5 * (tensor + tensor.T)


@dataclass(frozen=True, eq=False)
class Link:
    """One link; without `inertia` it has no mass."""

    name: str
    inertia: Inertia | None
    collisions: tuple[Geometry, ...]
    line: int


@dataclass(frozen=True, eq=False)
class Mimic:
    """The coordinate that a joint should have: multiplier * that of another joint + offset."""

    joint: str
    multiplier: float
    offset: float


@dataclass(frozen=True, eq=False)
class RobotJoint:
    """One joint: kind of `JOINTS`; placement of the child's frame in the parent's; axis (3,) in the child's.

    limits : lower and upper end, or None; damping, friction : efforts of the joint
    effort : the largest of its motor; velocity : the largest of its coordinate; zero where none exists
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
    mimic: Mimic | None
    line: int

    def moved(self, q: float) -> Placement:
        """How the child's frame moves with the coordinate."""
        axis = self.axis / (np.linalg.norm(self.axis) or 1.0)
        if self.kind in ("revolute", "continuous"):
            return Placement(rotation_matrix(q * axis))
        return Placement(translation=q * axis) if self.kind == "prismatic" else Placement()


@dataclass(frozen=True, eq=False)
class Robot:
    """A tree of links; links and joints by name, in the file's order."""

    links: dict[str, Link]
    joints: dict[str, RobotJoint]
    root: str

    @cached_property
    def above(self) -> dict[str, RobotJoint]:
        """By link, the joint to its parent."""
        return {joint.child: joint for joint in self.joints.values()}

    def downwards(self) -> list[str]:
        """The links, parents first."""
        children: dict[str, list[str]] = {}
        for joint in self.joints.values():
            children.setdefault(joint.parent, []).append(joint.child)
        order = [self.root]
        for name in order:  # which grows
            order += children.get(name, [])
        return order


def read_robot(path: Path, notes: Notes) -> Robot:
    """Read a URDF file. What it has and this program does not use is noted.

    Raises
    ------
    Problem : where the file cannot be read, or does not describe a tree of links.
    """
    root = parsed(path)
    for element in root.children:
        if element.tag not in ("link", "joint", "material"):
            notes.add(_UNUSED, f"<{element.tag}>")
    links = _by_name(root.all("link"), lambda element: _link(element, notes))
    if not links:
        raise Problem("it has no link")
    joints = _by_name(root.all("joint"), lambda element: _joint(element, links, notes))
    return Robot(links, joints, _root(links, joints))


def _by_name(elements: list[Element], read: Callable[[Element], T]) -> dict[str, T]:
    things: dict[str, T] = {}
    for element in elements:
        if (name := element.text("name")) in things:
            raise element.problem(f"another {element.tag} has this name; give each a different one")
        things[name] = read(element)
    return things


def _root(links: dict[str, Link], joints: dict[str, RobotJoint]) -> str:
    """The name of the link that is not a child; raises where the links are not one tree."""
    parents: dict[str, str] = {}
    for joint in joints.values():
        if joint.child in parents:
            raise Problem(
                f"link {printable(joint.child)!r} is the child of two joints; links must be a tree", joint.line
            )
        parents[joint.child] = joint.parent
    roots = [name for name in links if name not in parents]
    if len(roots) > 1:
        text = ", ".join(repr(printable(name)) for name in roots[:5])
        raise Problem(f"links {text} have no parent; join them, so that the links are one tree", links[roots[1]].line)
    if not roots or len(Robot(links, joints, roots[0]).downwards()) < len(links):
        reached = set(Robot(links, joints, roots[0]).downwards()) if roots else set()
        here = next(name for name in links if name not in reached)
        for _ in links:  # upwards, into the loop
            here = parents[here]
        text = f"link {printable(here)!r} is its own ancestor; links must be a tree without loops"
        raise Problem(text, links[here].line)
    return roots[0]


def _note_others(element: Element, known: tuple[str, ...], notes: Notes) -> None:
    for child in element.children:
        if child.tag not in known:
            notes.add(_UNUSED, f"<{child.tag}> of {element.owner}")


def _link(element: Element, notes: Notes) -> Link:
    _note_others(element, ("inertial", "collision", "visual"), notes)
    found = [_geometry(one, notes) for one in element.all("collision")]
    collisions = tuple(one for one in found if one is not None)
    return Link(element.text("name"), _inertia(element, notes), collisions, element.line)


def _inertia(element: Element, notes: Notes) -> Inertia | None:
    found = element.all("inertial")
    if not found:
        return None
    if len(found) > 1:
        notes.add("several <inertial>, of which the first counts", element.owner)
    inertial = found[0]
    if inertial.only("mass") is None:
        notes.add("<inertial> without <mass>, as if there were none", element.owner)
        return None
    mass = inertial.child("mass").number("value")
    if mass < 0.0:
        raise inertial.problem(f"its mass is {mass:g} kg; it must be zero or more")
    tensor = np.zeros((3, 3))
    if (given := inertial.only("inertia")) is not None:
        xx, yy, zz = (given.number(key) for key in ("ixx", "iyy", "izz"))
        xy, xz, yz = (given.number(key, 0.0) for key in ("ixy", "ixz", "iyz"))
        tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return Inertia(mass, tensor, _origin(inertial)) if mass > 0.0 else None


def _geometry(element: Element, notes: Notes) -> Geometry | None:
    """None where it has no size: such are marks of points."""
    inside = element.child("geometry").children
    if len(inside) != 1:
        raise element.problem(f"its collision geometry has {len(inside)} shapes; give one")
    shape, placement = inside[0], _origin(element)
    if shape.tag == "mesh":
        scale = shape.numbers("scale", 3, 1.0)
        if 0.0 in scale:
            raise shape.problem(f"the scale of its mesh is {scale}; give numbers that are not zero")
        return Geometry("mesh", scale, placement, shape.text("filename"))
    if shape.tag not in _SHAPES:
        names = ", ".join(_SHAPES)
        raise shape.problem(f"geometry <{printable(shape.tag)}> does not exist; there are {names}, mesh")
    lengths = tuple(number for key, count in _SHAPES[shape.tag] for number in shape.numbers(key, count))
    if min(lengths) < 0.0:
        raise shape.problem(f"its {shape.tag} has a length of {min(lengths):g} m; it must be above zero")
    if min(lengths) == 0.0 and (shape.tag, lengths[-1]) != ("capsule", 0.0):
        notes.add("collision geometry of size 0, left out", element.owner)
        return None
    return Geometry(shape.tag, lengths, placement)


def _joint(element: Element, links: dict[str, Link], notes: Notes) -> RobotJoint:
    kind = element.text("type")
    if kind not in JOINTS:
        raise element.problem(f"its type {printable(kind)!r} is not supported; there are {', '.join(JOINTS)}")
    parent, child = (element.child(key).text("link") for key in ("parent", "child"))
    for end in (parent, child):
        if end not in links:
            raise element.problem(f"link {printable(end)!r} does not exist")
    if parent == child:
        raise element.problem(f"it joins link {printable(parent)!r} to itself")
    _note_others(element, ("parent", "child", "origin", "axis", "limit", "dynamics", "mimic"), notes)
    axis = np.array([1.0, 0.0, 0.0])
    if (given := element.only("axis")) is not None:
        axis = np.array(given.numbers("xyz", 3))
    if kind not in ("fixed", "floating") and not axis.any():
        raise element.problem("its axis has no length; give a direction")
    efforts = _amounts(element, "dynamics", ("damping", "friction"))
    most = _amounts(element, "limit", ("effort", "velocity"))
    limits, mimic = _limits(element, kind, notes), None
    if kind != "fixed" and (given := element.only("mimic")) is not None:
        notes.add("<mimic> is not simulated (it only gives the start)", element.owner)
        mimic = Mimic(given.text("joint"), given.number("multiplier", 1.0), given.number("offset", 0.0))
    name, origin, line = element.text("name"), _origin(element), element.line
    damping, friction, effort, velocity = (*efforts, *most)
    joint = RobotJoint(
        name, kind, parent, child, origin, axis, limits, damping, friction, effort, velocity, mimic, line
    )
    if limits is None or limits[0] < limits[1]:
        return joint
    notes.add("fixed, since its limits leave no travel (those that are not given are 0)", element.owner)
    return replace(joint, kind="fixed", placement=origin.then(joint.moved(limits[0])), limits=None, mimic=None)


def _amounts(element: Element, tag: str, keys: tuple[str, ...]) -> list[float]:
    """Attributes of a child that are zero where they are not given, and may not be below."""
    given = element.only(tag)
    values = [0.0 if given is None else given.number(key, 0.0) for key in keys]
    for key, value in zip(keys, values, strict=True):
        if value < 0.0:
            raise element.problem(f"its {key} is {value:g}; it must be zero or more")
    return values


def _limits(element: Element, kind: str, notes: Notes) -> tuple[float, float] | None:
    """The ends of the coordinate; those that are not given are zero, as the format says."""
    if kind not in ("revolute", "prismatic"):
        return None
    limit = element.child("limit")
    low, high = limit.number("lower", 0.0), limit.number("upper", 0.0)
    if low > high:
        raise limit.problem(f"its limits are {low:g} and {high:g}; the lower one must be below the upper one")
    return low, high


def _origin(element: Element) -> Placement:
    """Of the child <origin>: fixed axes, roll about x first, then pitch about y, then yaw about z."""
    origin = element.only("origin")
    if origin is None:
        return Placement()
    R = np.eye(3)
    for angle, axis in zip(origin.numbers("rpy", 3, 0.0), np.eye(3), strict=True):
        R = rotation_matrix(angle * axis) @ R
    return Placement(R, np.array(origin.numbers("xyz", 3, 0.0)))
