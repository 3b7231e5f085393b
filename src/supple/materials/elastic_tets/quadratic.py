"""Quadratic tets of a scene: deformation gradients at points inside them, and what follows from these.

In an element, F = sum_a x_a (x) grad N_a over its ten nodes, different at every point. Energies are sums over the
four points of the rule of degree 2, the rule of Abaqus's C3D10. It integrates the stiffness at rest of an element with
straight sides exactly, and has as many strains (4 x 6) as the element has deformations (30 - 6).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.numerics.bernstein import determinant_coefficients
from supple.numerics.quadratic_shape_functions import NODE_COORDINATES, four_point_rule, reference_gradients
from supple.runtime.kernel_cache import njit, prange

QUADRATURE_POINTS = 4


@dataclass(frozen=True, eq=False)
class PointsInTets:
    """Points in k quadratic tets, s in each.

    Attributes
    ----------
    nodes : (k, 10); gradients : (k, s, 10, 3) of the shape functions by the rest positions [1/m]
    volumes : (k, s) the part of the element's rest volume that each point stands for [m^3]
    """

    nodes: NDArray[np.int32]
    gradients: NDArray[np.float64]
    volumes: NDArray[np.float64]

    def deformation_gradients(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """(k, s, 3, 3) F at the points, for positions x (n, 3); rates of F for velocities."""
        F = np.empty((*self.volumes.shape, 3, 3))
        _deformation_gradients(np.ascontiguousarray(x), self.nodes, self.gradients, F)
        return F

    def means(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """(k, ...) means over the rest volume of each element, of values (k, s, ...) at the points."""
        shares = self.volumes / self.volumes.sum(axis=1)[:, None]
        return np.einsum("ks,ks...->k...", shares, values)


@dataclass(frozen=True, eq=False)
class QuadraticTets:
    """The quadratic tets of a scene, or of a recording.

    Attributes
    ----------
    rows : (k,) which of all tets these are
    quadrature : the four points of energies and stresses
    at_nodes : the ten nodes as points; each stands for a tenth of the volume
    rest_coefficients : (k, 20) Bernstein coefficients of the determinant at rest [m^3]
    """

    rows: NDArray[np.int64]
    quadrature: PointsInTets
    at_nodes: PointsInTets
    rest_coefficients: NDArray[np.float64]

    @classmethod
    def of(
        cls, rows: NDArray[np.int64], nodes: NDArray[np.int32], rest_positions: NDArray[np.float64]
    ) -> QuadraticTets:
        """Those with the given nodes (k, 10), rows of `rest_positions` (n, 3) [m]."""
        nodes = np.ascontiguousarray(nodes, dtype=np.int32)
        places, weights = four_point_rule()
        quadrature = _points(nodes, rest_positions, places, weights)
        at_nodes = _points(nodes, rest_positions, NODE_COORDINATES, np.full(10, 0.1))
        return cls(rows, quadrature, at_nodes, determinant_coefficients(rest_positions, nodes))

    @property
    def nodes(self) -> NDArray[np.int32]:
        """(k, 10) vertices of each."""
        return self.quadrature.nodes

    def smallest_ratios(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """(k,) the smallest J = det F at nodes and quadrature points."""
        both = [np.linalg.det(p.deformation_gradients(x)).min(axis=1) for p in (self.quadrature, self.at_nodes)]
        return np.minimum(*both)


def _points(
    nodes: NDArray[np.int32], rest: NDArray[np.float64], places: NDArray[np.float64], weights: NDArray[np.float64]
) -> PointsInTets:
    reference = reference_gradients(places)
    jacobians = np.einsum("kai,saj->ksij", rest[nodes], reference)
    gradients = np.einsum("saj,ksji->ksai", reference, np.linalg.inv(jacobians))
    volumes = weights * np.linalg.det(jacobians) / 6.0
    return PointsInTets(nodes, np.ascontiguousarray(gradients), np.ascontiguousarray(volumes))


@njit(cache=True, parallel=True)
def _deformation_gradients(x, nodes, gradients, out):
    for e in prange(len(nodes)):
        o = nodes[e, 0]
        for q in range(gradients.shape[1]):
            for i in range(3):
                for j in range(3):
                    total = 0.0
                    # Relative to the first node, for precision; the gradients sum to zero.
                    for a in range(1, 10):
                        total += (x[nodes[e, a], i] - x[o, i]) * gradients[e, q, a, j]
                    out[e, q, i, j] = total
