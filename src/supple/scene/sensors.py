"""Sensors: forces of contact on surfaces, angles and distances.

What they feel is computed in `supple.results.readings.sensor_readings`.
"""

from __future__ import annotations

from abc import ABC
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import SceneError
from supple.kinds.kind import Kind
from supple.kinds.validators import BodyName, Counts, Direction, Name, Vector
from supple.scene.body import PlacedBody
from supple.scene.loads.load import TRIANGLES, Region, body_of, raise_for_rods, surface_region
from supple.scene.loads.points import Point, PointValidator, point_corners
from supple.scene.rigid.rigid_body import RigidBody
from supple.scene.selection import OnVertices, Selection, Vertices

MOST_CELLS = 1_000_000


class Sensor(Kind, ABC):
    """The base class of sensors, which have a name."""

    name: str

    def check(self, bodies: Sequence[PlacedBody]) -> None:
        """Raise `SceneError` where it does not fit these bodies."""


class SurfaceSensor(Sensor):
    """The base class of sensors on a region of the surface of one body; see `OnSurface`."""

    body: str
    region: Region

    def check(self, bodies: Sequence[PlacedBody]) -> None:
        self.triangles(bodies)

    def triangles(self, bodies: Sequence[PlacedBody]) -> NDArray[np.int64]:
        """The rows (t,) of the surface's triangles that it feels.

        Raises
        ------
        SceneError : where the body does not exist, or no such triangle exists.
        """
        return surface_region(self.region, body_of(self.body, bodies, self.label), self.label)


@dataclass(frozen=True, eq=False)
class ForceSensor(SurfaceSensor):
    """The force of all contacts, or of those with one other thing, on a part of the surface of a body.

    Parameters
    ----------
    name : under which frames have it: `frame.sensors["tip"].force`.
    body : name of the body.
    region : None for the whole surface, an `InBox` that holds all three corners of a triangle at the start, or rows of
        `mesh.surface.triangles`.
    by : name of the body or obstacle whose contacts are felt; None for all.

    Raises
    ------
    SceneError : where a value is of the wrong kind.
    """

    kind: ClassVar[str] = "force"
    title: ClassVar[str] = "force sensor"

    name: Annotated[str, Name()]
    body: Annotated[str, BodyName()]
    region: Annotated[Region, TRIANGLES] = None
    by: Annotated[str | None, BodyName(obstacles=True)] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.by == self.body:
            raise SceneError(f"{self.label}: by is its own body, {self.body!r}; name another body or an obstacle")


@dataclass(frozen=True, eq=False)
class Taxels(SurfaceSensor):
    """A grid of cells on the surface of a body that feel normal and shear force.

    The grid is a parallelogram in the coordinates of the body's mesh at rest. What touches the surface belongs to the
    cell into which its place at rest projects along the normal of the grid; outside of the grid, to none.

    Parameters
    ----------
    name : under which frames have it: `frame.sensors["palm"].normal`.
    body : name of the body.
    corner : (3,) of the grid [m]; first, second : (3,) its two sides from there [m]
    cells : (rows, columns), the numbers of cells along `first` and `second`
    region : the part of the surface that feels, as of `ForceSensor`: without it also the opposite side of the body.

    Raises
    ------
    SceneError : where a value is of the wrong kind or out of range, or the two sides are parallel.
    """

    kind: ClassVar[str] = "taxels"

    name: Annotated[str, Name()]
    body: Annotated[str, BodyName()]
    corner: Annotated[ArrayLike, Vector()]
    first: Annotated[ArrayLike, Vector()]
    second: Annotated[ArrayLike, Vector()]
    cells: Annotated[tuple[int, int], Counts(2)]
    region: Annotated[Region, TRIANGLES] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        a, b = np.asarray(self.first), np.asarray(self.second)
        if not np.linalg.norm(np.cross(a, b)) > 1e-9 * np.linalg.norm(a) * np.linalg.norm(b):
            raise SceneError(f"{self.label}: first and second are parallel or zero; give two sides of a grid")
        if self.cells[0] * self.cells[1] > MOST_CELLS:
            raise SceneError(f"{self.label}: cells is {self.cells!r}; give at most {MOST_CELLS} cells")

    def triangles(self, bodies: Sequence[PlacedBody]) -> NDArray[np.int64]:
        raise_for_rods(body_of(self.body, bodies, self.label), self.label, "give a ForceSensor")
        return super().triangles(bodies)


@dataclass(frozen=True, eq=False)
class AngleSensor(OnVertices, Sensor):
    """The angle by which vertices of a body have turned since they were placed.

    It is that of the rotation that fits them best (Kabsch, "A solution for the best rotation to relate two sets of
    vectors", 1976), in (-pi, pi] about an axis that is given, otherwise from 0 to pi.

    Parameters
    ----------
    name : under which frames have it: `frame.sensors["bend"].angle`.
    body : name of the body.
    vertices : three or more, not on one line: indices into the body's mesh, or an `InBox`; None for a rigid body.
    axis : (3,) about which the angle is measured, in the world; None for the axis of the rotation.

    Raises
    ------
    SceneError : where a value is of the wrong kind.
    """

    kind: ClassVar[str] = "angle"
    title: ClassVar[str] = "angle sensor"

    name: Annotated[str, Name()]
    body: Annotated[str, BodyName()]
    vertices: Annotated[Selection | None, Vertices()] = None
    axis: Annotated[ArrayLike | None, Direction()] = None

    def check(self, bodies: Sequence[PlacedBody]) -> None:
        body = body_of(self.body, bodies, self.label)
        self.check_kind_of_body(isinstance(body, RigidBody))
        placed = body.place(body.points)
        chosen = placed[self.select(placed)]
        if np.linalg.matrix_rank(chosen - chosen.mean(axis=0), tol=1e-6 * float(np.ptp(placed))) < 2:
            raise SceneError(
                f"{self.label}: its {len(chosen)} vertices are on one line; select three or more that are not"
            )


@dataclass(frozen=True, eq=False)
class DistanceSensor(Sensor):
    """The distance of two points of bodies, or of a body and the world.

    Parameters
    ----------
    name : under which frames have it: `frame.sensors["gap"].distance`.
    first, second : ("finger", 12), a vertex of a body's mesh, or of a rigid body's surface; ("finger", (x, y, z)), a
        place inside of it in its own coordinates [m], and anywhere for a rigid body; or (None, (x, y, z)), a fixed
        place in the world.

    Raises
    ------
    SceneError : where a value is of the wrong kind.
    """

    kind: ClassVar[str] = "distance"
    title: ClassVar[str] = "distance sensor"

    name: Annotated[str, Name()]
    first: Annotated[Point, PointValidator()]
    second: Annotated[Point, PointValidator()]

    def check(self, bodies: Sequence[PlacedBody]) -> None:
        for key in ("first", "second"):
            point_corners(getattr(self, key), bodies, f"{self.label}: {key}")
