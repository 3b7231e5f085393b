"""What joints of two bodies have in common, and what they hold and measure, as data.

Solvers, recordings, checks and pages read these `Conditions`, and none knows a kind of joint. A direction on one of the
two sides is named by the side and the number of the joint's axis, such as "first.0"; "apart" is the point of the first
side minus that of the second. A function of such vectors a, b, d and f has the form

    product   a . b                                    a length with "apart", otherwise a cosine; zero is a condition
    cosine    a . b, of which the coordinate is the angle arccos(a . b)
    angle     atan2(a . d, a . b), over all turns
    twist     atan2(a . d - f . b, a . b + f . d), within half a turn

and further ones can be added, see `supple.model.joints.functions`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import Annotated, Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import SceneError
from supple.kinds.kind import Kind
from supple.kinds.validators import BodyName, Boolean, Name, Vector
from supple.scene.rigid.rigid_body import RigidBody

FREE = (-np.inf, np.inf)
_RIGID = BodyName(soft=False, why="joints join rigid bodies")


class Function(NamedTuple):
    """One function of vectors.

    Attributes
    ----------
    form : see the module; vectors : their names, as many as the form has
    limits : of its coordinate [rad] or [m]; infinite where there are none
    vanishes : whether it is a condition and has to be zero
    """

    form: str
    vectors: tuple[str, ...]
    limits: tuple[float, float] = FREE
    vanishes: bool = False

    @property
    def is_length(self) -> bool:
        """Whether its value is in metres, not in radians."""
        return "apart" in self.vectors


@dataclass(frozen=True)
class Conditions:
    """What a joint holds and measures.

    Attributes
    ----------
    together : whether the points of both sides are the same
    parallel : numbers of the axes that have the same direction on both sides
    functions : further conditions and measures; the first that does not vanish is the joint's coordinate
    lines : the directions that pictures show as long lines
    """

    together: bool = True
    parallel: tuple[int, ...] = ()
    functions: tuple[Function, ...] = ()
    lines: tuple[str, ...] = ()

    @property
    def coordinate(self) -> Function | None:
        """The function that gives the joint's coordinate."""
        return next((one for one in self.functions if not one.vanishes), None)


@dataclass(frozen=True, eq=False)
class Joint(Kind, ABC):
    """Two things that move against each other in some ways only: a rigid body, and another, an obstacle or the world.

    Points and axes are those of the world where the scene places everything; there the coordinate of a joint is zero,
    or its `start`.

    Parameters
    ----------
    first : name of a rigid body.
    second : name of another rigid body, or of an obstacle, whose motion the joint follows; None for the world.
    point : (3,) where the joint is [m]; None for the center of mass of the first.
    collide : whether the two touch each other.
    name : under which reports have the joint; a scene names unnamed joints by kind and number.
    """

    title: ClassVar[str] = "joint"

    first: Annotated[str, _RIGID]
    second: Annotated[str | None, replace(_RIGID, obstacles=True)] = None
    point: Annotated[ArrayLike | None, Vector()] = None
    collide: Annotated[bool, Boolean()] = False
    name: Annotated[str | None, Name()] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.first == self.second:
            raise SceneError(f"{self.label}: it joins body {self.first!r} to itself; give two different ones")

    @property
    def label(self) -> str:
        """The name of this joint in messages."""
        if self.name:
            return f"joint {self.name!r}"
        return (
            f"{type(self).__name__} of {self.first!r} and {'the world' if self.second is None else repr(self.second)}"
        )

    def facts(self, scene: Any) -> str:
        joined = f"{type(self).__name__} of {self.first} and {self.second or 'the world'}"
        return ", ".join(filter(None, [joined, self.summary()]))

    def axes(self) -> NDArray[np.float64]:
        """(3, 3) three perpendicular unit vectors (rows), right-handed, which `conditions` refers to by number."""
        return axes_along(getattr(self, "axis", None))

    def motion_to_start(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Rotation (3, 3) and shift (3,) [m] that took the first from coordinate zero to where it is placed."""
        return np.eye(3), np.zeros(3)

    @abstractmethod
    def conditions(self) -> Conditions:
        """What holds between the two sides, and what is measured."""

    def place(self, body: RigidBody) -> NDArray[np.float64]:
        """(3,) the joint's point in the world, where the scene places its first body [m]."""
        return body.place(body.properties.center) if self.point is None else np.asarray(self.point)


def axes_along(axis: ArrayLike | None) -> NDArray[np.float64]:
    """(3, 3) perpendicular unit vectors (rows), right-handed; the first is the axis, or x without one."""
    e = np.array([1.0, 0.0, 0.0]) if axis is None else np.asarray(axis, dtype=np.float64)
    across = np.cross(e, np.eye(3)[np.argmin(np.abs(e))])
    across /= np.linalg.norm(across)
    return np.array([e, across, np.cross(e, across)], dtype=np.float64)
