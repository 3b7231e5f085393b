"""What joints of two bodies have in common."""

from __future__ import annotations

from abc import ABC
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import SceneError
from supple.scene.body import PlacedBody
from supple.scene.located import at
from supple.scene.obstacles.obstacle import Obstacle
from supple.scene.rigid.rigid_body import RigidBody
from supple.scene.suggestion import suggestion
from supple.scene.values import check_name, finite_vector, float_array


@dataclass(frozen=True, eq=False)
class Joint(ABC):
    """Two things that move against each other in some ways only: a rigid body, and another, an obstacle or the world.

    Points and axes are those of the world where the scene places everything; there the coordinate of a joint is zero.

    Parameters
    ----------
    first : name of a rigid body.
    second : name of another rigid body, or of an obstacle, whose motion the joint follows; None for the world.
    point : (3,) where the joint is [m]; None for the center of mass of the first.
    collide : whether the two touch each other.
    name : under which reports have the joint; a scene names unnamed joints by kind and number.
    """

    kind: ClassVar[str]
    needs_point: ClassVar[bool] = False

    first: str
    second: str | None = None
    point: ArrayLike | None = None
    collide: bool = False
    name: str | None = None

    def __post_init__(self) -> None:
        if self.name is not None:
            check_name(self.name, "joint")
        check_name(self.first, f"{self.label}: first")
        if self.second is not None:
            check_name(self.second, f"{self.label}: second")
        if self.first == self.second:
            raise SceneError(f"{self.label}: it joins body {self.first!r} to itself; give two different ones")
        if self.point is not None:
            object.__setattr__(self, "point", finite_vector(self.point, f"{self.label}: point"))
        elif self.needs_point:
            raise SceneError(f"{self.label}: there is no point; give point=(x, y, z), where the two are joined [m]")
        if not isinstance(self.collide, bool):
            raise SceneError(f"{self.label}: collide is {self.collide!r}; give True or False")

    @property
    def label(self) -> str:
        """The name of this joint in messages."""
        if self.name:
            return f"joint {self.name!r}"
        return (
            f"{type(self).__name__} of {self.first!r} and {'the world' if self.second is None else repr(self.second)}"
        )

    def check(self, bodies: Mapping[str, PlacedBody], obstacles: Mapping[str, Obstacle]) -> None:
        """Raise `SceneError` where what it joins does not exist, or is soft."""
        with at("first"):
            self._rigid(self.first, bodies)
        if self.second is not None and self.second not in obstacles:
            with at("second"):
                self._rigid(self.second, bodies, obstacles)

    def place(self, body: RigidBody) -> NDArray[np.float64]:
        """(3,) the joint's point in the world, where the scene places its first body [m]."""
        return body.place(body.properties.center) if self.point is None else np.asarray(self.point)

    def _rigid(
        self, name: str, bodies: Mapping[str, PlacedBody], obstacles: Mapping[str, Obstacle] | None = None
    ) -> None:
        if name not in bodies:
            known = [key for key, body in bodies.items() if isinstance(body, RigidBody)] + list(obstacles or ())
            what = "body" if obstacles is None else "body or obstacle"
            raise SceneError(f"{self.label}: there is no {what} {name!r}; {suggestion(name, known)}")
        if not isinstance(bodies[name], RigidBody):
            raise SceneError(f"{self.label}: body {name!r} is soft; joints join rigid bodies")


def checked_limits(limits: object, what: str) -> tuple[float, float]:
    """Two numbers, the first below the second; `what` begins the messages.

    Raises
    ------
    SceneError : where they are not.
    """
    ends = float_array(limits, what, "give two numbers (low, high)")
    if ends.shape != (2,) or np.isnan(ends).any():
        raise SceneError(f"{what} is {limits!r}; give two numbers (low, high)")
    low, high = float(ends[0]), float(ends[1])
    if not low < high:
        raise SceneError(
            f"{what} are ({low:g}, {high:g}), and the first is not below the second; exchange them, or use a FixedJoint"
        )
    return low, high
