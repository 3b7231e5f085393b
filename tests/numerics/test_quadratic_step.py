"""The step filter of quadratic tets: never beyond the true limit, and not much shorter."""

import numpy as np
import pytest

from supple.numerics.bernstein import determinant_coefficients, positive_elements
from supple.numerics.quadratic_noninverting_step import noninverting_step
from supple.numerics.quadratic_shape_functions import NODE_COORDINATES, reference_gradients
from supple.results.check.geometry import quadratic_tets as of_check
from supple.runtime.threads import numba_threads

KEEP = 0.2
NODES = np.arange(10, dtype=np.int32)[None]
GUARDED = np.ones(1, dtype=bool)
rng = np.random.default_rng(0)
DENSE = np.concatenate([rng.dirichlet(np.full(4, spread), 2000) for spread in (1.0, 0.3)] + [NODE_COORDINATES])
GRADIENTS = reference_gradients(DENSE)


def determinants(x):
    """(m, q) of elements (m, 10, 3), at many places in each."""
    return np.linalg.det(np.einsum("mai,qaj->mqij", x, GRADIENTS))


def elements(count, noise, seed=0):
    """Curved elements that are positive everywhere."""
    x = NODE_COORDINATES[:, 1:] + noise * np.random.default_rng(seed).normal(size=(count, 10, 3))
    positive = np.empty(count, dtype=bool)
    positive_elements(x.reshape(-1, 3), np.arange(10 * count, dtype=np.int32).reshape(-1, 10), positive)
    return x[positive]


def step(x, p, keep=KEEP, whole=False):
    with numba_threads(1):
        return noninverting_step(*map(np.ascontiguousarray, (x, p)), NODES, GUARDED, np.array([whole]), keep)[0]


def test_positivity_is_that_of_all_places_and_of_the_check():
    x = NODE_COORDINATES[:, 1:] + 0.12 * np.random.default_rng(1).normal(size=(300, 10, 3))
    positive = np.empty(len(x), dtype=bool)
    positive_elements(x.reshape(-1, 3), np.arange(10 * len(x), dtype=np.int32).reshape(-1, 10), positive)
    least = determinants(x).min(axis=1)
    assert 0.1 < positive.mean() < 0.9
    assert not (positive & (least <= 0.0)).any()
    assert not (~positive & (least > 0.05)).any()
    np.testing.assert_array_equal(of_check.are_positive(x), positive)


def test_the_coefficients_bound_the_determinant():
    x = elements(50, 0.1)
    c = determinant_coefficients(x.reshape(-1, 3), np.arange(10 * len(x), dtype=np.int32).reshape(-1, 10))
    d = determinants(x)
    assert (c.min(axis=1) <= d.min(axis=1) + 1e-12).all()
    assert (c.max(axis=1) >= d.max(axis=1) - 1e-12).all()
    np.testing.assert_allclose(c.mean(axis=1) / 6.0, of_check.volumes(x), rtol=1e-12)


@pytest.mark.parametrize(
    ("scale", "length"),
    [pytest.param(1.0, 0.1, marks=pytest.mark.slow), (1.0, 1.0), (1.0, 100.0), (1e-6, 1e-6), (1e3, 500.0)],
)
def test_never_an_overstep_and_not_needlessly_short(scale, length):
    limited = short = 0
    random = np.random.default_rng(4)
    for x in scale * elements(40, 0.06, seed=2):
        # A third of the directions shear the element in a plane, which makes the leading coefficients tiny.
        p = length * random.normal(size=(10, 3)) * np.array([1.0, 1.0, random.choice([1.0, 1e-9, 0.0])])
        t = step(x, p)
        assert 0.0 < t <= 1.0
        before = determinants(x[None])[0]
        for share in (1.0, 0.7, 0.3):
            assert (determinants((x + share * t * p)[None])[0] >= KEEP * before * (1 - 1e-9)).all()
        if t < 1.0:
            limited += 1
            # Somewhere between the step and a seventh more, the limit is exceeded.
            beyond = determinants(x + np.linspace(1.0, 1.15, 7)[:, None, None] * t * p)
            short += not (beyond < KEEP * before).any()
    assert limited > 5
    assert short <= 0.05 * limited


def test_a_fold_between_the_nodes_limits_the_step():
    """Towards an element that is positive at all nodes and folds between them."""
    straight = NODE_COORDINATES[:, 1:]
    random = np.random.default_rng(3)
    nodes = reference_gradients(NODE_COORDINATES)
    found = 0
    for _ in range(400):
        x = straight + 0.16 * random.normal(size=(10, 3)) * (np.arange(10) > 3)[:, None]
        at_nodes = np.linalg.det(np.einsum("ai,qaj->qij", x, nodes)).min()
        if at_nodes > 0.0 and determinants(x[None]).min() < 0.0:
            found += 1
            assert step(straight, x - straight) < 1.0
    assert found > 3


def test_coefficients_are_kept_where_they_have_a_barrier():
    random = np.random.default_rng(6)
    for x in elements(40, 0.05, seed=5):
        before = determinant_coefficients(x, NODES)
        if before.min() <= 0.0:
            continue
        p = random.normal(size=(10, 3))
        t = step(x, p, whole=True)
        assert 0.0 < t <= step(x, p) * (1 + 0.06)
        for share in (1.0, 0.5):
            assert (determinant_coefficients(x + share * t * p, NODES) >= KEEP * before * (1 - 1e-9)).all()
        assert (determinant_coefficients(x + 1.001 * t * p, NODES) < KEEP * before).any() or t == 1.0


def test_inverted_flat_and_unfinite_elements_allow_nothing():
    x = NODE_COORDINATES[:, 1:].copy()
    assert step(x * [1.0, 1.0, -1.0], 0 * x) == 0.0
    assert step(x * [1.0, 1.0, 0.0], 0 * x) == 0.0
    assert step(np.where(x == 1.0, np.nan, x), 0 * x) == 0.0
    assert step(x, np.full_like(x, np.inf)) == 0.0
    assert step(x, np.ones_like(x)) == 1.0


def test_a_uniform_compression_stops_at_the_share_that_is_kept():
    x = NODE_COORDINATES[:, 1:]
    assert step(x, -x * [1.0, 0.0, 0.0]) == pytest.approx(1.0 - KEEP, rel=0.06)
    assert step(x, -x * [1.0, 0.0, 0.0]) <= 1.0 - KEEP
