"""Contacts of one state: pairs of parts of surfaces that repel each other, and the area that each stands for."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class Contacts(NamedTuple):
    """Arrays of k contacts, in an order that depends on the surfaces alone; kernels take it as it is.

    Attributes
    ----------
    kinds : (k,) int8, see `supple.contact.features.pair_geometry`
    points : (k, 4) int32, -1 where a kind has fewer
    coefficients : (k, 4), positive on the first side and negative on the second, sum 0
    vectors : (k, 3) from the second side's closest point to the first side's [m]; distances : (k,) their lengths
    weights : (k,) areas [m^2]
    """

    kinds: NDArray[np.int8]
    points: NDArray[np.int32]
    coefficients: NDArray[np.float64]
    vectors: NDArray[np.float64]
    distances: NDArray[np.float64]
    weights: NDArray[np.float64]

    def where(self, chosen: NDArray[np.bool_]) -> Contacts:
        """The chosen ones (k,)."""
        kinds, points, coefficients = self.kinds[chosen], self.points[chosen], self.coefficients[chosen]
        return Contacts(kinds, points, coefficients, self.vectors[chosen], self.distances[chosen], self.weights[chosen])
