"""The nonlinear functions of joints: of four vectors a, b, d and f each, with derivatives in closed form.

A product, or a cosine, is c = a . b. An angle is atan2(s, c) with s = a . d and c = a . b, a twist with
s = a . d - f . b and c = a . b + f . d. With n = s^2 + c^2, their derivatives are

    dg = u ds + w dc,    u = 0, w = 1 of c itself, and u = c / n, w = -s / n of angles,
    ddg = u dds + w ddc + ((s^2 - c^2) (ds dc + dc ds) + 2 s c (dc dc - ds ds)) / n^2,

whose last part is one of angles only. A further function brings its own derivatives:
`FORMS["name"] = Form(2, of=derivatives_of_it)`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.numerics.mat3 import dot, row
from supple.runtime.kernel_cache import njit


class Values(NamedTuple):
    """Values (s,), their gradients (s, 4, 3) by the vectors and Hessians (s, 4, 3, 4, 3), [vector, coordinate, ...]."""

    value: NDArray[np.float64]
    gradient: NDArray[np.float64]
    hessian: NDArray[np.float64]


class Form(NamedTuple):
    """One of the functions.

    Attributes
    ----------
    vectors : how many it has, of a, b, d and f; turns : whether it is an angle, within one turn
    of : its values and derivatives at vectors (s, 4, 3); None for those above
    """

    vectors: int
    turns: bool = False
    of: Callable[[NDArray[np.float64]], Values] | None = None


# By the name that `Joint.conditions` has; numbers of functions are places in it.
FORMS: dict[str, Form] = {"angle": Form(3, True), "product": Form(2), "cosine": Form(2), "twist": Form(4, True)}
ANGLE, PRODUCT, COSINE, TWIST = range(4)


def values(functions: NDArray[np.int64], vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """(s,) of vectors (s, 4, 3), those of one function in each row."""
    return evaluated(functions, vectors, second=False).value


def derivatives(functions: NDArray[np.int64], vectors: NDArray[np.float64]) -> Values:
    """Values and derivatives at vectors (s, 4, 3)."""
    return evaluated(functions, vectors, second=True)


def evaluated(functions: NDArray[np.int64], vectors: NDArray[np.float64], *, second: bool) -> Values:
    """The same, with second derivatives or none."""
    count = len(functions)
    values = Values(np.zeros(count), np.zeros((count, 4, 3)), np.zeros((count if second else 0, 4, 3, 4, 3)))
    _evaluate(functions, vectors, values)
    for k, form in enumerate(FORMS.values()):
        rows = functions == k
        if form.of is not None and rows.any():
            for array, own in zip(values, form.of(vectors[rows]), strict=True):
                if len(array):
                    array[rows] = own
    return values


def turns(functions: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(s,) which functions are angles, in one turn."""
    return np.array([form.turns for form in FORMS.values()])[functions]


@njit
def is_own(function):
    """Whether a function is one of those above."""
    return function <= TWIST


@njit
def value_at(function, q, dc, ds):
    """One of those above at vectors q (4, 3), with u and w; dc and ds (4, 3) are set."""
    a, b, d, f = row(q, 0), row(q, 1), row(q, 2), row(q, 3)
    t = 1.0 if function == TWIST else 0.0
    for i in range(3):
        dc[0, i], dc[1, i], dc[2, i], dc[3, i] = b[i], a[i], t * f[i], t * d[i]
        ds[0, i], ds[1, i], ds[2, i], ds[3, i] = d[i], -t * f[i], a[i], -t * b[i]
    c, s = dot(a, b) + t * dot(f, d), dot(a, d) - t * dot(f, b)
    if function in (PRODUCT, COSINE):
        return c, 0.0, 1.0
    n = s * s + c * c
    return math.atan2(s, c), c / n, -s / n


@njit(cache=True)
def _evaluate(functions, vectors, out):
    dc, ds = np.zeros((4, 3)), np.zeros((4, 3))
    for k in range(len(functions)):
        function = functions[k]
        if not is_own(function):
            continue
        out.value[k], u, w = value_at(function, vectors[k], dc, ds)
        for a in range(4):
            for i in range(3):
                out.gradient[k, a, i] = u * ds[a, i] + w * dc[a, i]
        if len(out.hessian) == 0:
            continue
        # (s^2 - c^2) / n^2 and 2 s c / n^2; blocks of dds and ddc are multiples of the identity.
        p, r = w * w - u * u, -2.0 * u * w
        if function in (PRODUCT, COSINE):
            p, r = 0.0, 0.0
        t, H = 1.0 if function == TWIST else 0.0, out.hessian[k]
        for a in range(4):
            for i in range(3):
                for b in range(4):
                    for j in range(3):
                        both = ds[a, i] * dc[b, j] + dc[a, i] * ds[b, j]
                        turned = dc[a, i] * dc[b, j] - ds[a, i] * ds[b, j]
                        H[a, i, b, j] = p * both + r * turned
        for i in range(3):
            for a, b, of_pair in ((0, 1, w), (0, 2, u), (2, 3, t * w), (1, 3, -t * u)):
                H[a, i, b, i] += of_pair
                H[b, i, a, i] += of_pair
