"""The nonlinear functions of joints: of three vectors a, b and d each, with derivatives in closed form.

A product, or a cosine, is a . b. An angle is atan2(s, c) with s = a . d and c = a . b; with n = s^2 + c^2 its
derivatives are

    (c ds - s dc) / n,
    (c dds - s ddc) / n + ((s^2 - c^2) (ds dc + dc ds) + 2 s c (dc dc - ds ds)) / n^2.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.joints.geometry import ANGLE

_I = np.eye(3)


class Values(NamedTuple):
    """Values (s,), their gradients (s, 3, 3) by the vectors and Hessians (s, 3, 3, 3, 3), [vector, coordinate, ...]."""

    value: NDArray[np.float64]
    gradient: NDArray[np.float64]
    hessian: NDArray[np.float64]


def values(functions: NDArray[np.int64], vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """(s,) of vectors (s, 3, 3), those of one function in each row."""
    a, b, d = vectors[:, 0], vectors[:, 1], vectors[:, 2]
    c, s = np.einsum("si,si->s", a, b), np.einsum("si,si->s", a, d)
    return np.where(functions == ANGLE, np.arctan2(s, c), c)


def derivatives(functions: NDArray[np.int64], vectors: NDArray[np.float64]) -> Values:
    """Values and derivatives at vectors (s, 3, 3)."""
    count = len(functions)
    a, b, d = vectors[:, 0], vectors[:, 1], vectors[:, 2]
    c, s = np.einsum("si,si->s", a, b), np.einsum("si,si->s", a, d)
    dc, ds = np.zeros((count, 3, 3)), np.zeros((count, 3, 3))
    dc[:, 0], dc[:, 1] = b, a
    ds[:, 0], ds[:, 2] = d, a
    ddc, dds = np.zeros((3, 3, 3, 3)), np.zeros((3, 3, 3, 3))
    ddc[0, :, 1], ddc[1, :, 0] = _I, _I
    dds[0, :, 2], dds[2, :, 0] = _I, _I
    angle = functions == ANGLE
    n = np.where(angle, s * s + c * c, 1.0)
    dg = np.where(angle[:, None, None], (_scaled(c, ds) - _scaled(s, dc)) / n[:, None, None], dc)
    twist = _outer(ds, dc)
    twist = twist + np.einsum("saibj->sbjai", twist)
    bent = _scaled(c, np.broadcast_to(dds, twist.shape)) - _scaled(s, np.broadcast_to(ddc, twist.shape))
    turned = _scaled(s * s - c * c, twist) + _scaled(2.0 * s * c, _outer(dc, dc) - _outer(ds, ds))
    curved = _scaled(1.0 / n, bent) + _scaled(1.0 / n**2, turned)
    hessian = np.where(angle[:, None, None, None, None], curved, ddc)
    return Values(np.where(angle, np.arctan2(s, c), c), dg, hessian)


def _scaled(factor: NDArray[np.float64], array: NDArray[np.float64]) -> NDArray[np.float64]:
    return factor.reshape(-1, *(1,) * (array.ndim - 1)) * array


def _outer(left: NDArray[np.float64], right: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.einsum("sai,sbj->saibj", left, right)
