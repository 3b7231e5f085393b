"""Cables through points of bodies."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import NDArray

from supple.errors import SceneError
from supple.kinds.kind import Kind
from supple.kinds.validators import NON_NEGATIVE, POSITIVE, Name
from supple.scene.body import PlacedBody
from supple.scene.loads.over_time import OverTime, OverTimeOf
from supple.scene.loads.points import Point, PointList, point_corners
from supple.scene.loads.spring import LENGTH


@dataclass(frozen=True, eq=False)
class Cable(Kind):
    """An elastic cable without mass. It is fixed at its first point, slides through eyelets at those in between, and
    is wound up by a winch at its last point. It pulls and never pushes.

    Parameters
    ----------
    points : two or more, each ("finger", 12), a vertex of a body's mesh; ("finger", (x, y, z)), a place inside of a
        body in its own coordinates [m]; or (None, (x, y, z)), a fixed place in the world.
    length : of the cable without tension [m]; a number, a `Curve`, or a function of time.
    tension : at the winch [N], zero or more; likewise.
    winch_speed : by which the length without tension decreases from the distances at the start [m/s], negative to
        release the cable; likewise. It is integrated from time 0 on.
    stiffness : force per elongation of the whole cable [N/m]; with length and winch_speed only.
    friction : coefficient of friction at the eyelets.
    name : under which reports have it.

    Raises
    ------
    SceneError : where a value is of the wrong kind or out of range.
    """

    kind: ClassVar[str] = "cable"
    exactly_one: ClassVar[tuple[str, ...]] = ("length", "tension", "winch_speed")

    points: Annotated[Sequence[Point], PointList()]
    length: Annotated[OverTime | None, LENGTH] = None
    tension: Annotated[OverTime | None, OverTimeOf(bounds=NON_NEGATIVE)] = None
    winch_speed: Annotated[OverTime | None, OverTimeOf()] = None
    stiffness: Annotated[float | None, POSITIVE] = None
    friction: Annotated[float, NON_NEGATIVE] = 0.0
    name: Annotated[str, Name()] = "cable"

    def __post_init__(self) -> None:
        super().__post_init__()
        if all(name is None for name, _ in self.points):
            raise SceneError(f"{self.label}: all points are fixed in the world; give at least one point of a body")
        if (self.stiffness is None) != (self.tension is not None):
            remedy = "give it" if self.stiffness is None else "it has no effect with tension; leave it out"
            raise SceneError(f"{self.label}: stiffness is {self.stiffness!r}; {remedy}")

    def check(self, bodies: Sequence[PlacedBody]) -> None:
        """Raise `SceneError` where it does not fit these bodies."""
        self.corners(bodies)

    def corners(
        self, bodies: Sequence[PlacedBody]
    ) -> list[tuple[str | None, NDArray[np.int32], NDArray[np.float64], NDArray[np.float64]]]:
        """Its points; see `point_corners`.

        Raises
        ------
        SceneError : where a body or a vertex does not exist, a place is outside of its body, or two points in a row are
            the same.
        """
        found = [point_corners(point, bodies, f"{self.label}: points[{i}]") for i, point in enumerate(self.points)]
        for i, (one, two) in enumerate(pairwise(found)):
            if one[0] == two[0] and all(np.array_equal(a, b) for a, b in zip(one[1:], two[1:], strict=True)):
                raise SceneError(f"{self.label}: points[{i}] and points[{i + 1}] are the same; give each once")
        return found
