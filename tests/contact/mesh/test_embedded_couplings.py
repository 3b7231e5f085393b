"""Matrices between embedded points, against dense products."""

import numpy as np
from tests.derivatives import dense_couplings

from supple.numerics.geometry.embedded_points import EmbeddedPoints, vertex_couplings
from supple.numerics.sparse.couplings import Couplings


def test_couplings_of_points_are_those_of_their_vertices():
    """Points on one, two and three vertices, some of which they share."""
    points = EmbeddedPoints(
        np.array([0, 1, 3, 6, 8], dtype=np.int32),
        np.array([4, 4, 2, 0, 1, 2, 3, 0], dtype=np.int32),
        np.array([1.0, 0.25, 0.75, 0.2, 0.3, 0.5, 1.5, -0.5]),
    )
    rng = np.random.default_rng(1)
    pairs = [(i, j) for i in range(4) for j in range(i, 4)] + [(3, 1), (2, 2)]
    blocks = rng.normal(size=(len(pairs), 3, 3))
    for k, (i, j) in enumerate(pairs):
        if i == j:
            blocks[k] += blocks[k].T
    rows, columns = np.array(pairs, dtype=np.int32).T.copy()
    between = Couplings(rows, columns, blocks)
    weights = np.zeros((4, 5))
    for k in range(4):
        part = slice(points.start[k], points.start[k + 1])
        np.add.at(weights[k], points.vertices[part], points.weights[part])
    W = np.kron(weights, np.eye(3))
    assert np.allclose(
        dense_couplings([vertex_couplings(points, between)], 5), W.T @ dense_couplings([between], 4) @ W, atol=1e-13
    )


def test_points_that_are_vertices_are_renamed():
    points = EmbeddedPoints.at_vertices(np.array([7, 3, 5], dtype=np.int32))
    between = Couplings(np.array([0, 1], np.int32), np.array([2, 1], np.int32), np.ones((2, 3, 3)))
    found = vertex_couplings(points, between)
    assert found.rows.tolist() == [7, 3]
    assert found.columns.tolist() == [5, 3]
    assert found.blocks is between.blocks
