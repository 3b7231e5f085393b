"""Conjugate gradients and their two-level preconditioner, on elasticity matrices and against dense algebra."""

import numpy as np
import pytest

import supple as sp
from supple.numerics.sparse.block_csr import build_pattern
from supple.numerics.sparse.partition import bisected_groups
from supple.numerics.sparse.pcg import conjugate_gradients
from supple.numerics.sparse.preconditioner import order_rows, two_level
from supple.numerics.sparse.skyline_cholesky import factorize, solve


def linear_elasticity(mesh, mu, lam):
    """(m, 12, 12) stiffness matrices of small strains."""
    B = mesh.rest_shape_inverse
    g = np.concatenate([-B.sum(axis=1, keepdims=True), B], axis=1)
    eye = np.eye(3)
    blocks = lam * np.einsum("epi,eqk->epiqk", g, g) + mu * np.einsum("epk,eqi->epiqk", g, g)
    blocks += mu * np.einsum("epj,eqj,ik->epiqk", g, g, eye)
    return (blocks * mesh.volumes[:, None, None, None, None]).reshape(-1, 12, 12)


def beam_problem(divisions=(12, 4, 4), mass=0.0, lam=1.0):
    mesh = sp.shapes.box((divisions[0] / divisions[1], 1, 1), divisions)
    free = mesh.vertices[:, 0] > mesh.vertices[:, 0].min() + 1e-9
    order = order_rows(mesh.vertices, np.zeros(len(free), dtype=np.int32), mesh.tets, free)
    rows = np.full(len(free), -1, dtype=np.int32)
    rows[order.vertices] = np.arange(len(order.vertices))
    pattern = build_pattern(rows[mesh.tets], len(order.vertices))
    data = np.zeros((pattern.blocks, 3, 3))
    diagonal = np.broadcast_to(mass * np.eye(3), (pattern.rows, 3, 3))
    pattern.assemble(linear_elasticity(mesh, 1.0, lam), np.ascontiguousarray(diagonal), data)
    preconditioner = two_level(pattern, mesh.vertices[order.vertices], order.group_start)
    preconditioner.update(data)
    return pattern, preconditioner, data


def test_solves_a_clamped_beam():
    pattern, preconditioner, data = beam_problem()
    b = np.random.default_rng(0).normal(size=(pattern.rows, 3))
    x = np.full_like(b, np.nan)
    result = conjugate_gradients(preconditioner, b, x, 1e-10, 500)
    assert result.converged
    assert not result.indefinite
    residual = pattern.to_scipy(data) @ x.ravel() - b.ravel()
    assert np.abs(residual).max() < 1e-7 * np.abs(b).max()


def test_the_coarse_level_is_exact_for_its_own_fields():
    # One group without pins: all affine fields are coarse, and a force that asks for one is met in few iterations.
    mesh = sp.shapes.box((1, 1, 1), (3, 3, 3))
    n = len(mesh.vertices)
    pattern = build_pattern(mesh.tets, n)
    data = np.zeros((pattern.blocks, 3, 3))
    mass = 1e-3 * np.broadcast_to(np.eye(3), (n, 3, 3))
    pattern.assemble(linear_elasticity(mesh, 1.0, 1.0), np.ascontiguousarray(mass), data)
    preconditioner = two_level(pattern, mesh.vertices, np.array([0, n], dtype=np.int32))
    preconditioner.update(data)
    field = mesh.vertices @ np.array([[0.1, 0.5, 0], [-0.2, 0.3, 0], [0, 1, 0.2]]) + np.array([1.0, 2.0, 3.0])
    b = (pattern.to_scipy(data) @ field.ravel()).reshape(-1, 3)
    x = np.zeros_like(b)
    result = conjugate_gradients(preconditioner, b, x, 1e-3, 100)
    assert result.iterations <= 12
    assert np.allclose(x, field, rtol=0.02, atol=0.02 * np.abs(field).max())


@pytest.mark.slow
def test_iterations_hardly_grow_with_refinement():
    counts = []
    for k in (1, 2, 3):
        pattern, preconditioner, _ = beam_problem((8 * k, 4 * k, 4 * k))
        b = np.zeros((pattern.rows, 3))
        b[:, 1] = -1.0
        result = conjugate_gradients(preconditioner, b, np.zeros_like(b), 1e-6, 500)
        assert result.converged
        counts.append(result.iterations)
    # One-level methods grow like the number of elements along an edge: threefold here.
    assert counts[2] < 1.8 * counts[0]


def test_near_incompressible_matrices_do_not_break_down():
    pattern, preconditioner, _ = beam_problem((8, 4, 4), lam=500.0)
    b = np.random.default_rng(1).normal(size=(pattern.rows, 3))
    result = conjugate_gradients(preconditioner, b, np.zeros_like(b), 1e-8, 2000)
    assert result.converged


def test_an_indefinite_matrix_is_noticed():
    pattern, preconditioner, _ = beam_problem((4, 2, 2), mass=-0.5)
    b = np.random.default_rng(1).normal(size=(pattern.rows, 3))
    result = conjugate_gradients(preconditioner, b, np.zeros_like(b), 1e-12, 500)
    assert result.indefinite
    assert not result.converged


def test_envelope_cholesky_agrees_with_dense_algebra():
    rng = np.random.default_rng(5)
    first = np.array([0, 0, 1, 0, 3], dtype=np.int32)
    L = np.zeros((60, 60))
    for i, low in enumerate(first):
        L[12 * i : 12 * i + 12, 12 * low : 12 * i + 12] = rng.normal(size=(12, 12 * (i + 1 - low)))
    L = np.tril(L) + 10 * np.eye(60)
    A = L @ L.T
    blocks = np.ascontiguousarray(A.reshape(5, 12, 5, 12).transpose(0, 2, 1, 3))
    factorize(blocks, first)
    b = rng.normal(size=60)
    x = b.copy()
    solve(blocks, first, x)
    assert np.allclose(A @ x, b, atol=1e-9)


def test_envelope_cholesky_drops_dependent_directions():
    A = np.eye(12)
    A[3] = A[:, 3] = 0.0
    A[3, 3], A[3, 2], A[2, 3] = 1.0, 1.0, 1.0
    blocks = A.reshape(1, 1, 12, 12).copy()
    factorize(blocks, np.zeros(1, dtype=np.int32))
    b = np.ones(12)
    solve(blocks, np.zeros(1, dtype=np.int32), b)
    assert np.isfinite(b).all()
    assert np.allclose(A @ b, np.ones(12))


def test_groups_are_of_about_equal_size_and_hold_one_component():
    points = np.random.default_rng(0).uniform(size=(1000, 3))
    labels = (np.arange(1000) % 10 == 0).astype(np.int32)
    groups = bisected_groups(points, labels, 10)
    assert sorted(np.concatenate(groups)) == list(range(1000))
    assert all(len(set(labels[g])) == 1 for g in groups)
    assert max(len(g) for g in groups) <= 1.5 * min(len(g) for g in groups if labels[g[0]] == 0)


def test_vectors_over_all_rows_cost_no_iterations():
    pattern, preconditioner, data = beam_problem()
    rng = np.random.default_rng(1)
    b = rng.normal(size=(pattern.rows, 3))
    plain = conjugate_gradients(preconditioner, b, np.zeros_like(b), 1e-10, 500)
    # As stiff as a liquid that fills the body: the matrix alone has eigenvalues of about 1.
    low_rank = np.stack([1e3 * rng.normal(size=b.shape), 0.1 * rng.normal(size=b.shape)])
    x = np.zeros_like(b)
    result = conjugate_gradients(preconditioner, b, x, 1e-10, 500, low_rank)
    assert result.converged
    assert result.iterations <= plain.iterations + 5
    G = low_rank.reshape(2, -1).T
    residual = pattern.to_scipy(data) @ x.ravel() + G @ (G.T @ x.ravel()) - b.ravel()
    assert np.abs(residual).max() < 1e-5 * np.abs(b).max()
