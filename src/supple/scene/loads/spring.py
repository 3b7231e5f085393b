"""Springs between two points of bodies, or of a body and the world."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from supple.errors import SceneError
from supple.mesh.skin import Embedding
from supple.scene.body import PlacedBody
from supple.scene.loads.load import Load, body_of
from supple.scene.loads.over_time import OverTime, checked_magnitude
from supple.scene.rigid.rigid_body import RigidBody
from supple.scene.values import check_name, finite_vector, positive

Point = tuple[str | None, Any]


@dataclass(frozen=True, eq=False)
class Spring(Load):
    """A linear spring, k / 2 (l - l0)^2, between two points that move with their bodies. Internal where both do.

    Parameters
    ----------
    first, second : ("finger", 12), a vertex of a body's mesh, or of a rigid body's surface; ("finger", (x, y, z)), a
        place inside of it in its own coordinates [m], and anywhere for a rigid body; or (None, (x, y, z)), a fixed
        place in the world.
    stiffness : k [N/m], above zero.
    rest_length : l0 [m]; a number, a `Curve`, or a function of time [s]; None for the distance at the start.
    name : appears in messages.

    Raises
    ------
    SceneError : where a value is of the wrong kind or out of range.
    """

    kind: ClassVar[str] = "spring"

    first: Point
    second: Point
    stiffness: float
    rest_length: OverTime | None = None
    name: str | None = None

    def __post_init__(self) -> None:
        if self.name is not None:
            check_name(self.name, self.kind)
        for key in ("first", "second"):
            object.__setattr__(self, key, self._checked_point(key))
        if self.first[0] is None and self.second[0] is None:
            raise SceneError(f"{self.label}: both ends are fixed in the world; give at least one point of a body")
        object.__setattr__(self, "stiffness", positive(self.stiffness, f"{self.label}: stiffness"))
        if self.rest_length is not None:
            given = checked_magnitude(self.rest_length, f"{self.label}: rest_length")
            object.__setattr__(self, "rest_length", given)

    @property
    def bodies(self) -> tuple[str, ...]:
        return tuple(name for name, _ in (self.first, self.second) if name is not None)

    def check(self, bodies: Sequence[PlacedBody]) -> None:
        first, second = (self.corners(key, bodies) for key in ("first", "second"))
        if first[0] == second[0] and all(np.array_equal(a, b) for a, b in zip(first[1:3], second[1:3], strict=True)):
            raise SceneError(f"{self.label}: both ends are the same point of body {first[0]!r}; give two points")

    def corners(
        self, key: str, bodies: Sequence[PlacedBody]
    ) -> tuple[str | None, NDArray[np.int32], NDArray[np.float64], NDArray[np.float64]]:
        """One end: its body, vertices (4,) of the body, weights (4,), and what is added to their sum (3,) [m].

        Raises
        ------
        SceneError : where the body or the vertex does not exist, or the place is outside of the body.
        """
        name, place = getattr(self, key)
        if name is None:
            return None, np.zeros(4, dtype=np.int32), np.zeros(4), place
        body = body_of(name, bodies, f"{self.label}: {key}")
        if isinstance(place, int):
            if place >= len(body.points):
                raise SceneError(
                    f"{self.label}: {key}: vertex {place} of body {name!r} does not exist; it has {len(body.points)}"
                )
            point = body.embedded.taken(np.array([place]))
            corners, weights = np.full(4, point.vertices[0], dtype=np.int32), np.zeros(4)
            corners[: len(point.vertices)], weights[: len(point.weights)] = point.vertices, point.weights
            return name, corners, weights, np.zeros(3)
        if isinstance(body, RigidBody):
            return name, np.arange(4, dtype=np.int32), body.weights_of(place[None])[0], np.zeros(3)
        held = Embedding.of(body.mesh, place[None])
        if held.outside[0]:
            low, high = body.mesh.vertices.min(axis=0), body.mesh.vertices.max(axis=0)
            raise SceneError(
                f"{self.label}: {key}: {place.tolist()} is outside of body {name!r}; its mesh reaches from "
                f"{low.round(6).tolist()} to {high.round(6).tolist()}"
            )
        return name, held.corners[0].astype(np.int32), held.weights[0], np.zeros(3)

    def _checked_point(self, key: str) -> Point:
        given = getattr(self, key)
        try:
            name, place = given
        except (TypeError, ValueError):
            raise SceneError(f"{self.label}: {key} is {given!r}; give (body, vertex) or (body, (x, y, z))") from None
        if name is not None:
            check_name(name, f"{self.label}: {key}: body")
        if isinstance(place, (int, np.integer)) and not isinstance(place, bool):
            if name is None:
                raise SceneError(f"{self.label}: {key}: the world has no vertices; give (None, (x, y, z))")
            if place < 0:
                raise SceneError(f"{self.label}: {key}: vertex {place} is negative; vertices are counted from 0")
            return name, int(place)
        return name, finite_vector(place, f"{self.label}: {key}: place")
