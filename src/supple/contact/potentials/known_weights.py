"""Weights that contacts keep while the positions change.

A weight depends on directions, and its derivatives are no forces. While the minimum of an energy is searched, contacts
keep the weights with which the search first met them: the energy is then a function of the positions. Weights may grow
where the search goes on, so that nothing comes near without a force; they cannot grow without end.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.numerics.kernel_cache import njit

# A weight grows by at least this share of the largest one.
_LEAST_GROWTH = 0.1


class KnownWeights(NamedTuple):
    """Weights [m^2] of pairs with ascending codes, both (k,)."""

    codes: NDArray[np.int64]
    weights: NDArray[np.float64]

    @classmethod
    def none(cls) -> KnownWeights:
        return cls(np.zeros(0, dtype=np.int64), np.zeros(0))

    def grown(self, codes: NDArray[np.int64], weights: NDArray[np.float64]) -> KnownWeights:
        """With the weights of further pairs, or larger ones of known pairs."""
        if not len(codes):
            return self
        # The first of equal codes counts.
        every, first = np.unique(np.concatenate([codes, self.codes]), return_index=True)
        return KnownWeights(every, np.concatenate([weights, self.weights])[first])


@njit(error_model="numpy")
def has_grown(known, now, full):
    """Whether a weight is to replace the known one (-1: none), where `full` is the largest possible."""
    return known < 0.0 or now > known + _LEAST_GROWTH * full


@njit(error_model="numpy")
def known_weight(codes, weights, code):
    """The weight of a pair, or -1 where it is not known."""
    low, high = 0, len(codes)
    while low < high:
        middle = (low + high) // 2
        if codes[middle] < code:
            low = middle + 1
        else:
            high = middle
    return weights[low] if low < len(codes) and codes[low] == code else -1.0
