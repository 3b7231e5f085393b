"""Sensors of contact on the surfaces of bodies."""

from __future__ import annotations

from abc import ABC
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import SceneError
from supple.kinds.forms import Counts, Name, Vector
from supple.kinds.kind import Kind
from supple.scene.body import PlacedBody
from supple.scene.loads.load import TRIANGLES, Region, body_of, surface_region

MOST_CELLS = 1_000_000


class Sensor(Kind, ABC):
    """The base class of sensors: a name, and a region of the surface of one body; see `OnSurface`."""

    name: str
    body: str
    region: Region

    def triangles(self, bodies: Sequence[PlacedBody]) -> NDArray[np.int64]:
        """The rows (t,) of the surface's triangles that it feels.

        Raises
        ------
        SceneError : where the body does not exist, or there is no such triangle.
        """
        return surface_region(self.region, body_of(self.body, bodies, self.label), self.label)


@dataclass(frozen=True, eq=False)
class ForceSensor(Sensor):
    """The force of all contacts on a part of the surface of a body.

    Parameters
    ----------
    name : under which frames have it: `frame.sensors["tip"].force`.
    body : name of the body.
    region : None for the whole surface, an `InBox` that holds all three corners of a triangle at the start, or rows of
        `mesh.surface.triangles`.

    Raises
    ------
    SceneError : where a value is of the wrong kind.
    """

    kind: ClassVar[str] = "force"
    title: ClassVar[str] = "force sensor"

    name: Annotated[str, Name()]
    body: Annotated[str, Name()]
    region: Annotated[Region, TRIANGLES] = None


@dataclass(frozen=True, eq=False)
class Taxels(Sensor):
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
    body: Annotated[str, Name()]
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


SENSORS: tuple[type[Sensor], ...] = (ForceSensor, Taxels)
