"""The smallest positive root against exact rational arithmetic."""

from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from supple.errors import SolverError
from supple.numerics.cubic import smallest_positive_cubic_root


def sign_changes(polynomials, t):
    """Sign changes of a Sturm sequence at t (None: at infinity)."""
    signs = []
    for f in polynomials:
        if t is None:
            v = f[-1]
        else:
            v = Fraction(0)
            for coefficient in reversed(f):
                v = v * t + coefficient
        if v != 0:
            signs.append(v > 0)
    return sum(x != y for x, y in pairwise(signs))


def roots_in(coefficients, low, high):
    """Number of different real roots in (low, high], exactly (Sturm). high None: infinity."""

    def trimmed(f):
        while len(f) > 1 and f[-1] == 0:
            f = f[:-1]
        return f

    f = trimmed([Fraction(float(v)) for v in reversed(coefficients)])
    if len(f) == 1:
        return 0
    sequence = [f, trimmed([k * v for k, v in enumerate(f)][1:])]
    while len(sequence[-1]) > 1:
        r, g = list(sequence[-2]), sequence[-1]
        while len(r) >= len(g):
            factor = r[-1] / g[-1]
            shift = len(r) - len(g)
            for k, v in enumerate(g):
                r[k + shift] -= factor * v
            r.pop()
        r = trimmed([-v for v in r] or [Fraction(0)])
        if r == [0]:
            break
        sequence.append(r)
    return sign_changes(sequence, Fraction(low)) - sign_changes(sequence, None if high is None else Fraction(high))


def check(a, b, c, d):
    t = smallest_positive_cubic_root(a, b, c, d, tol=0.0)
    if t < 0:
        # A double root, or one that overflows, may be missed; a sign change may not.
        assert roots_in((a, b, c, d), 0, 10**12) == 0
    else:
        assert roots_in((a, b, c, d), 0, Fraction(t) * (1 - Fraction(1, 10**9))) == 0
        assert (
            roots_in((a, b, c, d), Fraction(t) * (1 - Fraction(1, 10**9)), Fraction(t) * (1 + Fraction(1, 10**6))) > 0
        )


@pytest.mark.parametrize(
    ("coefficients", "truth"),
    [((2e-6, 2000.0, -200.0, 0.8), 0.0041742430504424), ((1e-5, 500.0, -300.0, 0.8), 0.0026786250536305)],
)
def test_cases_on_which_the_published_form_fails(coefficients, truth):
    assert smallest_positive_cubic_root(*coefficients) == pytest.approx(truth, rel=1e-12)


@pytest.mark.parametrize(
    ("coefficients", "truth"),
    [
        ((0.0, 0.0, 0.0, 1.0), -1.0),
        ((0.0, 0.0, 0.0, 0.0), -1.0),
        ((0.0, 0.0, -1.0, 0.8), 0.8),
        ((0.0, 0.0, 1.0, 0.8), -1.0),
        ((0.0, 0.0, -1e-3, 0.8), 800.0),
        ((0.0, 0.0, 1.0, -5e5), 5e5),
        ((0.0, 1.0, -3.0, 2.0), 1.0),
        ((0.0, 1.0, 0.0, 1.0), -1.0),
        ((0.0, -1.0, 0.0, 100.0), 10.0),
        ((1.0, -6.0, 11.0, -6.0), 1.0),
        ((-1.0, 0.0, 0.0, 1000.0), 10.0),
        ((1.0, -1.0, 0.0, 0.0), 1.0),
        ((1.0, 0.0, 0.0, 0.0), -1.0),
        ((1.0, 6.0, 11.0, 6.0), -1.0),
        ((0.0, 4.0, -4.0, 1.0), 0.5),
        ((-1.0, 3.0, -3.0, 1.0), 1.0),
    ],
)
def test_known_roots(coefficients, truth):
    t = smallest_positive_cubic_root(*coefficients)
    assert t == pytest.approx(truth, rel=1e-9) if truth > 0 else t < 0


def test_leading_coefficients_below_tol_count_only_up_to_one():
    assert smallest_positive_cubic_root(-1e-7, 0.0, 0.0, 1.0) < 0.0
    assert smallest_positive_cubic_root(-1e-7, 0.0, 0.0, 1.0, tol=1e-8) == pytest.approx(1e7 ** (1 / 3))
    assert smallest_positive_cubic_root(-1e-7, 0.0, 0.0, 1e-8) == pytest.approx(0.1 ** (1 / 3))
    assert smallest_positive_cubic_root(1e-9, 1.0, -3.0, 2.0) == pytest.approx(1.0, rel=1e-8)


@settings(max_examples=300, deadline=None)
@given(
    st.tuples(*[st.floats(-1, 1) for _ in range(3)]),
    st.tuples(*[st.integers(-9, 6) for _ in range(3)]),
    st.sampled_from([0.8, 1.0, -1.0, 1e-3]),
)
def test_against_sturm_sequences(mantissas, exponents, d):
    check(*(float(np.ldexp(m, 3 * e)) for m, e in zip(mantissas, exponents, strict=True)), d)


@settings(max_examples=150, deadline=None)
@given(st.floats(0.01, 2.0), st.floats(-1e-12, 1e-12), st.floats(-3.0, 3.0).filter(lambda v: abs(v) > 1e-3))
def test_nearly_double_roots_are_not_overstepped(root, gap, other):
    f = np.polymul(np.polymul([1.0, -root], [1.0, -root * (1.0 + gap)]), [1.0, -other])
    if f[3] < 0.0:
        f = -f
    t = smallest_positive_cubic_root(*f)
    if t > 0:
        assert roots_in(tuple(f), 0, Fraction(t) * (1 - Fraction(1, 10**9))) == 0
    else:
        assert roots_in(tuple(f), 0, 10) == 0


def test_arrays_broadcast():
    t = smallest_positive_cubic_root([0.0, 0.0], [[0.0], [1.0]], [-1.0, -3.0], [0.8, 2.0])
    assert isinstance(t, np.ndarray)
    assert t.shape == (2, 2)
    np.testing.assert_allclose(t, [[0.8, 2.0 / 3.0], [-1.0, 1.0]], rtol=1e-12)


def test_not_finite_is_an_error():
    with pytest.raises(SolverError, match="finite"):
        smallest_positive_cubic_root(1.0, np.nan, 0.0, 1.0)
