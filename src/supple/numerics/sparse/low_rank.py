"""Matrices g g^T of a vector g over many vertices: what the force of an actuator adds to a Hessian."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class RankOne:
    """g g^T between all of its vertices, which no sparse matrix could hold.

    Attributes
    ----------
    vertices : (v,) all different; vector : (v, 3) g
    """

    vertices: NDArray[np.int32]
    vector: NDArray[np.float64]

    def add_product(self, x: NDArray[np.float64], out: NDArray[np.float64]) -> None:
        """Add the product with x (n, 3) to `out` (n, 3)."""
        out[self.vertices] += float(np.einsum("ij,ij->", self.vector, x[self.vertices])) * self.vector

    def in_rows(self, row_of: NDArray[np.int32], count: int) -> NDArray[np.float64]:
        """(count, 3) g where vertex i has the row row_of[i]; without those whose row is -1."""
        out = np.zeros((count, 3))
        rows = row_of[self.vertices]
        out[rows[rows >= 0]] = self.vector[rows >= 0]
        return out
