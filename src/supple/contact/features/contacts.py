"""Contacts of one state: pairs of parts of surfaces that repel each other, and the area that each stands for.

A weight depends on directions, and its derivatives are not forces. While the minimum of an energy is searched, contacts
keep the weights with which the search first met them: the energy is then a function of the positions. Weights may grow
where the search goes on, so that a force acts on everything that comes near; their growth is bounded. A vertex that
counts with the plane of a triangle beside an outline keeps the triangle, too: another one would have another plane.
Where it goes over that face, or too far away from the outline to count, the plane loses the weight.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.numerics.mat3 import dot
from supple.runtime.kernel_cache import njit


class Contacts(NamedTuple):
    """Arrays of k contacts, in an order that depends on the surfaces alone; kernels take it as it is.

    Attributes
    ----------
    kinds : (k,) int8, see `supple.contact.features.pair_geometry`
    points : (k, 4) int32, -1 where a kind has fewer
    coefficients : (k, 4), positive on the first side and negative on the second, but on planes of any sign; sum 0
    vectors : (k, 3) from the second side's closest point to the first side's [m]; distances : (k,) their lengths
    weights : (k,) areas [m^2]
    gaps : (k,) distances less the offsets of both sides, see `ContactMesh` [m]
    """

    kinds: NDArray[np.int8]
    points: NDArray[np.int32]
    coefficients: NDArray[np.float64]
    vectors: NDArray[np.float64]
    distances: NDArray[np.float64]
    weights: NDArray[np.float64]
    gaps: NDArray[np.float64]

    @classmethod
    def room(cls, k: int) -> Contacts:
        """Contacts to be written."""
        flat = np.empty(k, dtype=np.int8), np.empty((k, 4), dtype=np.int32)
        return cls(*flat, np.empty((k, 4)), np.empty((k, 3)), np.empty(k), np.empty(k), np.empty(k))

    def where(self, chosen: NDArray[np.bool_]) -> Contacts:
        """The chosen ones (k,)."""
        return Contacts._make(array[chosen] for array in self)

    def joined(self, more: Contacts) -> Contacts:
        """These contacts, then others."""
        return Contacts._make(np.concatenate(both) for both in zip(self, more, strict=True))


@njit
def put(out, k, kind, points, coefficients, r, offset):
    """Write contact k of `out`, a `Contacts`, with the vector r and the offset of both sides; the weight is left."""
    out.kinds[k] = kind
    out.points[k, 0], out.points[k, 1], out.points[k, 2], out.points[k, 3] = points
    for i in range(4):
        out.coefficients[k, i] = coefficients[i]
    out.vectors[k, 0], out.vectors[k, 1], out.vectors[k, 2] = r
    out.distances[k] = math.sqrt(dot(r, r))
    out.gaps[k] = out.distances[k] - offset


# A weight grows by at least this share of the largest one.
_LEAST_GROWTH = 0.1


class KnownWeights(NamedTuple):
    """Of pairs with ascending codes.

    Attributes
    ----------
    codes, weights : (k,), (k,) [m^2]; triangles : (k,) whose planes count, -1 for other pairs
    """

    codes: NDArray[np.int64]
    weights: NDArray[np.float64]
    triangles: NDArray[np.int32]

    @classmethod
    def none(cls) -> KnownWeights:
        return cls(np.zeros(0, dtype=np.int64), np.zeros(0), np.zeros(0, dtype=np.int32))

    def with_weights(self) -> KnownWeights:
        """Those with a weight of zero or more."""
        return KnownWeights._make(array[self.weights >= 0.0] for array in self)

    def with_more(self, more: KnownWeights) -> KnownWeights:
        """With further pairs, and the others' weights where both have one; `more` is in any order."""
        if not len(more.codes):
            return self
        # The first of equal codes counts.
        codes, first = np.unique(np.concatenate([more.codes, self.codes]), return_index=True)
        weights = np.concatenate([more.weights, self.weights])[first]
        return KnownWeights(codes, weights, np.concatenate([more.triangles, self.triangles])[first])

    def with_planes(self, codes: NDArray[np.int64]) -> KnownWeights:
        """With no weight for pairs that count with a plane, but for those with these codes (m,)."""
        lost = np.flatnonzero((self.triangles >= 0) & (self.weights > 0.0))
        if not len(lost):
            return self
        lost = lost[~_are_among(self.codes[lost], np.sort(codes))]
        if not len(lost):
            return self
        weights = self.weights.copy()
        weights[lost] = 0.0
        return self._replace(weights=weights)


def _are_among(codes: NDArray[np.int64], ascending: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(k,) which of the codes (k,) are among others (m,), in ascending order."""
    return np.searchsorted(ascending, codes, "right") > np.searchsorted(ascending, codes, "left")


@njit
def has_grown(known, now, full):
    """Whether a weight is to replace the known one (-1: none), where `full` is the largest possible."""
    return known < 0.0 or now > known + _LEAST_GROWTH * full


@njit
def known_weight(known, code):
    """The weight of a pair, or -1 where it is not known."""
    k = known_row(known, code)
    return known.weights[k] if k >= 0 else -1.0


@njit
def known_row(known, code):
    """Where a pair is in `known`, a `KnownWeights`, or -1."""
    codes = known.codes
    low, high = 0, len(codes)
    while low < high:
        middle = (low + high) // 2
        if codes[middle] < code:
            low = middle + 1
        else:
            high = middle
    return low if low < len(codes) and codes[low] == code else -1
