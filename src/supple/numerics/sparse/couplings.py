"""Symmetric matrices between a few vertices: blocks that add up, as contacts have, and g g^T, as an actuator has."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from supple.runtime.kernel_cache import njit


@dataclass(frozen=True, eq=False)
class Couplings:
    """A symmetric matrix between vertices. Each unordered pair of a contact is given once; pairs may repeat.

    Attributes
    ----------
    rows, columns : (t,) the two vertices of each block
    blocks : (t, 3, 3) added to (row, column), and transposed to (column, row) where these differ; a block of a vertex
        with itself is symmetric
    """

    rows: NDArray[np.int32]
    columns: NDArray[np.int32]
    blocks: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.rows)

    @classmethod
    def joined(cls, parts: Sequence[Couplings]) -> Couplings:
        """The sum of several, in their order."""
        if len(parts) == 1:
            return parts[0]
        if not parts:
            return cls(np.zeros(0, dtype=np.int32), np.zeros(0, dtype=np.int32), np.zeros((0, 3, 3)))
        return cls(
            np.concatenate([part.rows for part in parts]),
            np.concatenate([part.columns for part in parts]),
            np.concatenate([part.blocks for part in parts]),
        )

    def add_product(self, x: NDArray[np.float64], out: NDArray[np.float64]) -> None:
        """Add the product with x (n, 3) to `out` (n, 3)."""
        _add_product(self.rows, self.columns, self.blocks, x, out)


@njit(cache=True)
def _add_product(rows, columns, blocks, x, out):
    for t in range(len(rows)):
        i, j = rows[t], columns[t]
        for r in range(3):
            for c in range(3):
                out[i, r] += blocks[t, r, c] * x[j, c]
        if i != j:
            for r in range(3):
                for c in range(3):
                    out[j, c] += blocks[t, r, c] * x[i, r]


class Correction(Protocol):
    """A symmetric matrix, not above zero, that is known by its products. Those of CG that has the factors of all the
    rest for a preconditioner are few where it is a share of that."""

    def add_product(self, x: NDArray[np.float64], out: NDArray[np.float64]) -> None:
        """Add the product with x (n, 3) to `out` (n, 3)."""
        ...


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
