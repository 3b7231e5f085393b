"""The smallest positive root of a cubic; the result is never beyond the true root.

The closed form (Cardano in complex numbers, without imaginary parts below a tolerance) loses or misplaces roots when
the leading coefficient is small compared with the others. This happens for directions that move a tetrahedron's nodes
almost in a plane. Here the cubic is split at its extrema into monotone pieces. The first piece that changes sign is
bisected from the side where the cubic has the sign of its constant term.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import SolverError
from supple.numerics.geometry.double_double import two_product, two_sum
from supple.runtime.kernel_cache import njit

# Bounds on the rounding error of Horner's rule and of its compensated form, relative to the sum of the terms' sizes.
_ROUND_OFF = 2e-15
_COMPENSATED_ROUND_OFF = 2e-30


@njit
def _is_positive(a, b, c, d, t):
    """Whether a t^3 + b t^2 + c t + d, t >= 0, is certainly above zero, with round-off taken into account.

    Source of the compensated Horner rule: Graillat, Langlois, Louvet (2005).
    """
    size = ((abs(a) * t + abs(b)) * t + abs(c)) * t + abs(d)
    value = ((a * t + b) * t + c) * t + d
    if abs(value) > _ROUND_OFF * size or size == math.inf:
        return value > 0.0
    value = a
    error = 0.0
    for k in range(3):
        coefficient = b if k == 0 else (c if k == 1 else d)
        product, product_error = two_product(value, t)
        value, sum_error = two_sum(product, coefficient)
        error = error * t + (product_error + sum_error)
    return value + error > _COMPENSATED_ROUND_OFF * size


@njit
def positive_on_unit_interval(a, b, c, d):
    """Whether all Bernstein coefficients on [0, 1] are above zero; then the cubic is above zero on the whole interval.

    Source: Farouki, "The Bernstein polynomial basis: a centennial retrospective" (2012), section 3.
    """
    return d > 0.0 and d + c / 3.0 > 0.0 and d + (2.0 * c + b) / 3.0 > 0.0 and a + b + c + d > 0.0


@njit
def _extrema(a, b, c):
    """Real roots p <= q of the derivative 3 a t^2 + 2 b t + c; infinity for each one that does not exist."""
    A, B = 3.0 * a, 2.0 * b
    size = max(max(abs(A), abs(B)), abs(c))
    if size == 0.0:
        return math.inf, math.inf
    A, B, C = A / size, B / size, c / size
    square = B * B - 4.0 * A * C
    if not square > 0.0:
        # No extremum, or a stationary point that is not an extremum.
        return math.inf, math.inf
    h = -0.5 * (B + math.copysign(math.sqrt(square), B))
    p = h / A if A != 0.0 else math.inf
    q = C / h if h != 0.0 else math.inf
    # A root that overflows lies outside every interval of interest.
    p = p if abs(p) < math.inf else math.inf
    q = q if abs(q) < math.inf else math.inf
    return (p, q) if p <= q else (q, p)


@njit
def _bisect(a, b, c, d, low, high):
    """The last number in [low, high] where the cubic is certainly positive; it is so at low and not at high."""
    for _ in range(1100):
        # Halve the interval, or its logarithm where low is much smaller than high.
        middle = math.sqrt(low) * math.sqrt(high) if low > 0.0 and low < 0.01 * high else 0.5 * (low + high)
        if middle <= low or middle >= high:
            break
        if _is_positive(a, b, c, d, middle):
            low = middle
        else:
            high = middle
    return low


@njit
def last_positive_before_root(a, b, c, d, end):
    """Where a t^3 + b t^2 + c t + d, positive at 0, has its first root in (0, end]: the last t before it.

    Parameters
    ----------
    a, b, c, d : finite; d > 0.
    end : above 0, finite.

    Returns
    -------
    t : the cubic is above zero on [0, t] and not at the next numbers after t, as far as double precision resolves it.
        Minus one without a root in (0, end]. A root that is touched but not crossed counts.
    """
    p, q = _extrema(a, b, c)
    low = 0.0
    for k in range(3):
        high = p if k == 0 else (q if k == 1 else end)
        if high <= low:
            continue
        high = min(high, end)
        if not _is_positive(a, b, c, d, high):
            return _bisect(a, b, c, d, low, high)
        low = high
        if low >= end:
            break
    return -1.0


@njit
def _root_bound(a, b, c, d):
    """An upper bound of all roots. Source: Fujiwara (1916)."""
    if a != 0.0:
        bound = 2.0 * max(max(abs(b / a), abs(c / a) ** 0.5), abs(0.5 * d / a) ** (1.0 / 3.0))
    elif b != 0.0:
        bound = 2.0 * max(abs(c / b), abs(0.5 * d / b) ** 0.5)
    elif c != 0.0:
        bound = abs(d / c)
    else:
        bound = 0.0
    return min(2.0 * bound, 1e300)


@njit
def _first_root_below_bound(a, b, c, d):
    end = _root_bound(a, b, c, d)
    return last_positive_before_root(a, b, c, d, end) if end > 0.0 else -1.0


@njit
def _first_root(a, b, c, d, tol):
    if not (abs(a) < math.inf and abs(b) < math.inf and abs(c) < math.inf and abs(d) < math.inf):
        return math.nan
    if d == 0.0:
        # t = 0 is a root and not a positive one: divide it out.
        a, b, c, d = 0.0, a, b, c
        if d == 0.0:
            a, b, c, d = 0.0, 0.0, b, c
            if d == 0.0:
                return -1.0
    if d < 0.0:
        a, b, c, d = -a, -b, -c, -d
    near = last_positive_before_root(a, b, c, d, 1.0)
    if near >= 0.0:
        return max(near, 5e-324)
    full_a, full_b, full_c = a, b, c
    if abs(a) <= tol:
        a = 0.0
        if abs(b) <= tol:
            b = 0.0
            if abs(c) <= tol:
                c = 0.0
    far = _first_root_below_bound(a, b, c, d)
    if 0.0 <= far <= 1.0:
        # The complete cubic has no root in the unit interval: this root lies just beyond it, or does not exist.
        far = _first_root_below_bound(full_a, full_b, full_c, d)
    return far


@njit(cache=True)
def _first_roots(coefficients, tol, out):
    for i in range(len(out)):
        out[i] = _first_root(coefficients[0, i], coefficients[1, i], coefficients[2, i], coefficients[3, i], tol)


def smallest_positive_cubic_root(
    a: ArrayLike, b: ArrayLike, c: ArrayLike, d: ArrayLike, tol: float = 1e-6
) -> float | NDArray[np.float64]:
    """The smallest positive root of a t^3 + b t^2 + c t + d; a negative number where none exists.

    Scale the coefficients by the constant term first: d = 1 for the first inversion of a tetrahedron, d = 0.8 for the
    first loss of 80 % of its volume. Beyond t = 1 leading coefficients of at most `tol` count as zero, so that the
    cubic degenerates to a quadratic, linear or constant one. Up to t = 1, the
    range of a step filter, every coefficient counts as it is.

    Parameters
    ----------
    a, b, c, d : coefficients [-], numbers or arrays that broadcast.
    tol : size below which a leading coefficient counts as zero beyond t = 1.

    Returns
    -------
    t : float, or array of the broadcast shape. Where d is not zero, t is not beyond the true root, and less than it
        only by round-off: the polynomial has the sign of d on [0, t]. A root that is touched and not crossed counts.

    Raises
    ------
    SolverError : where a coefficient is not finite.

    Source: Li, Jiang, Luo, "Physics-Based Simulation", implementation 23.3.1, for the contract and its scaling.
    """
    rows = np.stack(np.broadcast_arrays(*(np.asarray(value, dtype=np.float64) for value in (a, b, c, d))))
    if not np.isfinite(rows).all():
        raise SolverError("smallest_positive_cubic_root: every coefficient must be finite")
    out = np.empty(rows[0].size)
    _first_roots(rows.reshape(4, -1), float(tol), out)
    return float(out[0]) if rows.ndim == 1 else out.reshape(rows.shape[1:])
