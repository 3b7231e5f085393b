"""Points of bodies and of the world, between which springs and cables act."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.errors import SceneError
from supple.kinds.checks import check_name, finite_vector
from supple.kinds.validators import Validator
from supple.mesh.skin import Embedding
from supple.scene.body import PlacedBody
from supple.scene.loads.load import body_of
from supple.scene.rigid.rigid_body import RigidBody

Point = tuple[str | None, Any]


@dataclass(frozen=True)
class PointValidator(Validator):
    """(body, vertex), (body, (x, y, z)) or (None, (x, y, z)), checked as far as possible without the body."""

    def checked(self, value: Any, what: str) -> Point:
        try:
            name, place = value
        except (TypeError, ValueError):
            raise SceneError(f"{what} is {value!r}; give (body, vertex) or (body, (x, y, z))") from None
        if name is not None:
            check_name(name, f"{what}: body")
        if isinstance(place, (int, np.integer)) and not isinstance(place, bool):
            if name is None:
                raise SceneError(f"{what}: the world has no vertices; give (None, (x, y, z))")
            if place < 0:
                raise SceneError(f"{what}: vertex {place} is negative; vertices are counted from 0")
            return name, int(place)
        return name, finite_vector(place, f"{what}: place")

    def bodies(self, value: Point) -> tuple[str, ...]:
        return () if value[0] is None else (value[0],)


@dataclass(frozen=True)
class PointList(Validator):
    """Two points or more."""

    def checked(self, value: Any, what: str) -> tuple[Point, ...]:
        try:
            given = list(value)
        except TypeError:
            given = []
        if len(given) < 2:
            raise SceneError(f"{what} is {value!r}; give two or more")
        return tuple(PointValidator().checked(point, f"{what}[{i}]") for i, point in enumerate(given))

    def bodies(self, value: tuple[Point, ...]) -> tuple[str, ...]:
        return tuple(name for name, _ in value if name is not None)


def point_corners(
    point: Point, bodies: Sequence[PlacedBody], what: str
) -> tuple[str | None, NDArray[np.int32], NDArray[np.float64], NDArray[np.float64]]:
    """A point: its body, vertices (4,) of the body, weights (4,), and what is added to their sum (3,) [m].

    Raises
    ------
    SceneError : where the body or the vertex does not exist, or the place is outside of the body.
    """
    name, place = point
    if name is None:
        return None, np.zeros(4, dtype=np.int32), np.zeros(4), place
    body = body_of(name, bodies, what)
    if isinstance(place, int):
        if place >= len(body.points):
            raise SceneError(f"{what}: vertex {place} of body {name!r} does not exist; it has {len(body.points)}")
        point_there = body.embedded.taken(np.array([place]))
        corners, weights = np.full(4, point_there.vertices[0], dtype=np.int32), np.zeros(4)
        corners[: len(point_there.vertices)], weights[: len(point_there.weights)] = (
            point_there.vertices,
            point_there.weights,
        )
        return name, corners, weights, np.zeros(3)
    if isinstance(body, RigidBody):
        return name, np.arange(4, dtype=np.int32), body.weights_of(place[None])[0], np.zeros(3)
    held = Embedding.of(body.mesh, place[None])
    if held.outside[0]:
        low, high = body.mesh.vertices.min(axis=0), body.mesh.vertices.max(axis=0)
        raise SceneError(
            f"{what}: {place.tolist()} is outside of body {name!r}; its mesh reaches from "
            f"{low.round(6).tolist()} to {high.round(6).tolist()}"
        )
    return name, held.corners[0].astype(np.int32), held.weights[0], np.zeros(3)
