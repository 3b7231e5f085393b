"""Contact of one point with one simple shape, as an element function that kernels call.

A point moves on a straight line from s0 to s1 during a substep, in the coordinates of the shape's own frame. A kind of
obstacle supplies `signed_distance(parameters, s) -> (distance, normal)`; this file builds the contact from it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.numerics.kernel_cache import njit
from supple.numerics.mat3 import dot, subtract

# Newton's method for the entry of a straight line into a convex shape doubles its digits in every iteration.
_ITERATIONS = 40
# Of the way: a point that is nearer than this lies on the surface.
_ON_SURFACE = 1e-12


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
def convex_contact(signed_distance: Callable[..., Any]) -> Callable[..., Any]:
    """Contact with a convex solid.

    A point that came in, or passed through, during the substep is held at the plane where it entered; a point that was
    inside before leaves by the nearest way.
    """

    def contact(parameters, s0, s1):
        d1, n1 = signed_distance(parameters, s1)
        d0, n0 = signed_distance(parameters, s0)
        way = subtract(s1, s0)
        before = d1 - dot(way, n1)  # above the plane that touches the solid nearest to s1
        if d0 < 0.0:
            same_side = dot(n0, n1) > 0.5
            return d1, (d0 if same_side else before), n1
        length = math.sqrt(dot(way, way))
        if (d1 >= 0.0 and length < d0 + d1) or (d1 < 0.0 and before >= 0.0) or length == 0.0:
            return d1, d0, n1
        # Along the way the distance is convex, so Newton's method comes to the first root from the left.
        t, d, n = 0.0, d0, n0
        for _ in range(_ITERATIONS):
            slope = dot(n, way)
            if slope >= 0.0:
                break
            t -= d / slope
            if t > 1.0:
                break
            q = (s0[0] + t * way[0], s0[1] + t * way[1], s0[2] + t * way[2])
            d, n = signed_distance(parameters, q)
            if d <= _ON_SURFACE * length:
                return dot(subtract(s1, q), n), dot(subtract(s0, q), n), n
        return d1, d0, n1

    return _compiled(contact, signed_distance)


@cache
def concave_contact(signed_distance: Callable[..., Any]) -> Callable[..., Any]:
    """Contact with the wall of a room whose inside is convex; `signed_distance` is that of the solid."""

    def contact_from_inside(parameters, s0, s1):
        d1, n1 = signed_distance(parameters, s1)
        d0, _ = signed_distance(parameters, s0)
        return -d1, -d0, (-n1[0], -n1[1], -n1[2])

    return _compiled(contact_from_inside, signed_distance)


def _compiled(contact: Any, signed_distance: Any) -> Callable[..., Any]:
    """The function under a name of its own.

    Cached kernels contain what they call, under its name and a number that begins anew in every process. Kernels that
    different processes have compiled would confuse two functions of the same name.
    """
    distance = signed_distance.py_func
    contact.__qualname__ = f"{contact.__name__}.{distance.__module__}.{distance.__qualname__}"
    return njit(contact)
