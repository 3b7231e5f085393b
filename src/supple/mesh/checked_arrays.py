"""Vertices and elements from a user as checked, read-only arrays."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import MeshError

MAX_VERTICES = np.iinfo(np.int32).max
# Beyond this, squared lengths and determinants overflow without an error [m].
LARGEST_LENGTH = 1e90


def frozen(array: NDArray[Any]) -> NDArray[Any]:
    """The same array, marked read-only."""
    array.setflags(write=False)
    return array


def vertex_array(value: ArrayLike, owner: str) -> NDArray[np.float64]:
    """Vertices (n, 3) as read-only, C-contiguous float64, or a `MeshError` that names the wrong row."""
    try:
        given = np.asarray(value)
        if given.dtype.kind == "c":
            raise ValueError
        array = np.array(given, dtype=np.float64, order="C")
    except (TypeError, ValueError, OverflowError):
        raise MeshError(f"{owner}: vertices are not an array of real numbers; give an array of shape (n, 3)") from None
    if array.ndim != 2 or array.shape[1] != 3:
        raise MeshError(f"{owner}: vertices have shape {array.shape}; they must have shape (n, 3), one x y z per row")
    if len(array) == 0:
        raise MeshError(f"{owner}: vertices are missing; give those of at least one element")
    if len(array) > MAX_VERTICES:
        raise MeshError(f"{owner}: {len(array)} vertices are more than 32-bit indices can count")
    if not np.isfinite(array).all():
        row = int(np.flatnonzero(~np.isfinite(array).all(axis=1))[0])
        raise MeshError(f"{owner}: vertex {row} is {place(array[row])}, which is not finite; correct or remove it")
    largest = float(np.abs(array).max())
    if largest > LARGEST_LENGTH:
        row = int(np.abs(array).max(axis=1).argmax())
        raise MeshError(f"{owner}: vertex {row} is {place(array[row])}; coordinates beyond 1e90 m cannot be used")
    return frozen(array)


def index_array(value: ArrayLike, width: int, n_vertices: int, owner: str, name: str) -> NDArray[np.int32]:
    """Elements (m, width) as read-only, C-contiguous int32, or a `MeshError` that names the wrong row.

    `name` is the singular of what a row is: "triangle" or "tet".
    """
    try:
        array = np.asarray(value)
    except (TypeError, ValueError, OverflowError):
        raise MeshError(f"{owner}: {name}s are not an array; give integers of shape (m, {width})") from None
    if array.size == 0:
        raise MeshError(f"{owner}: {name}s are missing; give at least one row of {width} vertex indices")
    if array.dtype.kind not in "iu":
        raise MeshError(
            f"{owner}: {name}s have dtype {array.dtype}; vertex indices must be integers of shape (m, {width})"
        )
    if array.ndim != 2 or array.shape[1] != width:
        raise MeshError(f"{owner}: {name}s have shape {array.shape}; they must have shape (m, {width})")
    if array.min() < 0 or array.max() >= n_vertices:
        row = int(np.flatnonzero(((array < 0) | (array >= n_vertices)).any(axis=1))[0])
        hint = " (are the indices 1-based? subtract 1)" if array.min() == 1 and array.max() == n_vertices else ""
        raise MeshError(
            f"{owner}: {name} {row} is {array[row].tolist()}, but vertex indices run from 0 to {n_vertices - 1}{hint}"
        )
    return frozen(np.array(array, dtype=np.int32, order="C"))


def place(point: NDArray[np.float64]) -> str:
    """A point as short text, for messages."""
    return "(" + ", ".join(f"{x:.6g}" for x in point) + ")"
