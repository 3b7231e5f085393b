"""Checks of the numbers that shapes are made from."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.errors import MeshError

# A shape with more tets or triangles than this is a slip of the keyboard: it would fill the memory.
MAX_ELEMENTS = 50_000_000


def positive(owner: str, **sizes: Any) -> None:
    """Refuse lengths that are no positive, finite numbers."""
    for name, value in sizes.items():
        if isinstance(value, bool) or not isinstance(value, int | float | np.number) or not 0.0 < value < math.inf:
            raise MeshError(f"{owner}: {name} is {value!r}; give a positive length in metres")


def lengths(owner: str, name: str, value: Sequence[float]) -> NDArray[np.float64]:
    """Three positive lengths."""
    try:
        array = np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        array = np.empty(0)
    if array.shape != (3,) or not ((array > 0.0) & (array < math.inf)).all():
        raise MeshError(f"{owner}: {name} is {value!r}; give three positive lengths in metres")
    return array


def counts(owner: str, name: str, value: Sequence[int]) -> tuple[int, int, int]:
    """Three positive whole numbers."""
    array = np.asarray(value)
    if array.shape != (3,) or array.dtype.kind not in "iu" or not (array > 0).all():
        raise MeshError(f"{owner}: {name} is {value!r}; give three whole numbers, each 1 or more")
    return int(array[0]), int(array[1]), int(array[2])


def not_too_many(owner: str, elements: float, mend: str) -> None:
    """Refuse shapes that would not fit into memory."""
    if elements > MAX_ELEMENTS:
        raise MeshError(f"{owner}: that makes {elements:.3g} elements, more than {MAX_ELEMENTS}; {mend}")


def fits(owner: str, edge_length: float, name: str, length: float) -> None:
    """Refuse edges that are longer than what they should resolve."""
    # A hair of slack, so that 0.1 counts as no longer than 0.3 / 3.
    if edge_length > length * (1.0 + 1e-9):
        raise MeshError(
            f"{owner}: edge_length = {edge_length:g} m is longer than {name} = {length:g} m; make it shorter"
        )


def check_torus(owner: str, radius: float, tube_radius: float, edge_length: float) -> None:
    """Refuse tori that have no hole, or edges that do not suit them."""
    positive(owner, radius=radius, tube_radius=tube_radius, edge_length=edge_length)
    if tube_radius >= radius:
        raise MeshError(
            f"{owner}: tube_radius = {tube_radius:g} m closes the ring of radius {radius:g} m; make it smaller"
        )
    fits(owner, edge_length, "tube_radius", tube_radius)
