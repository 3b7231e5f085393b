"""The Jacobian determinant of a quadratic tetrahedron over the whole element, bounded by Bernstein coefficients.

The derivatives of a quadratic map are linear over the element: they are combinations of their values D^c at the four
corners, with the barycentric coordinates l_c as weights. Their determinant is therefore a cubic,

    det = sum_abc l_a l_b l_c det[D_1^a, D_2^b, D_3^c],

whose 20 Bernstein coefficients are the means of these determinants over the arrangements of the same corners. A cubic
lies between its smallest and its largest coefficient, and takes those of the corners. Where the bounds are not
sharp enough, the element is bisected.

det F of an element with a curved rest shape has the sign of this determinant: the one of the rest shape is positive.

Source: Johnen, Remacle, Geuzaine (2013), "Geometrical validity of curvilinear finite elements".
"""

from __future__ import annotations

import numpy as np

from supple.numerics.mat3 import copy_elements
from supple.numerics.quadratic_shape_functions import BETWEEN
from supple.runtime.kernel_cache import njit, prange

# The coefficient that each arrangement (a, b, c) of corners belongs to; those of the corners come first.
_TRIPLES = sorted({tuple(sorted(t)) for t in np.ndindex(4, 4, 4)}, key=lambda t: (len(set(t)), t))
TERM = np.array([_TRIPLES.index(tuple(sorted(t))) for t in np.ndindex(4, 4, 4)]).reshape(4, 4, 4)
COUNT = np.bincount(TERM.ravel()).astype(np.float64)
TERMS = len(_TRIPLES)

# A bound, with a margin, on the round-off of a coefficient, relative to the product of the lengths of the derivatives.
ROUND_OFF = 2.0**-45

# Twelve bisections make pieces of a sixteenth of the element's size. Where the determinant comes closer to zero than
# the bounds on these pieces show, it counts as zero.
DEEPEST = 12


@njit
def corner_derivatives(x, nodes, e, out):
    """out[c, k, i] = d x_i / d l_k at corner c of element e, k = 1, 2, 3 in the places 0, 1, 2; returns their size, the
    product of the largest lengths of the three."""
    o = nodes[e, 0]
    for c in range(4):
        for i in range(3):
            # By l_0; all coordinates relative to corner 0, for precision.
            if c == 0:
                first = 0.0
            else:
                first = 4.0 * (x[nodes[e, BETWEEN[c, 0]], i] - x[o, i])
            for k in range(1, 4):
                own = x[nodes[e, k], i] - x[o, i]
                if k == c:
                    value = 3.0 * own
                else:
                    value = 4.0 * (x[nodes[e, BETWEEN[c, k]], i] - x[o, i]) - own
                if c == 0:
                    out[c, k - 1, i] = value
                else:
                    out[c, k - 1, i] = value - first
    size = 1.0
    for k in range(3):
        longest = 0.0
        for c in range(4):
            length = abs(out[c, k, 0]) + abs(out[c, k, 1]) + abs(out[c, k, 2])
            if not length <= longest:  # also of NaN
                longest = length
        size *= longest
    return size


@njit
def _triple(A, a, B, b, C, c):
    """det[A_1^a, B_2^b, C_3^c]."""
    return (
        A[a, 0, 0] * (B[b, 1, 1] * C[c, 2, 2] - B[b, 1, 2] * C[c, 2, 1])
        - A[a, 0, 1] * (B[b, 1, 0] * C[c, 2, 2] - B[b, 1, 2] * C[c, 2, 0])
        + A[a, 0, 2] * (B[b, 1, 0] * C[c, 2, 1] - B[b, 1, 1] * C[c, 2, 0])
    )


@njit
def add_coefficients(A, B, C, factor, out):
    """Add `factor` times the coefficients of det[A_1, B_2, C_3], of derivatives (4, 3, 3) at the corners, to out."""
    for a in range(4):
        for b in range(4):
            for c in range(4):
                k = TERM[a, b, c]
                out[k] += factor * _triple(A, a, B, b, C, c) / COUNT[k]


@njit
def longest_edge(corners):
    """The two of the corners (4, 4), barycentric coordinates, that are farthest from each other."""
    first, second, longest = 0, 1, -1.0
    for i in range(4):
        for j in range(i):
            length = 0.0
            for k in range(4):
                d = corners[i, k] - corners[j, k]
                length += d * d
            if length > longest:
                first, second, longest = i, j, length
    return first, second


@njit
def bisect_corners(corners, i, j):
    """Move corner j to the middle of i and j."""
    for k in range(4):
        corners[j, k] = 0.5 * (corners[i, k] + corners[j, k])


@njit
def bisect(values, i, j):
    """The coefficients of a cubic, as a symmetric array (4, 4, 4) over arrangements of corners, after corner j was
    moved to the middle of i and j: de Casteljau's rule."""
    for b in range(4):
        for c in range(4):
            values[j, b, c] = 0.5 * (values[i, b, c] + values[j, b, c])
    for a in range(4):
        for c in range(4):
            values[a, j, c] = 0.5 * (values[a, i, c] + values[a, j, c])
    for a in range(4):
        for b in range(4):
            values[a, b, j] = 0.5 * (values[a, b, i] + values[a, b, j])


@njit
def _all_above(values, least):
    for a in range(4):
        for b in range(4):
            for c in range(4):
                if not values[a, b, c] > least:
                    return False
    return True


@njit
def _is_positive(coefficients, least):
    """Whether the cubic is above `least` on the whole element, as far as `DEEPEST` bisections show."""
    unsure = False
    for k in range(TERMS):
        if not coefficients[k] > least:
            if k < 4:
                return False
            unsure = True
    if not unsure:
        return True
    values = np.empty((DEEPEST + 2, 4, 4, 4))
    corners = np.empty((DEEPEST + 2, 4, 4))
    depths = np.empty(DEEPEST + 2, dtype=np.int64)
    for a in range(4):
        for b in range(4):
            corners[0, a, b] = 1.0 if a == b else 0.0
            for c in range(4):
                values[0, a, b, c] = coefficients[TERM[a, b, c]]
    depths[0] = 0
    count = 1
    while count > 0:
        top = count - 1
        if _all_above(values[top], least):
            count = top
            continue
        for c in range(4):
            if not values[top, c, c, c] > least:
                return False
        if depths[top] == DEEPEST:
            return False
        i, j = longest_edge(corners[top])
        copy_elements(values[top], values[count])
        copy_elements(corners[top], corners[count])
        depths[top] += 1
        depths[count] = depths[top]
        bisect(values[top], i, j)
        bisect_corners(corners[top], i, j)
        bisect(values[count], j, i)
        bisect_corners(corners[count], j, i)
        count += 1
    return True


@njit(cache=True, parallel=True)
def positive_elements(x, nodes, out):
    """Whether each element's determinant is positive everywhere in it: x (n, 3), nodes (k, 10) -> out (k,) bool."""
    for e in prange(len(nodes)):
        derivatives, coefficients = np.empty((4, 3, 3)), np.zeros(TERMS)
        size = corner_derivatives(x, nodes, e, derivatives)
        add_coefficients(derivatives, derivatives, derivatives, 1.0, coefficients)
        out[e] = size < np.inf and _is_positive(coefficients, ROUND_OFF * size)


@njit(cache=True, parallel=True)
def positive_coefficients(x, nodes, out):
    """Whether all coefficients of each element are positive: x (n, 3), nodes (k, 10) -> out (k,) bool."""
    for e in prange(len(nodes)):
        derivatives, coefficients = np.empty((4, 3, 3)), np.zeros(TERMS)
        size = corner_derivatives(x, nodes, e, derivatives)
        add_coefficients(derivatives, derivatives, derivatives, 1.0, coefficients)
        out[e] = size < np.inf and coefficients.min() > ROUND_OFF * size


@njit(cache=True)
def determinant_coefficients(x, nodes):
    """(k, 20) the coefficients of each element's determinant; those of the corners come first.

    Their mean is the mean of the determinant, six times the volume.
    """
    out = np.zeros((len(nodes), TERMS))
    derivatives = np.empty((4, 3, 3))
    for e in range(len(nodes)):
        corner_derivatives(x, nodes, e, derivatives)
        add_coefficients(derivatives, derivatives, derivatives, 1.0, out[e])
    return out
