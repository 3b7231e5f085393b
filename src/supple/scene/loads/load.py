"""What loads of bodies have in common: names, and the triangles of surfaces that they act on."""

from __future__ import annotations

from abc import ABC
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import SceneError
from supple.kinds.kind import Kind
from supple.kinds.suggestion import suggestion
from supple.kinds.validators import Validator
from supple.scene.body import PlacedBody
from supple.scene.rod import Rod
from supple.scene.selection import InBox, distinct_numbers


class Load(Kind, ABC):
    """The base class of loads, but for those on vertices alone: `Force` and `SoftTarget`."""

    name: str | None

    def check(self, bodies: Sequence[PlacedBody]) -> None:
        """Raise `SceneError` where it does not fit these bodies."""


def body_of(name: str, bodies: Sequence[PlacedBody], label: str) -> PlacedBody:
    """The body of that name.

    Raises
    ------
    SceneError : where none exists.
    """
    for body in bodies:
        if body.name == name:
            return body
    raise SceneError(f"{label}: body {name!r} does not exist; {suggestion(name, [body.name for body in bodies])}")


Region = ArrayLike | InBox | None


class OnBody(Load):
    """The base class of loads on one body."""

    body: str

    @property
    def label(self) -> str:
        return f"{super().label} on body {self.body!r}"


class OnSurface(OnBody):
    """The base class of loads on triangles of the surface of one body.

    `region` : None for the whole surface, an `InBox` that holds all three corners of a triangle at the start, or rows
    of `mesh.surface.triangles`.
    """

    region: Region

    def check(self, bodies: Sequence[PlacedBody]) -> None:
        self.triangles(body_of(self.body, bodies, self.label))

    def triangles(self, body: PlacedBody) -> NDArray[np.int64]:
        """The rows (t,) of the surface's triangles that it acts on.

        Raises
        ------
        SceneError : where none exists, or a row does not exist.
        """
        raise_for_rods(body, self.label, "give it a Force or a BodyForce")
        return surface_region(self.region, body, self.label)


def raise_for_rods(body: PlacedBody, label: str, remedy: str) -> None:
    """Raise `SceneError` for a rod, whose surface is edges without area."""
    if isinstance(body, Rod):
        raise SceneError(f"{label}: {body.label} is edges, which have no triangles; {remedy}")


def surface_region(region: Region, body: PlacedBody, label: str) -> NDArray[np.int64]:
    """The rows (t,) of the triangles of a body's surface in a region; see `OnSurface`.

    Raises
    ------
    SceneError : where none exists, or a row does not exist.
    """
    triangles = body.triangles
    if region is None:
        return np.arange(len(triangles))
    if isinstance(region, InBox):
        inside = np.zeros(len(body.points), dtype=bool)
        inside[region.select(body.place(body.points))] = True
        rows = np.flatnonzero(inside[triangles].all(axis=1))
        if len(rows) == 0:
            raise SceneError(f"{label}: its box holds no triangle of the surface; make it larger, or give triangles")
        return rows
    rows = np.asarray(region)
    if rows.max() >= len(triangles):
        raise SceneError(f"{label}: triangle {rows.max()} does not exist; the surface has {len(triangles)}")
    return rows


@dataclass(frozen=True)
class Rows(Validator):
    """Numbers of triangles of a surface, or of tets, or an `InBox` that holds all corners of each at the start.

    Attributes
    ----------
    things : what is numbered, in the plural; boxes : whether it may be an `InBox`
    """

    things: str
    boxes: bool = True

    def checked(self, value: Any, what: str) -> Region:
        if isinstance(value, InBox) and self.boxes:
            return value
        return distinct_numbers(value, what, self.things[:-1], self.things, "an InBox, or None")


TRIANGLES, TETS = Rows("triangles"), Rows("tets")
