"""The order of Gauss-Seidel sweeps, and conjugate gradients where the smoother's diagonal is not that of the matrix."""

import itertools

import numpy as np
import pytest

import supple as sp
from supple.numerics.sparse.block_csr import build_pattern
from supple.numerics.sparse.clusters import MOST_ROWS
from supple.numerics.sparse.partition import bisected_groups
from supple.numerics.sparse.pcg import conjugate_gradients
from supple.numerics.sparse.preconditioner import two_level
from supple.numerics.sparse.sweep_order import SweepOrder


def problem():
    """A random symmetric positive definite matrix of a mesh in six groups: pattern, positions, groups, blocks."""
    mesh = sp.shapes.box((3, 1, 1), (6, 2, 2))
    n = len(mesh.vertices)
    groups = bisected_groups(mesh.vertices, np.zeros(n, dtype=np.int32), 6)
    row_of = np.empty(n, dtype=np.int32)
    row_of[np.concatenate(groups)] = np.arange(n)
    start = np.append(0, np.cumsum([len(g) for g in groups])).astype(np.int32)
    pattern = build_pattern(row_of[mesh.tets], n)
    roots = np.random.default_rng(0).normal(size=(len(mesh.tets), 12, 12))
    data = np.zeros((pattern.blocks, 3, 3))
    pattern.assemble(roots @ roots.transpose(0, 2, 1), np.broadcast_to(np.eye(3), (n, 3, 3)).copy(), data)
    return pattern, mesh.vertices[np.concatenate(groups)], start, data


@pytest.mark.parametrize("joined", [False, True])
def test_both_triangles_and_the_clusters_are_the_matrix_in_the_order_of_the_sweep(joined):
    pattern, _, start, data = problem()
    n = pattern.rows
    group_of = np.repeat(np.arange(len(start) - 1), np.diff(start)).astype(np.int32)
    clusters = np.arange(n, dtype=np.int32)
    if joined:
        clusters[[7, 12, 40, n - 1]], clusters[[3, 15]] = 7, 3
    order = SweepOrder.of(pattern, group_of, clusters)
    order.take(data)
    assert sorted(order.rows) == list(range(n))
    cluster = np.repeat(np.arange(len(order.cluster_start) - 1), np.diff(order.cluster_start))
    assert len(set(clusters)) == cluster[-1] + 1 == len(set(zip(cluster, clusters[order.rows], strict=True)))
    parts = np.zeros((n, n, 3, 3))
    for triangle, places in ((order.lower, np.arange(n)), (order.upper, np.arange(n)[::-1])):
        rows = np.repeat(places, np.diff(triangle.start))
        lower = cluster[triangle.columns] < cluster[rows]
        assert np.array_equal(lower, np.full(len(rows), triangle is order.lower))
        parts[rows, triangle.columns] = triangle.blocks
    for k, (begin, end) in enumerate(itertools.pairwise(order.cluster_start)):
        source = order.dense_source[order.dense_start[k] // 9 : order.dense_start[k + 1] // 9]
        block = np.where((source >= 0)[:, None, None], data[source], 0.0)
        parts[begin:end, begin:end] = block.reshape(end - begin, end - begin, 3, 3)
    dense = pattern.to_scipy(data).toarray().reshape(n, 3, n, 3).transpose(0, 2, 1, 3)
    assert np.array_equal(parts, dense[np.ix_(order.rows, order.rows)])
    color_of = np.repeat(np.arange(len(order.color_start) - 1), np.diff(order.color_start))
    group_of_cluster = np.repeat(np.arange(len(order.group_start) - 1), np.diff(order.group_start))
    group_of_place = group_of_cluster[cluster]
    color_of_place = color_of[group_of_place]
    coupled = np.abs(parts).max(axis=(2, 3)) > 0
    same_color = color_of_place[:, None] == color_of_place
    assert not (coupled & same_color & (group_of_place[:, None] != group_of_place)).any()
    assert joined or len(order.color_start) - 1 < len(start) - 1


def test_stiff_pairs_in_clusters_cost_few_iterations():
    # A chain of stiff springs across groups, as contact makes it, on a soft body.
    pattern, points, start, data = problem()
    rows = np.repeat(np.arange(pattern.rows), np.diff(pattern.row_start))
    direction = np.array([[1.0], [2.0], [2.0]]) / 3
    stiff = 1e6 * direction @ direction.T
    for i, j in zip(rows, pattern.columns, strict=True):
        if i < j and i % 4 == 0:
            for a, b, sign in ((i, i, 1), (j, j, 1), (i, j, -1), (j, i, -1)):
                data[np.flatnonzero((rows == a) & (pattern.columns == b))] += sign * stiff
    b = np.random.default_rng(2).normal(size=(pattern.rows, 3))
    counts = []
    alone = two_level(pattern, points, start)
    for preconditioner in (alone, alone.on(pattern, data)):
        preconditioner.update(data)
        x = np.zeros_like(b)
        result = conjugate_gradients(preconditioner, b, x, 1e-9, 2000)
        assert result.converged
        assert np.abs(pattern.to_scipy(data) @ x.ravel() - b.ravel()).max() < 1e-4
        counts.append(result.iterations)
    sizes = np.diff(preconditioner.order.cluster_start)
    assert sizes.max() == MOST_ROWS
    assert counts[1] <= 0.7 * counts[0]


def test_a_vertex_that_nothing_holds_in_one_direction_does_not_spoil_the_rest():
    # Its diagonal block is singular: the smoother has another one in its place, and the product the block itself.
    pattern, points, start, data = problem()
    free = 20
    rows = np.repeat(np.arange(pattern.rows), np.diff(pattern.row_start))
    for blocks, axis in ((rows == free, 1), (pattern.columns == free, 2)):
        chosen = data[blocks]
        chosen[(slice(None), 2, slice(None)) if axis == 1 else (slice(None), slice(None), 2)] = 0.0
        data[blocks] = chosen
    preconditioner = two_level(pattern, points, start)
    preconditioner.update(data)
    exact = np.random.default_rng(1).normal(size=(pattern.rows, 3))
    exact[free, 2] = 0.0
    b = (pattern.to_scipy(data) @ exact.ravel()).reshape(-1, 3)
    x = np.zeros_like(b)
    result = conjugate_gradients(preconditioner, b, x, 1e-12, 500)
    assert result.converged
    x[free, 2] = 0.0  # any value solves the system
    assert np.allclose(x, exact, atol=1e-8)
