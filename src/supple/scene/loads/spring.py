"""Springs between two points of bodies, or of a body and the world."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import NDArray

from supple.errors import SceneError
from supple.kinds.validators import NON_NEGATIVE, POSITIVE, Name
from supple.scene.body import PlacedBody
from supple.scene.loads.load import Load
from supple.scene.loads.over_time import OverTime, OverTimeOf, script_of
from supple.scene.loads.points import Point, PointValidator, point_corners

LENGTH = OverTimeOf(bounds=NON_NEGATIVE)


@dataclass(frozen=True, eq=False)
class Spring(Load):
    """A linear spring, k / 2 (l - l0)^2, between two points that move with their bodies. Internal where both do.

    Parameters
    ----------
    first, second : ("finger", 12), a vertex of a body's mesh, or of a rigid body's surface; ("finger", (x, y, z)), a
        place inside of it in its own coordinates [m], and anywhere for a rigid body; or (None, (x, y, z)), a fixed
        place in the world.
    stiffness : k [N/m], above zero.
    rest_length : l0 [m]; a number, a `Curve`, or a function of time; None for the distance at the start.
    name : appears in messages.

    Raises
    ------
    SceneError : where a value is of the wrong kind or out of range.
    """

    kind: ClassVar[str] = "spring"

    first: Annotated[Point, PointValidator()]
    second: Annotated[Point, PointValidator()]
    stiffness: Annotated[float, POSITIVE]
    rest_length: Annotated[OverTime | None, LENGTH] = None
    name: Annotated[str | None, Name()] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.first[0] is None and self.second[0] is None:
            raise SceneError(f"{self.label}: both ends are fixed in the world; give at least one point of a body")

    def check(self, bodies: Sequence[PlacedBody]) -> None:
        first, second = (self.corners(key, bodies) for key in ("first", "second"))
        if first[0] == second[0] and all(np.array_equal(a, b) for a, b in zip(first[1:3], second[1:3], strict=True)):
            raise SceneError(f"{self.label}: both ends are the same point of body {first[0]!r}; give two points")

    def corners(
        self, key: str, bodies: Sequence[PlacedBody]
    ) -> tuple[str | None, NDArray[np.int32], NDArray[np.float64], NDArray[np.float64]]:
        """One end; see `point_corners`."""
        return point_corners(getattr(self, key), bodies, f"{self.label}: {key}")

    def pull_at_start(self, bodies: Sequence[PlacedBody]) -> float:
        """The size of its force where the scene places everything [N]; zero where a function gives the rest length,
        whose values a recording has only of its frames."""
        if self.rest_length is None or callable(self.rest_length):
            return 0.0
        ends = []
        for key in ("first", "second"):
            name, corners, weights, beyond = self.corners(key, bodies)
            body = next((one for one in bodies if one.name == name), None)
            ends.append(beyond if body is None else weights @ body.place(body.mesh.vertices)[corners])
        length = float(np.linalg.norm(ends[0] - ends[1]))
        return self.stiffness * abs(length - float(script_of(self, "rest_length")(0.0)))
