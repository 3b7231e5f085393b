"""Impulses on four vertices that change neither linear nor angular momentum.

A contact is a relation between two places on surfaces. The vector from the second to the first is r = sum c_i x_i over
four vertices: (1, -u, -v, -w) for a point and a triangle, (1 - s, s, t - 1, -t) for two edges. The coefficients add up
to zero, so that displacements w_i c_i d (w_i: inverse masses) conserve linear momentum for any d.

Angular momentum is sum m x_n x (x - x_n) / h, with lever arms at the beginning of the substep. The impulses c_i d have
the moment r_n x d about every point. It is zero only where d is along r_n: not for friction, nor where the contact has
rotated. A couple on the same four vertices takes this moment away: impulses e_i = th x (x_i - c) with c the mean of the
four positions add up to zero, and their moment is A th with A = sum ((y . y) I - y y^T), y = x_i - c. The couple is
smaller than d by the ratio of |r_n| to the edges' length.
"""

from supple.numerics.kernel_cache import njit
from supple.numerics.mat3 import cross, dot, row, subtract


@njit
def relative(x, vertices, weights, e):
    """sum c_i x_i of contact e [m], from vertices (k, 4) and weights (k, 4)."""
    a, b, c, d = weights[e, 0], weights[e, 1], weights[e, 2], weights[e, 3]
    p, q, r, s = vertices[e, 0], vertices[e, 1], vertices[e, 2], vertices[e, 3]
    return (
        a * x[p, 0] + b * x[q, 0] + c * x[r, 0] + d * x[s, 0],
        a * x[p, 1] + b * x[q, 1] + c * x[r, 1] + d * x[s, 1],
        a * x[p, 2] + b * x[q, 2] + c * x[r, 2] + d * x[s, 2],
    )


@njit
def compliance(inverse_masses, vertices, weights, e):
    """sum w_i c_i^2: the change of r for a unit impulse [1/kg]."""
    total = 0.0
    for i in range(4):
        total += inverse_masses[vertices[e, i]] * weights[e, i] * weights[e, i]
    return total


@njit
def displace(x, inverse_masses, vertices, weights, e, d):
    """x_i += w_i c_i d, with d in kg m."""
    for i in range(4):
        k = vertices[e, i]
        f = inverse_masses[k] * weights[e, i]
        for j in range(3):
            x[k, j] += f * d[j]


@njit
def apply_couple(x, x_prev, inverse_masses, vertices, e, moment):
    """Displace the vertices by a couple of this moment [kg m^2] about positions at the beginning of the substep.

    Nothing moves where a vertex has an infinite mass: what holds it does not keep the momentum either.
    """
    if moment[0] == 0.0 and moment[1] == 0.0 and moment[2] == 0.0:
        return
    cx = cy = cz = 0.0
    for i in range(4):
        k = vertices[e, i]
        if inverse_masses[k] == 0.0:
            return
        cx += 0.25 * x_prev[k, 0]
        cy += 0.25 * x_prev[k, 1]
        cz += 0.25 * x_prev[k, 2]
    center = (cx, cy, cz)
    xx = yy = zz = xy = yz = zx = 0.0
    for i in range(4):
        y = subtract(row(x_prev, vertices[e, i]), center)
        xx += y[0] * y[0]
        yy += y[1] * y[1]
        zz += y[2] * y[2]
        xy += y[0] * y[1]
        yz += y[1] * y[2]
        zx += y[2] * y[0]
    first, second, third = (yy + zz, -xy, -zx), (-xy, zz + xx, -yz), (-zx, -yz, xx + yy)
    # The rows of the adjugate of a symmetric matrix are cross products of its rows.
    a, b, c = cross(second, third), cross(third, first), cross(first, second)
    det = dot(first, a)
    # Four vertices on a line cannot take up every moment.
    if not det > 1e-9 * (xx + yy + zz) ** 3:
        return
    th = (dot(a, moment) / det, dot(b, moment) / det, dot(c, moment) / det)
    for i in range(4):
        k = vertices[e, i]
        d = cross(th, subtract(row(x_prev, k), center))
        for j in range(3):
            x[k, j] += inverse_masses[k] * d[j]


@njit
def apply_impulse(x, x_prev, inverse_masses, vertices, weights, e, d):
    """Displace the vertices of contact e by the impulse d [kg m], with both momenta conserved."""
    displace(x, inverse_masses, vertices, weights, e, d)
    m = cross(relative(x_prev, vertices, weights, e), d)
    apply_couple(x, x_prev, inverse_masses, vertices, e, (-m[0], -m[1], -m[2]))


@njit
def shift_both(x, x_prev, inverse_masses, vertices, weights, e, d):
    """Displace the vertices at both ends of the substep by w_i c_i d: positions change and velocities do not.

    The displaced lever arms change the angular momentum by d x u, where u is the relative motion in the substep; a
    couple takes this away.
    """
    displace(x, inverse_masses, vertices, weights, e, d)
    displace(x_prev, inverse_masses, vertices, weights, e, d)
    u = subtract(relative(x, vertices, weights, e), relative(x_prev, vertices, weights, e))
    m = cross(d, u)
    apply_couple(x, x_prev, inverse_masses, vertices, e, (-m[0], -m[1], -m[2]))
