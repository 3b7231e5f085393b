"""Quadratic tetrahedra of ten nodes: shape functions, their gradients, and quadrature rules.

Nodes 0 to 3 are the corners; nodes 4 to 9 lie on the edges (0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3). This is the
order of VTK and of Abaqus's C3D10. In barycentric coordinates l,

    N_i = l_i (2 l_i - 1),    N_ij = 4 l_i l_j.

Source: Zienkiewicz, Taylor, Zhu, "The Finite Element Method: Its Basis and Fundamentals", section 6.2.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

# The ends of the edge that each of the nodes 4 to 9 lies on.
NODE_EDGES = np.array([[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]])
# The same nodes after corners 2 and 3 are exchanged, which turns a tet that is inside out.
TURNED = np.array([0, 1, 3, 2, 4, 8, 7, 6, 5, 9])
# The node between two corners.
BETWEEN = np.array([[-1, 4, 6, 7], [4, -1, 5, 8], [6, 5, -1, 9], [7, 8, 9, -1]])
# Barycentric coordinates of the nodes.
NODE_COORDINATES = np.concatenate([np.eye(4), 0.5 * (np.eye(4)[NODE_EDGES[:, 0]] + np.eye(4)[NODE_EDGES[:, 1]])])


def shape_functions(places: NDArray[np.float64]) -> NDArray[np.float64]:
    """(q, 10) values of the shape functions at barycentric coordinates (q, 4)."""
    first, second = places[:, NODE_EDGES[:, 0]], places[:, NODE_EDGES[:, 1]]
    return np.hstack([places * (2.0 * places - 1.0), 4.0 * first * second])


def reference_gradients(places: NDArray[np.float64]) -> NDArray[np.float64]:
    """(q, 10, 3) derivatives by the barycentric coordinates 1, 2 and 3, of which coordinate 0 is the rest."""
    by_place = np.zeros((len(places), 10, 4))
    for i in range(4):
        by_place[:, i, i] = 4.0 * places[:, i] - 1.0
    for k, (i, j) in enumerate(NODE_EDGES, start=4):
        by_place[:, k, i] = 4.0 * places[:, j]
        by_place[:, k, j] = 4.0 * places[:, i]
    return by_place[:, :, 1:] - by_place[:, :, :1]


def four_point_rule() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Places (4, 4) and weights (4,), which sum to 1, of the rule that is exact for polynomials of degree 2.

    Source: Keast (1986), "Moderate-degree tetrahedral quadrature formulas", rule 2.
    """
    inner = (5.0 - np.sqrt(5.0)) / 20.0
    return np.full((4, 4), inner) + (1.0 - 4.0 * inner) * np.eye(4), np.full(4, 0.25)


def conical_rule(points: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Places (points^3, 4) and weights, which sum to 1, of a rule that is exact for degree 2 `points` - 1.

    Source: Stroud (1971), "Approximate Calculation of Multiple Integrals", conical products of Gauss-Jacobi rules.
    """
    from scipy.special import roots_jacobi

    (a, wa), (b, wb), (c, wc) = (roots_jacobi(points, k, 0.0) for k in (2.0, 1.0, 0.0))
    u, v, w = (part.ravel() for part in np.meshgrid(0.5 * (1 + a), 0.5 * (1 + b), 0.5 * (1 + c), indexing="ij"))
    places = np.column_stack([(1 - u) * (1 - v) * (1 - w), u, v * (1 - u), w * (1 - u) * (1 - v)])
    weights = np.einsum("i,j,k->ijk", wa, wb, wc).ravel()
    return places, weights / weights.sum()
