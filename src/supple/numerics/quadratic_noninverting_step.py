"""The largest step over which no quadratic tetrahedron loses more than a share of its Jacobian anywhere in it.

Along positions x + t p, the 20 Bernstein coefficients of an element's determinant (`bernstein.py`) are cubics in t. So
are those of

    g(l, t) = det(l, t) - keep det(l, 0).

Before the first root of any of these cubics g is positive in the whole element. At the corners the coefficients are g
itself, and their first root bounds the step from above. Where the two bounds are apart, the element is bisected. The
result is not beyond the true limit, and not below 95 % of it.

Elements whose coefficients are to stay positive themselves, because they have a barrier, are not bisected.
"""

from __future__ import annotations

import numpy as np

from supple.numerics.bernstein import (
    ROUND_OFF,
    TERM,
    TERMS,
    add_coefficients,
    bisect,
    bisect_corners,
    corner_derivatives,
    longest_edge,
)
from supple.numerics.cubic import last_positive_before_root
from supple.numerics.mat3 import copy_elements
from supple.runtime.kernel_cache import njit, prange

# The lower bound is sharp enough when it is above this share of the upper one.
_SHARP = 0.95
# After this many bisections, the lower bound is taken as it is.
_DEEPEST = 24
_RUN = 64


@njit
def _first_root(b0, b1, b2, b3):
    """The last t before the first root in [0, 1] of a cubic with these Bernstein coefficients; 2 where none is."""
    if b0 > 0.0 and b1 > 0.0 and b2 > 0.0 and b3 > 0.0:
        return 2.0
    a, b, c = b3 - 3.0 * b2 + 3.0 * b1 - b0, 3.0 * (b2 - 2.0 * b1 + b0), 3.0 * (b1 - b0)
    if not (b0 > 0.0 and abs(a) < np.inf and abs(b) < np.inf and abs(c) < np.inf):
        return 0.0
    t = last_positive_before_root(a, b, c, b0, 1.0)
    return 2.0 if t < 0.0 else t


@njit
def _positive_until(b0, b1, b2, b3, t):
    """Whether the Bernstein coefficients on [0, t] are above zero: a test without roots that is sufficient."""
    s = 1.0 - t
    c1, d1, e1 = s * b0 + t * b1, s * b1 + t * b2, s * b2 + t * b3
    c2, d2 = s * c1 + t * d1, s * d1 + t * e1
    return b0 > 0.0 and c1 > 0.0 and c2 > 0.0 and s * c2 + t * d2 > 0.0


@njit
def _smallest_root(v):
    """The first root in [0, 1] of any of the cubics v (4, 4, 4, 4), over t first."""
    smallest = 2.0
    for a in range(4):
        for b in range(a + 1):
            for c in range(b + 1):
                smallest = min(smallest, _first_root(v[0, a, b, c], v[1, a, b, c], v[2, a, b, c], v[3, a, b, c]))
    return smallest


@njit
def _element_step(x, p, nodes, e, whole, keep, here, ahead, terms):
    """Largest t in [0, 1] for element e; 0 where it is inverted or flat somewhere, or something is not finite.

    whole : whether all coefficients are kept, not only the determinant
    here, ahead : (4, 3, 3) and terms : (4, 20) memory
    """
    size_here = corner_derivatives(x, nodes, e, here)
    size_ahead = corner_derivatives(p, nodes, e, ahead)
    if not (size_here < np.inf and size_ahead < np.inf):
        return 0.0
    longest = 1.0
    for k in range(3):
        reach = 0.0
        for c in range(4):
            length = 0.0
            for i in range(3):
                # The derivatives at the end of the step, and the largest on the way.
                length += abs(here[c, k, i]) + abs(ahead[c, k, i])
                ahead[c, k, i] += here[c, k, i]
            reach = max(reach, length)
        longest *= reach
    terms[:] = 0.0
    third = 1.0 / 3.0
    add_coefficients(here, here, here, 1.0, terms[0])
    add_coefficients(ahead, here, here, third, terms[1])
    add_coefficients(here, ahead, here, third, terms[1])
    add_coefficients(here, here, ahead, third, terms[1])
    add_coefficients(here, ahead, ahead, third, terms[2])
    add_coefficients(ahead, here, ahead, third, terms[2])
    add_coefficients(ahead, ahead, here, third, terms[2])
    add_coefficients(ahead, ahead, ahead, 1.0, terms[3])
    positive = True
    for k in range(TERMS):
        kept = keep * terms[0, k]
        for j in range(4):
            # At t = 0 round-off is that of the element alone, however long the step is.
            terms[j, k] -= kept + ROUND_OFF * (size_here if j == 0 else longest)
            if not terms[j, k] > 0.0:
                positive = False
    if positive:
        return 1.0
    if not whole:
        return _bisected_step(terms)
    smallest = 1.0
    for k in range(TERMS):
        smallest = min(smallest, _first_root(terms[0, k], terms[1, k], terms[2, k], terms[3, k]))
    return smallest


@njit
def _bisected_step(terms):
    values = np.empty((_DEEPEST + 2, 4, 4, 4, 4))
    corners = np.empty((_DEEPEST + 2, 4, 4))
    depths = np.empty(_DEEPEST + 2, dtype=np.int64)
    for a in range(4):
        for b in range(4):
            corners[0, a, b] = 1.0 if a == b else 0.0
            for c in range(4):
                for j in range(4):
                    values[0, j, a, b, c] = terms[j, TERM[a, b, c]]
    depths[0] = 0
    count = 1
    upper, lower = 2.0, 2.0
    while count > 0:
        top = count - 1
        v = values[top]
        for c in range(4):
            b0, b1, b2, b3 = v[0, c, c, c], v[1, c, c, c], v[2, c, c, c], v[3, c, c, c]
            if not _positive_until(b0, b1, b2, b3, min(1.0, upper)):
                upper = min(upper, _first_root(b0, b1, b2, b3))
        if upper == 0.0:
            return 0.0
        wanted = min(lower, min(1.0, _SHARP * upper))
        reached = True
        for a in range(4):
            for b in range(a + 1):
                for c in range(b + 1):
                    if reached:
                        b0, b1, b2, b3 = v[0, a, b, c], v[1, a, b, c], v[2, a, b, c], v[3, a, b, c]
                        reached = _positive_until(b0, b1, b2, b3, wanted) or _first_root(b0, b1, b2, b3) >= wanted
        if reached or depths[top] == _DEEPEST:
            lower = min(lower, wanted if reached else _smallest_root(v))
            count = top
            continue
        i, j = longest_edge(corners[top])
        copy_elements(v, values[count])
        copy_elements(corners[top], corners[count])
        depths[top] += 1
        depths[count] = depths[top]
        for k in range(4):
            bisect(values[top, k], i, j)
            bisect(values[count, k], j, i)
        bisect_corners(corners[top], i, j)
        bisect_corners(corners[count], j, i)
        count += 1
    return min(lower, 1.0)


@njit(parallel=True, cache=True)
def noninverting_step(x, direction, nodes, guarded, whole, keep):
    """The largest step in [0, 1] over which the determinant of no guarded element falls anywhere below `keep` of its
    value at x.

    Parameters
    ----------
    x, direction : (n, 3) positions and their change over a full step [m]
    nodes : (k, 10) int32; guarded, whole : (k,) bool; keep : in (0, 1)
    whole : where each coefficient of the determinant is kept, which must be positive at x

    Returns
    -------
    step, element : the step, and the first element that allows no more (-1 for a full step)
    """
    m = len(nodes)
    runs = (m + _RUN - 1) // _RUN
    steps = np.ones(runs)
    limiting = np.full(runs, -1, dtype=np.int64)
    for r in prange(runs):
        here, ahead, terms = np.empty((4, 3, 3)), np.empty((4, 3, 3)), np.empty((4, TERMS))
        for e in range(r * _RUN, min(m, (r + 1) * _RUN)):
            if guarded[e]:
                t = _element_step(x, direction, nodes, e, whole[e], keep, here, ahead, terms)
                if t < steps[r]:
                    steps[r] = t
                    limiting[r] = e
    step, element = 1.0, -1
    for r in range(runs):
        if steps[r] < step:
            step, element = steps[r], limiting[r]
    return step, element
