"""Checks of the parameters of shapes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.errors import MeshError
from supple.mesh.checked_arrays import LARGEST_LENGTH
from supple.runtime.memory import require_memory

# With more tets or triangles than this, the sizes given are most likely a typing error.
MAX_ELEMENTS = 50_000_000
# To make a mesh, with its topology, at most; measured on a box and on a sphere.
BYTES_PER_ELEMENT = 1000


def positive(owner: str, **sizes: Any) -> None:
    """Raise for lengths that are not positive numbers, or beyond those of meshes."""
    for name, value in sizes.items():
        if (
            isinstance(value, bool)
            or not isinstance(value, int | float | np.number)
            or not 0.0 < value <= LARGEST_LENGTH
        ):
            raise MeshError(f"{owner}: {name} is {value!r}; give a positive length in metres, of 1e90 at most")


def edge_or_share(owner: str, edge_length: float | None, share: float, **sizes: Any) -> float:
    """The length of edges, or without one a share of the smallest of the sizes; all are checked."""
    positive(owner, **sizes)
    edge = share * min(sizes.values()) if edge_length is None else edge_length
    positive(owner, edge_length=edge)
    return float(edge)


def lengths(owner: str, name: str, value: Sequence[float]) -> NDArray[np.float64]:
    """Three positive lengths."""
    try:
        array = np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        array = np.empty(0)
    if array.shape != (3,) or not ((array > 0.0) & (array <= LARGEST_LENGTH)).all():
        raise MeshError(f"{owner}: {name} is {value!r}; give three positive lengths in metres, of 1e90 at most")
    return array


def counts(owner: str, name: str, value: Sequence[int]) -> tuple[int, int, int]:
    """Three positive whole numbers."""
    array = np.asarray(value)
    if array.shape != (3,) or array.dtype.kind not in "iu" or not (array > 0).all():
        raise MeshError(f"{owner}: {name} is {value!r}; give three whole numbers, each 1 or more")
    return int(array[0]), int(array[1]), int(array[2])


def not_too_many(owner: str, elements: float, remedy: str) -> None:
    """Raise for shapes that would not fit into memory."""
    if elements > MAX_ELEMENTS:
        raise MeshError(f"{owner}: this would be {elements:.3g} elements, more than {MAX_ELEMENTS}; {remedy}")
    require_memory(BYTES_PER_ELEMENT * elements, f"{owner}: a mesh of {elements:.3g} elements", remedy, MeshError)


def fits(owner: str, edge_length: float, name: str, length: float) -> None:
    """Raise for edges longer than the length that they should resolve."""
    # With a tolerance, so that 0.1 is not longer than 0.3 / 3.
    if edge_length > length * (1.0 + 1e-9):
        raise MeshError(
            f"{owner}: edge_length = {edge_length:g} m is longer than {name} = {length:g} m; make it shorter"
        )


def edge_of_torus(owner: str, radius: float, tube_radius: float, edge_length: float | None) -> float:
    """The length of edges; raises for tori without a hole, and for edges longer than the tube's radius."""
    positive(owner, radius=radius)
    edge = edge_or_share(owner, edge_length, 0.4, tube_radius=tube_radius)
    if tube_radius >= radius:
        raise MeshError(
            f"{owner}: tube_radius = {tube_radius:g} m closes the ring of radius {radius:g} m; make it smaller"
        )
    fits(owner, edge, "tube_radius", tube_radius)
    return edge
