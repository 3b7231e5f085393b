"""Declared parameters of obstacles.

One declaration makes a parameter a checked field of the class, a number in recordings and a key in scene files.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.errors import SceneError
from supple.mesh.surface import SurfaceMesh
from supple.scene.values import finite_vector, positive, unit_vector


def _extents(value: object, what: str) -> NDArray[np.float64]:
    vector = finite_vector(value, what)
    if np.any(vector <= 0.0):
        raise SceneError(f"{what} is {vector.tolist()}; every edge must be above zero")
    return vector


def _flag(value: object, what: str) -> bool:
    if not isinstance(value, (bool, np.bool_)):
        raise SceneError(f"{what} is {value!r}; give True or False")
    return bool(value)


def _surface(value: object, what: str) -> SurfaceMesh:
    if not isinstance(value, SurfaceMesh):
        raise SceneError(f"{what} is {value!r}; give a SurfaceMesh")
    return value


_CHECKS: dict[str, Callable[[Any, str], Any]] = {
    "vector": finite_vector,
    "direction": unit_vector,
    "extents": _extents,
    "positive": positive,
    "flag": _flag,
    "surface": _surface,
}


@dataclass(frozen=True)
class Parameter:
    """One parameter of a kind of obstacle.

    Attributes
    ----------
    kind : "vector" (3,), "direction" (3,) stored as a unit vector, "extents" (3,) above zero, "positive", "flag" or
        "surface"
    description : with the unit, as it stands in the schema of scene files
    """

    kind: str
    description: str

    def checked(self, value: object, what: str) -> Any:
        """The value as it is stored.

        Raises
        ------
        SceneError : where it is impossible; the text begins with `what`.
        """
        return _CHECKS[self.kind](value, what)


def parameter(kind: str, description: str) -> dict[str, Parameter]:
    """Metadata of a dataclass field that declares a parameter; see `Parameter`."""
    return {"parameter": Parameter(kind, description)}
