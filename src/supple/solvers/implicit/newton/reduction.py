"""Welded vertices are not unknowns: gradients and Hessians in the vertices that are.

With x = T y for the free vertices y, of which welded ones are combinations, the gradient is T^T g and the Hessian
T^T H T. Blocks of H between vertices that are not welded stay as they are; all others become couplings between the
control points of the rigid bodies and their neighbours.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from supple.model.system import System
from supple.numerics.sparse.couplings import Couplings
from supple.scene.joints.welding import Welding
from supple.solvers.implicit.energies.potential import HessianBlocks


@dataclass(frozen=True, eq=False)
class _BlockMap:
    """Sums of given blocks, with factors, as couplings between vertices.

    Attributes
    ----------
    rows, columns : (t,) vertices; factors : (t, blocks)
    """

    rows: NDArray[np.int32]
    columns: NDArray[np.int32]
    factors: csr_array

    def couplings(self, blocks: NDArray[np.float64]) -> Couplings:
        """Of blocks (b, 3, 3)."""
        sums = self.factors @ blocks.reshape(-1, 9)
        return Couplings(self.rows, self.columns, np.ascontiguousarray(sums).reshape(-1, 3, 3))


@dataclass(frozen=True, eq=False)
class Reduction:
    """The welds of a system.

    Attributes
    ----------
    stands_for : (n, 4) the vertices that each one is a combination of, with weights (n, 4)
    welded : (n,) bool
    elements : the elements with a welded node
    """

    welding: Welding
    welded: NDArray[np.bool_]
    stands_for: NDArray[np.int32]
    weights: NDArray[np.float64]
    elements: NDArray[np.int64]
    of_elements: _BlockMap
    of_vertices: _BlockMap

    @classmethod
    def of(cls, system: System) -> Reduction | None:
        """The reduction of a system; None without welds."""
        welding, n = system.welding, len(system.rest_positions)
        if not len(welding):
            return None
        stands_for = np.tile(np.arange(n, dtype=np.int32)[:, None], (1, 4))
        weights = np.tile([1.0, 0.0, 0.0, 0.0], (n, 1))
        stands_for[welding.vertices], weights[welding.vertices] = welding.control, welding.weights
        welded = np.zeros(n, dtype=np.bool_)
        welded[welding.vertices] = True
        nodes = system.elements
        near = np.flatnonzero((welded[nodes] & (nodes >= 0)).any(axis=1))
        # Every ordered pair of nodes, of which both are vertices and one is welded.
        element, one, other = (axis.ravel() for axis in np.indices((len(near), 4, 4)))
        p, q = nodes[near][element, one], nodes[near][element, other]
        kept = (p >= 0) & (q >= 0) & (welded[p] | welded[q])
        block = ((element * 4 + one) * 4 + other)[kept]
        of_elements = _expanded(stands_for, weights, p[kept], q[kept], block, 16 * len(near))
        s = len(welding)
        of_vertices = _expanded(stands_for, weights, welding.vertices, welding.vertices, np.arange(s), s)
        return cls(welding, welded, stands_for, weights, near, of_elements, of_vertices)

    def couplings(self, hessian: HessianBlocks) -> list[Couplings]:
        """What the Hessian adds beyond the blocks of elements between vertices that are not welded."""
        blocks = hessian.elements[self.elements].reshape(-1, 4, 3, 4, 3).transpose(0, 1, 3, 2, 4)
        found = [
            self.of_elements.couplings(np.ascontiguousarray(blocks).reshape(-1, 3, 3)),
            self.of_vertices.couplings(hessian.vertices[self.welding.vertices]),
        ]
        return [*found, *(self._reduced(one) for one in hessian.beyond_elements)]

    def _reduced(self, given: Couplings) -> Couplings:
        moved = self.welded[given.rows] | self.welded[given.columns]
        if not moved.any():
            return given
        rows, columns, blocks = given.rows[moved], given.columns[moved], given.blocks[moved]
        # A block of a vertex with itself is whole; between two vertices it stands for its transpose, too.
        two = rows != columns
        blocks = np.concatenate([blocks, blocks[two].transpose(0, 2, 1)])
        ends = np.append(rows, columns[two]), np.append(columns, rows[two])
        made = _expanded(self.stands_for, self.weights, *ends, np.arange(len(blocks)), len(blocks)).couplings(blocks)
        return Couplings.joined([Couplings(given.rows[~moved], given.columns[~moved], given.blocks[~moved]), made])


def _expanded(
    stands_for: NDArray[np.int32],
    weights: NDArray[np.float64],
    p: NDArray[np.int32],
    q: NDArray[np.int32],
    blocks: NDArray[np.int64],
    count: int,
) -> _BlockMap:
    """Of all ordered pairs of vertices p (k,) and q (k,), whose blocks have the numbers (k,) among `count`: the upper
    half of the symmetric matrix between the vertices that they stand for."""
    shape = (len(p), 4, 4)
    i = np.broadcast_to(stands_for[p][:, :, None], shape).ravel()
    j = np.broadcast_to(stands_for[q][:, None, :], shape).ravel()
    factors = (weights[p][:, :, None] * weights[q][:, None, :]).ravel()
    kept = (factors != 0.0) & (i <= j)
    first, second = i[kept].astype(np.int64), j[kept].astype(np.int64)
    n = int(max(second.max(initial=0), 0)) + 1
    keys, place = np.unique(first * n + second, return_inverse=True)
    rows, columns = np.divmod(keys, n)
    of_blocks = np.repeat(blocks, 16)[kept]
    matrix = csr_array((factors[kept], (place.ravel(), of_blocks)), shape=(len(keys), count))
    return _BlockMap(rows.astype(np.int32), columns.astype(np.int32), matrix)
