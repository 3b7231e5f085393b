"""Quadratic tetrahedra as the check sees them, by its own route from nodes to determinants.

The shape functions are found by interpolation, as the quadratic polynomials that are 1 at one node and 0 at the others.
The determinant of the map from the straight tet is a cubic; its values at the 20 points of a lattice give its Bernstein
coefficients on the tet, or on a part of it. Where all of them are positive the determinant is, where a value is not it
is not; otherwise the part is cut in two.
"""

from __future__ import annotations

from itertools import product
from math import factorial

import numpy as np
from numpy.typing import NDArray

_EDGES = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))
_NODES = np.vstack([np.eye(4), [(np.eye(4)[i] + np.eye(4)[j]) / 2.0 for i, j in _EDGES]])
_POWERS = np.array([p for p in product(range(4), repeat=4) if sum(p) == 3])
_LATTICE = _POWERS / 3.0
# The points of Keast's rule of degree 2.
_INNER = (5.0 - np.sqrt(5.0)) / 20.0
_RULE = np.full((4, 4), _INNER) + (1.0 - 4.0 * _INNER) * np.eye(4)
_CUTS = 14
_ROUND_OFF = 2.0**-46


def _monomials(places: NDArray[np.float64]) -> NDArray[np.float64]:
    _, a, b, c = places.T
    return np.column_stack([np.ones_like(a), a, b, c, a * a, b * b, c * c, a * b, b * c, c * a])


def _monomial_slopes(places: NDArray[np.float64]) -> NDArray[np.float64]:
    """(q, 3, 10) derivatives of the monomials."""
    _, a, b, c = places.T
    o, e = np.zeros_like(a), np.ones_like(a)
    rows = [
        [o, e, o, o, 2 * a, o, o, b, o, c],
        [o, o, e, o, o, 2 * b, o, a, c, o],
        [o, o, o, e, o, o, 2 * c, o, b, a],
    ]
    return np.array(rows).transpose(2, 0, 1)


_COEFFICIENTS = np.linalg.inv(_monomials(_NODES))
_COUNTS = np.array([6.0 / np.prod([factorial(k) for k in power]) for power in _POWERS])
_TO_BERNSTEIN = np.linalg.inv(_COUNTS * np.prod(_LATTICE[:, None, :] ** _POWERS[None], axis=2))


def derivatives(corners: NDArray[np.float64], places: NDArray[np.float64]) -> NDArray[np.float64]:
    """(k, q, 3, 3) whose columns are the derivatives by the barycentric coordinates 1, 2, 3 at places (q, 4), of
    elements with nodes at (k, 10, 3)."""
    slopes = _monomial_slopes(places) @ _COEFFICIENTS
    return np.einsum("qja,kai->kqij", slopes, corners - corners[:, :1])


def determinants(corners: NDArray[np.float64], places: NDArray[np.float64]) -> NDArray[np.float64]:
    """(k, q) of the derivatives."""
    D = derivatives(corners, places)
    return np.einsum("...i,...i->...", D[..., 0], np.cross(D[..., 1], D[..., 2]))


def volumes(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """(k,) volumes; negative where an element is mostly inside out."""
    return (determinants(corners, _LATTICE) @ _TO_BERNSTEIN.T).mean(axis=1) / 6.0


def smallest_ratios(corners: NDArray[np.float64], rest: NDArray[np.float64]) -> NDArray[np.float64]:
    """(k,) the smallest ratio of the determinants, at nodes and quadrature points."""
    places = np.vstack([_NODES, _RULE])
    return (determinants(corners, places) / determinants(rest, places)).min(axis=1)


def lowest_coefficients(corners: NDArray[np.float64], rest: NDArray[np.float64]) -> NDArray[np.float64]:
    """(k,) the smallest ratio of the determinants' Bernstein coefficients, which bounds J below."""
    coefficients = [determinants(nodes, _LATTICE) @ _TO_BERNSTEIN.T for nodes in (corners, rest)]
    return (coefficients[0] / coefficients[1]).min(axis=1)


def at_quadrature_points(
    corners: NDArray[np.float64], rest: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Deformation gradients (k, 4, 3, 3), and the volume at rest that each point stands for (k, 4) [m^3]."""
    at_rest = derivatives(rest, _RULE)
    return derivatives(corners, _RULE) @ np.linalg.inv(at_rest), np.linalg.det(at_rest) / 24.0


def are_positive(corners: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(k,) whether the determinant is positive everywhere in an element.

    Where it comes closer to zero than fourteen cuts and round-off can tell, it counts as not positive.
    """
    positive: NDArray[np.bool_] = np.asarray(np.isfinite(corners).all(axis=(1, 2)))
    D = np.abs(derivatives(np.where(positive[:, None, None], corners, 0.0), np.eye(4))).sum(axis=2).max(axis=1)
    least = _ROUND_OFF * D.prod(axis=1)
    left, parts = np.flatnonzero(positive), np.tile(np.eye(4), (int(positive.sum()), 1, 1))
    for cut in range(_CUTS + 1):
        if len(left) == 0:
            break
        if cut == 0:
            values = determinants(corners[left], _LATTICE)
        else:
            some = [determinants(corners[[k]], _LATTICE @ part) for k, part in zip(left, parts, strict=True)]
            values = np.concatenate(some)
        positive[left[(values <= least[left, None]).any(axis=1)]] = False
        unsure = ~((values @ _TO_BERNSTEIN.T) > least[left, None]).all(axis=1) & positive[left]
        left, parts = left[unsure], parts[unsure]
        if cut == _CUTS:
            positive[left] = False
            break
        lengths = np.array([np.linalg.norm(parts[:, i] - parts[:, j], axis=1) for i, j in _EDGES])
        ends = np.array(_EDGES)[lengths.argmax(axis=0)] if len(left) else np.zeros((0, 2), dtype=int)
        row = np.arange(len(left))
        middle = 0.5 * (parts[row, ends[:, 0]] + parts[row, ends[:, 1]])
        first, second = parts.copy(), parts.copy()
        first[row, ends[:, 0]], second[row, ends[:, 1]] = middle, middle
        left, parts = np.concatenate([left, left]), np.concatenate([first, second])
    return positive
