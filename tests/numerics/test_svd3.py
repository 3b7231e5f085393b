"""The rotation-variant SVD: accuracy for every rank, sign, repetition and scale."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from supple.errors import SolverError
from supple.numerics.svd3 import principal_stretches, rotation_variant_svd


def rotations(rng, n):
    q = np.linalg.qr(rng.normal(size=(n, 3, 3)))[0]
    return q * np.sign(np.linalg.det(q))[:, None, None]


def check(F, tolerance=1e-14):
    U, s, V = rotation_variant_svd(F)
    scale = np.abs(F).max(axis=(-1, -2))
    scale = np.where(scale > 0.0, scale, 1.0)[..., None]
    unit = F / scale[..., None]
    rebuilt = U * (s / scale)[..., None, :] @ V.swapaxes(-1, -2)
    assert np.abs(rebuilt - unit).max() <= tolerance
    for R in (U, V):
        assert np.abs(R @ R.swapaxes(-1, -2) - np.eye(3)).max() <= tolerance
        assert np.abs(np.linalg.det(R) - 1.0).max() <= tolerance
    assert (s[..., 0] >= s[..., 1]).all()
    assert (s[..., 1] >= np.abs(s[..., 2])).all()
    alone = principal_stretches(np.ascontiguousarray(F.reshape(-1, 3, 3))).reshape(s.shape)
    assert (np.abs(alone - s) / scale).max() <= tolerance
    return s


@pytest.mark.parametrize(
    "stretches",
    [
        (1.0, 1.0, 1.0),
        (1.0, 1.0, -1.0),
        (2.0, 1.0, 1.0),
        (2.0, 2.0, -1.0),
        (1.0, 1.0 + 1e-9, 1.0 - 1e-9),
        (1.0, 1.0 - 1e-15, -1.0),
        (1.0, 0.5, 0.0),
        (1.0, 1.0, 0.0),
        (1.0, 0.0, 0.0),
        (0.0, 0.0, 0.0),
        (1.0, 1e-8, -1e-8),
        (1.0, 1e-8, 1e-16),
        (1.0, 1e-160, 1e-170),
        (3.0, 0.2, -0.1),
    ],
)
@pytest.mark.parametrize("scale", [1.0, 1e-150, 1e-300, 1e150, 1e300])
def test_known_stretches_are_found(stretches, scale):
    rng = np.random.default_rng(5)
    n = 300
    s = check(rotations(rng, n) * np.array(stretches) @ rotations(rng, n) * scale)
    expected = sorted(stretches, reverse=True, key=abs)
    if abs(expected[2]) > 1e-12:
        # With two stretches of equal size, only the last one may be negative.
        expected = [abs(expected[0]), abs(expected[1]), np.prod(np.sign(stretches)) * abs(expected[2])]
        np.testing.assert_allclose(s / scale, np.broadcast_to(expected, s.shape), atol=1e-14 * abs(expected[0]))
    else:
        np.testing.assert_allclose(np.abs(s) / scale, np.broadcast_to(np.abs(expected), s.shape), atol=1e-14)


def test_entries_of_all_sizes():
    rng = np.random.default_rng(1)
    check(rng.normal(size=(2000, 3, 3)) * 10.0 ** rng.uniform(-20, 20, size=(2000, 3, 3)))
    check(rng.normal(size=(500, 3, 3)) * np.array([1.0, 1e-160, 1e-170]))
    check(rng.integers(-1, 2, size=(2000, 3, 3)).astype(np.float64))


@settings(max_examples=200, deadline=None)
@given(arrays(np.float64, (3, 3), elements=st.floats(-1e3, 1e3, allow_subnormal=False)))
def test_any_matrix(F):
    s = check(F)
    size = max(abs(F).max(), 1e-300)
    np.testing.assert_allclose(np.abs(s) / size, np.linalg.svd(F / size)[1], atol=1e-13)


def test_sign_follows_the_determinant():
    rng = np.random.default_rng(2)
    F = rng.normal(size=(1000, 3, 3))
    s = rotation_variant_svd(F)[1]
    assert (np.sign(s[:, 2]) == np.sign(np.linalg.det(F))).all()


def test_shapes_and_errors():
    U, s, V = rotation_variant_svd(np.broadcast_to(np.eye(3), (2, 5, 3, 3)))
    assert (U.shape, s.shape, V.shape) == ((2, 5, 3, 3), (2, 5, 3), (2, 5, 3, 3))
    with pytest.raises(SolverError, match="last two axes"):
        rotation_variant_svd(np.zeros((3, 2)))


def test_values_that_are_not_finite_give_not_a_number():
    assert np.isnan(rotation_variant_svd(np.full((3, 3), np.nan))[1]).all()


def test_principal_stretches_are_right_beside_matrices_that_are_zero_huge_or_not_finite():
    rng = np.random.default_rng(3)
    F = np.eye(3) + 0.5 * rng.normal(size=(37, 3, 3))
    F[5], F[17], F[18], F[36] = 0.0, np.nan, 1e200 * F[18], np.diag([1.0, 1.0, -1e-9])
    together = principal_stretches(F)
    np.testing.assert_allclose(together, rotation_variant_svd(F)[1], rtol=1e-13, atol=1e-15)
    assert np.isnan(together[17]).all()
    assert together[36, 2] == -1e-9
