"""3x3 algebra on tuples against NumPy."""

import numpy as np
import pytest

from supple.numerics import mat3


def as_tuple(M):
    return tuple(float(v) for v in np.asarray(M).ravel())


def test_products_against_numpy():
    rng = np.random.default_rng(0)
    A, B = rng.normal(size=(2, 3, 3))
    a, b, c = rng.normal(size=(3, 3))
    np.testing.assert_allclose(mat3.mat_mul(as_tuple(A), as_tuple(B)), (A @ B).ravel())
    np.testing.assert_allclose(mat3.mat_mul_transposed(as_tuple(A), as_tuple(B)), (A @ B.T).ravel())
    np.testing.assert_allclose(mat3.transpose(as_tuple(A)), A.T.ravel())
    np.testing.assert_allclose(mat3.det(as_tuple(A)), np.linalg.det(A))
    np.testing.assert_allclose(mat3.cross(as_tuple(a), as_tuple(b)), np.cross(a, b))
    np.testing.assert_allclose(mat3.dot(as_tuple(a), as_tuple(c)), a @ c)


@pytest.mark.parametrize(
    "A",
    [
        np.zeros((3, 3)),
        np.diag([3.0, -1.0, 3.0]),
        np.ones((3, 3)),
        np.array([[1.0, 1e-9, 0.0], [1e-9, 1.0, 1e-9], [0.0, 1e-9, 1.0]]),
        np.array([[1e8, 1.0, 1e-8], [1.0, 0.0, 2.0], [1e-8, 2.0, -1e-8]]),
        *(lambda m: m + m.swapaxes(1, 2))(np.random.default_rng(4).normal(size=(20, 3, 3))),
    ],
)
def test_symmetric_eigen(A):
    w, Q = mat3.symmetric_eigen(A[0, 0], A[1, 1], A[2, 2], A[1, 2], A[0, 2], A[0, 1])
    Q = np.reshape(Q, (3, 3))
    size = max(np.abs(A).max(), 1.0)
    np.testing.assert_allclose(Q @ Q.T, np.eye(3), atol=1e-14)
    np.testing.assert_allclose(Q * w @ Q.T, A, atol=1e-14 * size)
    np.testing.assert_allclose(np.sort(w), np.linalg.eigvalsh(A), atol=1e-14 * size)
