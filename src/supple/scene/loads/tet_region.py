"""Tets of a body that a load acts in, and a direction in each of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import SceneError
from supple.kinds.checks import float_array, unit_vectors
from supple.kinds.validators import Validator
from supple.scene.body import PlacedBody
from supple.scene.selection import InBox

TetRegion = ArrayLike | InBox | None


def tets_in(tets: TetRegion, body: PlacedBody, label: str) -> NDArray[np.int64]:
    """The numbers (m,) of the tets: all, those with all four corners in the box at the start, or those given.

    Raises
    ------
    SceneError : where none exists, or one does not exist.
    """
    count = len(body.mesh.tets)
    if not count:
        raise SceneError(f"{label}: {body.label} has no tets; give a body of tets")
    if tets is None:
        return np.arange(count)
    if isinstance(tets, InBox):
        inside = np.zeros(len(body.mesh.vertices), dtype=bool)
        inside[tets.select(body.place(body.mesh.vertices))] = True
        rows = np.flatnonzero(inside[body.mesh.tets].all(axis=1))
        if len(rows) == 0:
            raise SceneError(f"{label}: its box holds no tet; make it larger, or give numbers of tets")
        return rows
    rows = np.asarray(tets)
    if rows.max() >= count:
        raise SceneError(f"{label}: tet {rows.max()} does not exist; the body has {count}")
    return rows


@dataclass(frozen=True)
class Directions(Validator):
    """(3,) or (m, 3) vectors of any length above zero, stored as unit vectors; a scene file has one."""

    def checked(self, value: Any, what: str) -> NDArray[np.float64]:
        given = float_array(value, what, "give three numbers, or three for each tet")
        if given.shape != (3,) and (given.ndim != 2 or given.shape[1] != 3):
            raise SceneError(f"{what} has shape {given.shape}; give (3,), or (m, 3) for m tets")
        largest = np.abs(given).max(axis=-1, keepdims=True)
        if not (np.isfinite(largest).all() and (largest > 0.0).all()):
            raise SceneError(f"{what} is zero or not finite; give vectors of any length above zero")
        return unit_vectors(given)


def directions_of(direction: ArrayLike, rows: NDArray[np.int64], label: str) -> NDArray[np.float64]:
    """(m, 3) one direction for each of the tets.

    Raises
    ------
    SceneError : where there is another number of directions.
    """
    directions = np.asarray(direction)
    if directions.ndim == 2 and len(directions) != len(rows):
        raise SceneError(f"{label}: there are {len(directions)} directions for {len(rows)} tets; give one each")
    return np.broadcast_to(directions, (len(rows), 3))
