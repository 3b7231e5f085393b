"""Checks of values. Each error is one line with the name, the value and the remedy."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.errors import SceneError


def check_name(name: object, kind: str) -> None:
    """Raise unless `name` is a non-empty text that is valid in a file name and an HDF5 path."""
    if not isinstance(name, str) or not name.strip():
        raise SceneError(f"{kind}: name is {name!r}; give a non-empty text")
    if len(name) > 100 or any(c in name for c in '/\\:*?"<>|\0') or not name.isprintable() or name in (".", ".."):
        raise SceneError(f"{kind} {name[:100]!r}: a name is at most 100 letters, digits, spaces, '-', '_' and '.'")


def float_array(value: object, what: str, remedy: str | None = None) -> NDArray[np.float64]:
    """A new float64 array of `value`; raise where it does not consist of numbers."""
    try:
        return np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        problem = "is not an array of numbers" if remedy is None else f"is {value!r}; {remedy}"
        raise SceneError(f"{what} {problem}") from None


def finite_vector(value: object, what: str, *, nonzero: bool = False) -> NDArray[np.float64]:
    """`value` as a read-only (3,) float64 array; raise where it is not three finite numbers."""
    vector = float_array(value, what, "give three numbers")
    if vector.shape != (3,):
        raise SceneError(f"{what} has shape {vector.shape}; give three numbers")
    if not np.isfinite(vector).all():
        raise SceneError(f"{what} is {vector.tolist()}; it must be finite")
    if nonzero and not vector.any():
        raise SceneError(f"{what} has no length; give a direction such as (0, 1, 0)")
    vector.flags.writeable = False
    return vector


def unit_vector(value: object, what: str) -> NDArray[np.float64]:
    """The direction (3,) of a vector of any length; raise where it is not three finite numbers, or has no length."""
    return finite_vector(unit_vectors(finite_vector(value, what, nonzero=True)), what)


def unit_vectors(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """The directions of vectors (..., 3) of any length above zero.

    A unit vector stays the same to the last bit, so that a recorded one reads back equal.
    """
    largest = np.abs(vectors).max(axis=-1, keepdims=True)
    # Beyond these, squares would not be numbers.
    scaled = np.where((largest > 1e-100) & (largest < 1e100), vectors, vectors / largest)
    lengths = np.linalg.norm(scaled, axis=-1, keepdims=True)
    return np.where(np.abs(lengths - 1.0) <= 1e-15, scaled, scaled / lengths)


def number(value: object, what: str) -> float:
    """`value` as a float that is finite."""
    if isinstance(value, bool) or not isinstance(value, (int, float, np.integer, np.floating)):
        raise SceneError(f"{what} is {value!r}; give a number")
    given = float(value)
    if not np.isfinite(given):
        raise SceneError(f"{what} is {given}; it must be finite")
    return given


def positive(value: object, what: str) -> float:
    """`value` as a float that is finite and above zero."""
    given = number(value, what)
    if given <= 0.0:
        raise SceneError(f"{what} is {given:g}; it must be above zero")
    return given
