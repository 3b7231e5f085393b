"""Sums of products of float64 numbers without any rounding: nonoverlapping expansions.

A number is kept as a sum of floats that do not overlap, smallest first, in an array h[:n]; its sign is that of the last
one. Exact as long as nothing under- or overflows, which `SMALLEST` and `LARGEST` make sure of for coordinates.

Source: Shewchuk, "Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates" (1997), sections
2.2 to 2.5.
"""

from supple.runtime.kernel_cache import njit

_SPLITTER = 134217729.0  # 2^27 + 1
# Coordinates within these, or zero, have differences, and threefold products of them, that float64 can hold exactly:
# their last bits are above 2^-354, so those of the products above 2^-1062.
SMALLEST, LARGEST = 2.0**-300, 2.0**300


@njit(forceinline=False)
def two_sum(a, b):
    """a + b as the rounded sum and its error (theorem 7)."""
    s = a + b
    bb = s - a
    return s, (a - (s - bb)) + (b - bb)


@njit(forceinline=False)
def two_product(a, b):
    """a b as the rounded product and its error (theorem 18)."""
    p = a * b
    c = _SPLITTER * a
    ah = c - (c - a)
    al = a - ah
    c = _SPLITTER * b
    bh = c - (c - b)
    bl = b - bh
    return p, al * bl - (((p - ah * bh) - al * bh) - ah * bl)


@njit(forceinline=False)
def grow(h, n, b):
    """Add b to the expansion h[:n] in place, without zeros; the new length (theorem 10)."""
    if b == 0.0:
        return n
    q = b
    k = 0
    for i in range(n):
        q, e = two_sum(q, h[i])
        if e != 0.0:
            h[k] = e
            k += 1
    if q != 0.0:
        h[k] = q
        k += 1
    return k


@njit(forceinline=False)
def add_product2(h, n, sign, x, y):
    """Add sign x y to the expansion, for x, y given as pairs of floats."""
    for i in range(2):
        for j in range(2):
            if x[i] != 0.0 and y[j] != 0.0:
                p, e = two_product(x[i], y[j])
                n = grow(h, n, sign * e)
                n = grow(h, n, sign * p)
    return n


@njit(forceinline=False)
def add_product3(h, n, sign, x, y, z):
    """Add sign x y z to the expansion, for x, y, z given as pairs of floats."""
    for i in range(2):
        for j in range(2):
            if x[i] == 0.0 or y[j] == 0.0:
                continue
            p, e = two_product(x[i], y[j])
            for k in range(2):
                if z[k] == 0.0:
                    continue
                if e != 0.0:
                    q, r = two_product(e, z[k])
                    n = grow(h, n, sign * r)
                    n = grow(h, n, sign * q)
                q, r = two_product(p, z[k])
                n = grow(h, n, sign * r)
                n = grow(h, n, sign * q)
    return n


@njit(forceinline=False)
def sign_of(h, n):
    """-1, 0 or 1."""
    if n == 0:
        return 0
    return 1 if h[n - 1] > 0.0 else -1


@njit(forceinline=False)
def in_range(a):
    """Whether a coordinate is one that is computed with exactly."""
    return a == 0.0 or SMALLEST <= abs(a) <= LARGEST
