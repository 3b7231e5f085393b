"""Contact of one point with one simple shape, as an element function that kernels call.

A point moves on a straight line from s0 to s1 during a substep, in the coordinates of the shape's own frame. A kind of
obstacle supplies `signed_distance(parameters, s) -> (distance, normal)`; this file builds the contact from it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.runtime.kernel_cache import njit


@dataclass(frozen=True, eq=False)
class Shape:
    """A shape where it is at time 0.

    Attributes
    ----------
    contact : compiled contact(parameters, s0, s1) -> gap [m], gap before [m], unit normal towards the free side
    frame : (4, 3) an anchor point [m], then three orthonormal axes, row by row
    parameters : numbers that `contact` is given; at most `PARAMETERS`
    """

    contact: Callable[..., Any]
    frame: NDArray[np.float64]
    parameters: tuple[float, ...] = ()


PARAMETERS = 4


def frame_of(anchor: NDArray[np.float64], first: NDArray[np.float64]) -> NDArray[np.float64]:
    """A right-handed frame (4, 3) whose first axis is the unit vector `first`, bit for bit."""
    helper = np.eye(3)[int(np.abs(first).argmin())]
    second = np.cross(first, helper)
    second /= np.linalg.norm(second)
    return np.array([anchor, first, second, np.cross(first, second)], dtype=np.float64)


@cache
def concave_contact(signed_distance: Callable[..., Any]) -> Callable[..., Any]:
    """Contact with the wall of a container whose inside is convex; `signed_distance` is that of the solid."""

    def contact_from_inside(parameters, s0, s1):
        d1, n1 = signed_distance(parameters, s1)
        d0, _ = signed_distance(parameters, s0)
        return -d1, -d0, (-n1[0], -n1[1], -n1[2])

    return _compiled(contact_from_inside, signed_distance)


def _compiled(contact: Any, signed_distance: Any) -> Callable[..., Any]:
    """The function under a different name.

    Cached kernels contain what they call, under its name and a number that starts again in every process. Kernels that
    different processes have compiled would confuse two functions of the same name.
    """
    distance = signed_distance.py_func
    contact.__qualname__ = f"{contact.__name__}.{distance.__module__}.{distance.__qualname__}"
    return njit(contact)
