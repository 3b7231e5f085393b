"""Impulses on four points that change neither linear nor angular momentum.

A contact is a relation between two places on surfaces. The vector from the second to the first is r = sum c_i x_i over
four points: (1, -u, -v, -w) for a point and a triangle, (1 - s, s, t - 1, -t) for two edges. The coefficients add up to
zero, so that impulses c_i d conserve linear momentum for any d. A point moves a vertex by w_i c_i d (w_i: inverse
masses), or the rigid body that it is on (see `movers`).

Angular momentum is sum m x_n x (x - x_n) / h, with lever arms at the beginning of the substep. The impulses c_i d have
the moment r_n x d about every point. It is zero only where d is along r_n: not for friction, nor where the contact has
rotated. Where one of the points is on a rigid body, this moment is taken away by a rotation of that body, half by each
of two. Otherwise a couple on the same four vertices takes it away: impulses e_i = th x (x_i - c) with c the mean of the
four positions add up to zero, and their moment is A th with A = sum ((y . y) I - y y^T), y = x_i - c. The couple is
smaller than d by the ratio of |r_n| to the edges' length.
"""

from supple.numerics.mat3 import cross, dot, row, subtract
from supple.runtime.kernel_cache import njit
from supple.solvers.xpbd.contact.movers import place, place_before, push_body, softness, turn_body
from supple.solvers.xpbd.rigid.motion import inertia_of


@njit
def _combined(weights, e, p, q, r, s):
    a, b, c, d = weights[e, 0], weights[e, 1], weights[e, 2], weights[e, 3]
    return (
        a * p[0] + b * q[0] + c * r[0] + d * s[0],
        a * p[1] + b * q[1] + c * r[1] + d * s[1],
        a * p[2] + b * q[2] + c * r[2] + d * s[2],
    )


@njit
def difference(x, vertices, weights, e):
    """sum c_i x_i of contact e at places x (n, 3) [m], from points (k, 4) and weights (k, 4)."""
    p, q, r, s = vertices[e, 0], vertices[e, 1], vertices[e, 2], vertices[e, 3]
    return _combined(weights, e, row(x, p), row(x, q), row(x, r), row(x, s))


@njit
def relative(x, movers, vertices, weights, e):
    """sum c_i x_i of contact e at the end of the substep, of places x (n, 3) without the motions of bodies [m]."""
    p, q, r, s = vertices[e, 0], vertices[e, 1], vertices[e, 2], vertices[e, 3]
    return _combined(weights, e, place(x, movers, p), place(x, movers, q), place(x, movers, r), place(x, movers, s))


@njit
def relative_before(x, movers, vertices, weights, e):
    """The same of places x (n, 3) at the beginning of the substep."""
    p, q, r, s = vertices[e, 0], vertices[e, 1], vertices[e, 2], vertices[e, 3]
    return _combined(
        weights,
        e,
        place_before(x, movers, p),
        place_before(x, movers, q),
        place_before(x, movers, r),
        place_before(x, movers, s),
    )


@njit
def is_rigid(movers, vertices, e):
    """Whether a point of contact e is on a rigid body."""
    found = False
    for i in range(4):
        found = found or movers.body[vertices[e, i]] >= 0
    return found


@njit
def _on_body(movers, vertices, weights, e, i):
    """The body of the i-th point where that is the first one on it, or -1; the sums of c and of c times the arm."""
    b = movers.body[vertices[e, i]]
    share, x, y, z = 0.0, 0.0, 0.0, 0.0
    if b >= 0:
        for j in range(4):
            k = vertices[e, j]
            if movers.body[k] != b:
                continue
            if j < i:
                return -1, 0.0, (0.0, 0.0, 0.0)
            c = weights[e, j]
            share += c
            x += c * movers.arms[k, 0]
            y += c * movers.arms[k, 1]
            z += c * movers.arms[k, 2]
    return b, share, (x, y, z)


@njit
def compliance(movers, vertices, weights, e, n):
    """The change of r along the unit vector n for a unit impulse along it [1/kg]; of vertices alone, sum w_i c_i^2."""
    total = 0.0
    for i in range(4):
        k = vertices[e, i]
        if movers.body[k] < 0:
            total += movers.inverse_masses[k] * weights[e, i] * weights[e, i]
            continue
        b, share, arm = _on_body(movers, vertices, weights, e, i)
        if b >= 0:
            total += softness(movers, b, share, cross(arm, n))
    return total


@njit
def shift_compliance(movers, vertices, weights, e):
    """The change of r for a unit shift, where rigid bodies do not turn [1/kg]."""
    total = 0.0
    for i in range(4):
        k = vertices[e, i]
        if movers.body[k] < 0:
            total += movers.inverse_masses[k] * weights[e, i] * weights[e, i]
            continue
        b, share, _ = _on_body(movers, vertices, weights, e, i)
        if b >= 0:
            total += movers.loose[b] * share * share
    return total


@njit
def displace(x, inverse_masses, vertices, weights, e, d):
    """x_i += w_i c_i d, with d in kg m, of the points that are vertices."""
    for i in range(4):
        k = vertices[e, i]
        f = inverse_masses[k] * weights[e, i]
        for j in range(3):
            x[k, j] += f * d[j]


@njit
def apply_couple(x, x_prev, movers, vertices, e, moment):
    """Move the points by a couple of this moment [kg m^2] about positions at the beginning of the substep.

    Nothing moves where a vertex has an infinite mass: what holds it does not keep the momentum either.
    """
    if moment[0] == 0.0 and moment[1] == 0.0 and moment[2] == 0.0:
        return
    first, last = -1, -1
    for i in range(4):
        k = vertices[e, i]
        b = movers.body[k]
        if b < 0:
            if movers.inverse_masses[k] == 0.0:
                return
        elif movers.w[b] == 0.0:
            return
        else:
            first, last = (b, b) if first < 0 else (first, b)
    if first >= 0:
        f = 1.0 if first == last else 0.5
        moment = (f * moment[0], f * moment[1], f * moment[2])
        turn_body(movers, first, moment)
        if first != last:
            turn_body(movers, last, moment)
        return
    _apply_couple_to_vertices(x, x_prev, movers.inverse_masses, vertices, e, moment)


@njit
def _apply_couple_to_vertices(x, x_prev, inverse_masses, vertices, e, moment):
    center, S = inertia_of(x_prev, vertices, e)
    first, second, third = (S[0], S[3], S[5]), (S[3], S[1], S[4]), (S[5], S[4], S[2])
    # The rows of the adjugate of a symmetric matrix are cross products of its rows.
    a, b, c = cross(second, third), cross(third, first), cross(first, second)
    det = dot(first, a)
    # Four vertices on a line cannot take up every moment.
    if not det > 1e-9 * (0.5 * (S[0] + S[1] + S[2])) ** 3:
        return
    th = (dot(a, moment) / det, dot(b, moment) / det, dot(c, moment) / det)
    for i in range(4):
        k = vertices[e, i]
        d = cross(th, subtract(row(x_prev, k), center))
        for j in range(3):
            x[k, j] += inverse_masses[k] * d[j]


@njit
def apply_impulse(x, x_prev, movers, vertices, weights, e, d):
    """Displace the points of contact e by the impulse d [kg m], with both momenta conserved."""
    displace(x, movers.inverse_masses, vertices, weights, e, d)
    for i in range(4):
        if movers.body[vertices[e, i]] >= 0:
            c = weights[e, i]
            push_body(movers, vertices[e, i], (c * d[0], c * d[1], c * d[2]))
    m = cross(relative_before(x_prev, movers, vertices, weights, e), d)
    apply_couple(x, x_prev, movers, vertices, e, (-m[0], -m[1], -m[2]))


@njit
def shift_both(x, x_prev, predicted, movers, vertices, weights, e, d):
    """Displace the points at both ends of the substep by w_i c_i d: positions change and velocities do not.

    Rigid bodies are shifted without a rotation. The displaced lever arms change the angular momentum by d x u, where u
    is the relative motion in the substep, of rigid bodies that of their centers; a couple takes this away.
    """
    for each in (x, x_prev, predicted):
        displace(each, movers.inverse_masses, vertices, weights, e, d)
    u = (0.0, 0.0, 0.0)
    for i in range(4):
        k = vertices[e, i]
        b, c = movers.body[k], weights[e, i]
        if b < 0:
            step = subtract(row(x, k), row(x_prev, k))
        else:
            f = movers.loose[b] * c
            for j in range(3):
                movers.twists[b, 6 + j] += f * d[j]
            step = (
                movers.steps[b, 0] + movers.twists[b, 0],
                movers.steps[b, 1] + movers.twists[b, 1],
                movers.steps[b, 2] + movers.twists[b, 2],
            )
        u = (u[0] + c * step[0], u[1] + c * step[1], u[2] + c * step[2])
    m = cross(d, u)
    apply_couple(x, x_prev, movers, vertices, e, (-m[0], -m[1], -m[2]))
