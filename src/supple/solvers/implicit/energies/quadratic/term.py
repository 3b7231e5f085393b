"""Energies of tets, summed over points in quadratic tets.

Energies of tets are functions of F. Each point of an element becomes a virtual tet whose corners are zero and the
columns of F, and whose rest shape is the unit tet, so that its own deformation gradient is F. Any potential of tets
acts on the virtual tets as on others. Their corners are linear in the positions of the element's ten nodes, y = W x;
so the gradient is W^T g, and the Hessian W^T H W.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.materials.elastic_tets.quadratic import PointsInTets
from supple.numerics.sparse.couplings import Couplings
from supple.solvers.implicit.energies.potential import HessianBlocks, JointlyEvaluated, Potential, Wrapped
from supple.solvers.implicit.energies.quadratic.kernels import (
    add_products,
    determinants_of,
    element_blocks,
    element_forces,
    place_virtual_tets,
    sum_pairs,
    volume_pushes,
)
from supple.solvers.implicit.energies.tet_elements import TetElements, add_by_vertex


@dataclass(frozen=True, eq=False)
class Gathering:
    """Attributes
    ----------
    start : (n + 1,) and entries : by vertex, the (element, node) pairs that name it, coded 10 element + node
    rows, columns : (p,) pairs of vertices of one element, row <= column
    pair_start : (p + 1,) and pair_entries : by pair, 2 (100 element + 10 a + b) for nodes a <= b; plus 1 where the
        transpose of the block is added
    """

    start: NDArray[np.int32]
    entries: NDArray[np.int64]
    rows: NDArray[np.int32]
    columns: NDArray[np.int32]
    pair_start: NDArray[np.int64]
    pair_entries: NDArray[np.int64]

    @classmethod
    def of(cls, nodes: NDArray[np.int32], vertices: int) -> Gathering:
        """Of elements with nodes (k, 10) among `vertices`."""
        flat = nodes.ravel()
        start = np.concatenate([[0], np.cumsum(np.bincount(flat, minlength=vertices))]).astype(np.int32)
        entries = np.argsort(flat, kind="stable")
        a, b = np.triu_indices(10)
        first, second = nodes[:, a].astype(np.int64), nodes[:, b].astype(np.int64)
        keys = (np.minimum(first, second) * vertices + np.maximum(first, second)).ravel()
        codes = (2 * (100 * np.arange(len(nodes))[:, None] + 10 * a + b) + (first > second)).ravel()
        order = np.argsort(keys, kind="stable")
        pairs, begins = np.unique(keys[order], return_index=True)
        rows, columns = np.divmod(pairs, vertices)
        pair_start = np.append(begins, len(keys)).astype(np.int64)
        return cls(start, entries, rows.astype(np.int32), columns.astype(np.int32), pair_start, codes[order])


@dataclass(frozen=True, eq=False)
class VirtualTets:
    """The virtual tets of points in quadratic tets, and how they add up."""

    points: PointsInTets
    gathering: Gathering

    @property
    def count(self) -> int:
        return self.points.volumes.size

    def elements(self) -> TetElements:
        """The virtual tets."""
        unit = np.ascontiguousarray(np.broadcast_to(np.eye(3), (self.count, 3, 3)))
        each = np.arange(4 * self.count + 1, dtype=np.int32)
        return TetElements(each[:-1].reshape(-1, 4), unit, self.points.volumes.ravel(), each, each[:-1])

    def corners(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """(4 m, 3) corners of the virtual tets for positions, or velocities, x (n, 3)."""
        out = np.empty((self.count, 4, 3))
        place_virtual_tets(self.points.deformation_gradients(x).reshape(-1, 3, 3), out)
        return out.reshape(-1, 3)

    def add_forces(self, forces: NDArray[np.float64], out: NDArray[np.float64]) -> None:
        """Add W^T f, of forces (4 m, 3) on the corners, to `out` (n, 3)."""
        of_nodes = np.empty((len(self.points.nodes), 10, 3))
        element_forces(self.points.gradients, forces.reshape(-1, 4, 3), of_nodes)
        add_by_vertex(self.gathering.start, self.gathering.entries, of_nodes.reshape(-1, 3), out)

    def blocks(self, wanted: HessianBlocks | None) -> HessianBlocks | None:
        """Room for the matrices of the virtual tets, where a Hessian is wanted."""
        if wanted is None:
            return None
        return HessianBlocks(np.empty((self.count, 12, 12)), np.zeros((0, 3, 3)), self.count, blank=True)

    def determinants(self, y: NDArray[np.float64]) -> NDArray[np.float64]:
        """(k, s) J at the points, from the corners (4 m, 3) of the virtual tets."""
        out = np.empty(self.count)
        determinants_of(y.reshape(-1, 4, 3), out)
        return out.reshape(self.points.volumes.shape)

    def volume_gradients(self, y: NDArray[np.float64]) -> NDArray[np.float64]:
        """(k, 10, 3) the derivatives of the elements' volumes, sums over their points, by the nodes [m^2]."""
        pushes, out = np.empty((self.count, 4, 3)), np.empty((len(self.points.nodes), 10, 3))
        volume_pushes(y.reshape(-1, 4, 3), self.points.volumes.ravel(), pushes)
        element_forces(self.points.gradients, pushes, out)
        return out

    def couplings(
        self,
        hessians: NDArray[np.float64],
        products: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None,
    ) -> Couplings:
        """W^T H W of matrices (m, 12, 12) of the virtual tets, and c g g^T of products c (k,), g (k, 10, 3)."""
        pairs = self.gathering
        sums = np.empty((len(pairs.rows), 3, 3))
        blocks = np.empty((len(self.points.nodes), 10, 10, 3, 3))
        element_blocks(self.points.gradients, hessians, blocks)
        if products is not None:
            add_products(*products, blocks)
        sum_pairs(pairs.pair_start, pairs.pair_entries, blocks.reshape(-1, 3, 3), sums)
        return Couplings(pairs.rows, pairs.columns, sums)


@dataclass(frozen=True, eq=False)
class OfQuadraticTets(Wrapped, JointlyEvaluated):
    """A potential of tets, acting on the virtual tets of quadratic ones.

    Parameters
    ----------
    inner : made for `virtual.elements()`; it may add nothing but matrices of tets to a Hessian.
    """

    inner: Potential
    virtual: VirtualTets

    def value(self, x: NDArray[np.float64]) -> float:
        return self.inner.value(self.virtual.corners(x))

    def add_model(
        self, x: NDArray[np.float64], gradient: NDArray[np.float64], hessian: HessianBlocks | None, project: bool
    ) -> float:
        y = self.virtual.corners(x)
        blocks, forces = self.virtual.blocks(hessian), np.zeros_like(y)
        energy = self.inner.add_model(y, forces, blocks, project)
        self.virtual.add_forces(forces, gradient)
        if hessian is not None and blocks is not None and not blocks.blank:
            hessian.patches.append(self.virtual.couplings(blocks.tets))
        return energy
