"""The Hessian of an energy E(d) of the distance d of one pair, in closed form.

With n = r / d, the coefficients c and the modes (q_k, D_k) of `pair_geometry.tangent_modes`, let

    alpha = c (x) n,   beta_k = c (x) q_k,   delta_k = D_k (x) n.

A second-order expansion of the least distance over the free parameters gives

    H = E'' alpha alpha^T + sum_k (s00 beta beta^T + s01 (beta delta^T + delta beta^T) + s11 delta delta^T)

with s00, s01, s11 = 0, -E', -E' d for a mode with a parameter and E' / d, 0, 0 for one without. The vectors of
different modes are perpendicular, so that each mode is a matrix of two rows whose eigenvalues are known. Where
D_k . c = 0, they are the eigenvalues of H; the projected Hessian leaves the negative ones of each mode out. It is
positive semi-definite, and larger than H by a positive semi-definite matrix. The points of a plane are never free, and
the rest of its matrix is positive semi-definite as it is.
"""

import math

from supple.contact.features.pair_geometry import VERTEX_PLANE, point_count, tangent_modes
from supple.runtime.kernel_cache import njit


@njit
def mode_matrix(slope, d, cc, w, project):
    """s00, s01, s11 of one mode (see the module).

    Parameters
    ----------
    slope : E'; d : distance; cc : c . c; w : D_k . D_k, 0 for a mode without a parameter
    """
    if w == 0.0:
        return (max(0.0, slope / d) if project else slope / d), 0.0, 0.0
    if not project:
        return 0.0, -slope, -slope * d
    # In the basis of the unit vectors of beta and delta, of lengths |c| and sqrt(w), the matrix is
    # (-E' / d) ((0, |c| g), (|c| g, g^2)) with g = d sqrt(w). Its positive eigenvalue, -sqrt(w) E' x,
    # belongs to (|c|, x).
    root = math.sqrt(w)
    g = d * root
    x = 0.5 * (g + math.sqrt(g * g + 4.0 * cc))
    if slope > 0.0:  # of a pair that attracts it is the other one
        x = -cc / x
    s00 = -slope * root * x / (cc + x * x)
    ratio = x / root
    return s00, s00 * ratio, s00 * ratio * ratio


@njit
def write_pair_hessian(kind, c, r, d, points, slopes, project, out, first):
    """Write the blocks (i, j), i <= j, of the Hessian, row after row, into out[first:] (t, 3, 3).

    Parameters
    ----------
    kind, c, r : of the pair (see `pair_geometry`); d : |r|
    points : its four points; those that the kind does not have are ignored
    slopes : E', E''
    """
    n = (r[0] / d, r[1] / d, r[2] / d)
    slope, curvature = slopes[0], max(0.0, slopes[1]) if project else slopes[1]
    cc = c[0] * c[0] + c[1] * c[1] + c[2] * c[2] + c[3] * c[3]
    p, D, w, q, F, v = tangent_modes(kind, n, points[0], points[1], points[2], points[3])
    project = project and kind != VERTEX_PLANE
    s00, s01, s11 = mode_matrix(slope, d, cc, w, project)
    t00, t01, t11 = mode_matrix(slope, d, cc, v, project)
    count = point_count(kind)
    b = first
    for i in range(count):
        for j in range(i, count):
            cij = c[i] * c[j]
            nn = curvature * cij + s11 * D[i] * D[j] + t11 * F[i] * F[j]
            pp, pn, op = s00 * cij, s01 * c[i] * D[j], s01 * D[i] * c[j]
            qq, qn, nq = t00 * cij, t01 * c[i] * F[j], t01 * F[i] * c[j]
            for x in range(3):
                along_n = nn * n[x] + pn * p[x] + qn * q[x]
                along_p, along_q = op * n[x] + pp * p[x], nq * n[x] + qq * q[x]
                for y in range(3):
                    out[b, x, y] = along_n * n[y] + along_p * p[y] + along_q * q[y]
            if i == j:  # symmetric to the last bit
                out[b, 1, 0], out[b, 2, 0], out[b, 2, 1] = out[b, 0, 1], out[b, 0, 2], out[b, 1, 2]
            b += 1
    return b
