"""The nonlinear functions of joints: of four vectors a, b, d and f each, with derivatives in closed form.

A product, or a cosine, is a . b. An angle is atan2(s, c) with s = a . d and c = a . b, a twist with s = a . d - f . b
and c = a . b + f . d; with n = s^2 + c^2 their derivatives are

    (c ds - s dc) / n,
    (c dds - s ddc) / n + ((s^2 - c^2) (ds dc + dc ds) + 2 s c (dc dc - ds ds)) / n^2.

A further function brings its own derivatives: `FORMS["name"] = Form(2, of=derivatives_of_it)`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

_I = np.eye(3)


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
    c, s = _cosine_and_sine(functions, vectors)
    found = np.where(turns(functions), np.arctan2(s, c), c)
    for rows, own in _others(functions, vectors):
        found[rows] = own.value
    return found


def turns(functions: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(s,) which functions are angles, in one turn."""
    return np.array([form.turns for form in FORMS.values()])[functions]


def _others(functions: NDArray[np.int64], vectors: NDArray[np.float64]) -> list[tuple[NDArray[np.bool_], Values]]:
    """Rows of functions that bring their own derivatives, and these."""
    own = [(functions == k, form.of) for k, form in enumerate(FORMS.values()) if form.of is not None]
    return [(rows, of(vectors[rows])) for rows, of in own if rows.any()]


def _cosine_and_sine(
    functions: NDArray[np.int64], vectors: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    a, b, d, f = vectors.transpose(1, 0, 2)
    twisting = np.where(functions == TWIST, 1.0, 0.0)
    c = np.einsum("si,si->s", a, b) + twisting * np.einsum("si,si->s", f, d)
    return c, np.einsum("si,si->s", a, d) - twisting * np.einsum("si,si->s", f, b)


def derivatives(functions: NDArray[np.int64], vectors: NDArray[np.float64]) -> Values:
    """Values and derivatives at vectors (s, 4, 3)."""
    count = len(functions)
    a, b, d, f = vectors.transpose(1, 0, 2)
    c, s = _cosine_and_sine(functions, vectors)
    twisting = np.where(functions == TWIST, 1.0, 0.0)
    t = twisting[:, None]
    dc = np.stack([b, a, t * f, t * d], axis=1)
    ds = np.stack([d, -t * f, a, -t * b], axis=1)
    ddc, dds = np.zeros((count, 4, 3, 4, 3)), np.zeros((count, 4, 3, 4, 3))
    ddc[:, 0, :, 1], ddc[:, 1, :, 0] = _I, _I
    dds[:, 0, :, 2], dds[:, 2, :, 0] = _I, _I
    of_f = twisting[:, None, None] * _I
    ddc[:, 2, :, 3], ddc[:, 3, :, 2] = of_f, of_f
    dds[:, 1, :, 3], dds[:, 3, :, 1] = -of_f, -of_f
    angle = turns(functions)
    n = np.where(angle, s * s + c * c, 1.0)
    dg = np.where(angle[:, None, None], (_scaled(c, ds) - _scaled(s, dc)) / n[:, None, None], dc)
    twist = _outer(ds, dc)
    twist = twist + np.einsum("saibj->sbjai", twist)
    bent = _scaled(c, dds) - _scaled(s, ddc)
    turned = _scaled(s * s - c * c, twist) + _scaled(2.0 * s * c, _outer(dc, dc) - _outer(ds, ds))
    curved = _scaled(1.0 / n, bent) + _scaled(1.0 / n**2, turned)
    hessian = np.where(angle[:, None, None, None, None], curved, ddc)
    found = Values(np.where(angle, np.arctan2(s, c), c), dg, hessian)
    for rows, own in _others(functions, vectors):
        for array, given in zip(found, own, strict=True):
            array[rows] = given
    return found


def _scaled(factor: NDArray[np.float64], array: NDArray[np.float64]) -> NDArray[np.float64]:
    return factor.reshape(-1, *(1,) * (array.ndim - 1)) * array


def _outer(left: NDArray[np.float64], right: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.einsum("sai,sbj->saibj", left, right)
