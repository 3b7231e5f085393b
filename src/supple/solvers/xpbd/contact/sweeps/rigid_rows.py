"""Rows of contact between rigid bodies, reduced to the two bodies: what an impulse moves does not change in a substep.

The points of such a row are on one or two rigid bodies, or nothing moves them. With the sums of the coefficients c_i of
the points on a body, its share C, and of c_i times their arms, its arm A, the relative motion over the substep is

    slip = slip_0 + sum (C u + th x A)

over the bodies, with their twists (u, th), see `movers`. An impulse d displaces a body by w C d and turns it by
J (A - f r_prev) x d: r_prev x d is the moment that `impulses` takes away, f of it from this body. So a sweep needs
neither points nor weights.
"""

from supple.numerics.mat3 import cross, dot, subtract
from supple.runtime.kernel_cache import njit
from supple.solvers.xpbd.contact.sweeps.vertex_rows import set_three, three

# f; the relative place at the beginning of the substep, without the shifts of a pass [m]; slip_0 [m]; how the slip
# changes by a unit push [1/kg]; sum w C^2 1 - [A] J [A], symmetric: xx yy zz xy yz zx [1/kg].
COUPLE, PLACE, SLIP, ANSWER, SOFTNESS = 0, 1, 4, 7, 10
# Of each of two bodies: C, w C, A, A - f r_prev [m], and how a unit push turns it [1/(kg m)].
SHARE, MOBILITY, ARM, LEVER, TURN = 16, 17, 18, 21, 24
PER_BODY, RIGID_COLUMNS = 11, 38


@njit
def _turned(J, b, m):
    """J m of body b."""
    return (
        J[b, 0, 0] * m[0] + J[b, 0, 1] * m[1] + J[b, 0, 2] * m[2],
        J[b, 1, 0] * m[0] + J[b, 1, 1] * m[1] + J[b, 1, 2] * m[2],
        J[b, 2, 0] * m[0] + J[b, 2, 1] * m[1] + J[b, 2, 2] * m[2],
    )


@njit
def join_points(bodies, numbers, movers, vertices, weights):
    """Sum up the points (4,) of a row, where they are rigid or held; returns whether they are on two bodies at most."""
    count, couple = 0, 1.0
    bodies[0] = bodies[1] = -1
    for i in range(4):
        p, c = vertices[i], weights[i]
        b = movers.body[p]
        if b < 0:
            couple = 0.0
            continue
        j = 0
        while j < count and bodies[j] != b:
            j += 1
        if j == 2:
            return False
        count = max(count, j + 1)
        bodies[j] = b
        numbers[PER_BODY * j + SHARE] += c
        for a in range(3):
            numbers[PER_BODY * j + ARM + a] += c * movers.arms[p, a]
        if movers.w[b] == 0.0:
            couple = 0.0
    numbers[COUPLE] = couple if count == 1 else 0.5 * couple
    return True


@njit
def prepare_bodies(bodies, numbers, w, J):
    """Set what remains the same in all passes of a substep, after `join_points`."""
    for k in range(2):
        b, at = bodies[k], PER_BODY * k
        if b < 0:
            continue
        C, A = numbers[at + SHARE], three(numbers, at + ARM)
        numbers[at + MOBILITY] = w[b] * C
        # Columns of -[A] J [A]: (J (A x e)) x A.
        p = cross(_turned(J, b, (0.0, A[2], -A[1])), A)
        q = cross(_turned(J, b, (-A[2], 0.0, A[0])), A)
        r = cross(_turned(J, b, (A[1], -A[0], 0.0)), A)
        for j, s in enumerate((p[0] + w[b] * C * C, q[1] + w[b] * C * C, r[2] + w[b] * C * C, p[1], q[2], r[0])):
            numbers[SOFTNESS + j] += s


@njit
def begin_bodies(numbers, x_prev, vertices, weights):
    """Begin a pass, at the beginning of the substep x_prev (n, 3) without twists [m]."""
    set_three(numbers, PLACE, _combined(x_prev, vertices, weights))


@njit
def _combined(x, vertices, weights):
    at = (0.0, 0.0, 0.0)
    for i in range(4):
        p, c = vertices[i], weights[i]
        at = (at[0] + c * x[p, 0], at[1] + c * x[p, 1], at[2] + c * x[p, 2])
    return at


@njit
def place_of_bodies(bodies, numbers, twists):
    """The relative place at the beginning of the substep, with the shifts of this pass so far [m]."""
    at = three(numbers, PLACE)
    for j in range(2):
        b, c = bodies[j], numbers[PER_BODY * j + SHARE]
        if b >= 0:
            at = (at[0] + c * twists[b, 6], at[1] + c * twists[b, 7], at[2] + c * twists[b, 8])
    return at


@njit
def shift_bodies(bodies, numbers, movers, d):
    """`impulses.shift_both` of the row, by the shift d [kg m]."""
    twists, u = movers.twists, (0.0, 0.0, 0.0)
    for j in range(2):
        b, c = bodies[j], numbers[PER_BODY * j + SHARE]
        if b >= 0:
            f, steps = movers.loose[b] * c, movers.steps
            for a in range(3):
                twists[b, 6 + a] += f * d[a]
            u = (
                u[0] + c * (steps[b, 0] + twists[b, 0]),
                u[1] + c * (steps[b, 1] + twists[b, 1]),
                u[2] + c * (steps[b, 2] + twists[b, 2]),
            )
    f, m = numbers[COUPLE], cross(d, u)
    for j in range(2):
        b = bodies[j]
        if b >= 0:
            turn = _turned(movers.J, b, (f * m[0], f * m[1], f * m[2]))
            for a in range(3):
                twists[b, 3 + a] -= turn[a]


@njit
def begin_sweeps(bodies, numbers, x, before, J, vertices, weights, n):
    """Begin the sweeps of a pass.

    Parameters
    ----------
    x : (n, 3) without twists [m]; before : the relative place, with shifts [m]; J : see `Movers`; n : the normal
    """
    set_three(numbers, SLIP, subtract(_combined(x, vertices, weights), three(numbers, PLACE)))
    f, answer = numbers[COUPLE], (0.0, 0.0, 0.0)
    for j in range(2):
        b, at = bodies[j], PER_BODY * j
        if b < 0:
            continue
        A, w = three(numbers, at + ARM), numbers[at + MOBILITY] * numbers[at + SHARE]
        lever = (A[0] - f * before[0], A[1] - f * before[1], A[2] - f * before[2])
        turn = _turned(J, b, cross(lever, n))
        spun = cross(turn, A)
        answer = (answer[0] + w * n[0] + spun[0], answer[1] + w * n[1] + spun[1], answer[2] + w * n[2] + spun[2])
        set_three(numbers, at + LEVER, lever)
        set_three(numbers, at + TURN, turn)
    set_three(numbers, ANSWER, answer)


@njit
def slip_of_bodies(bodies, numbers, twists):
    """The relative motion over the substep [m]."""
    x, y, z = three(numbers, SLIP)
    for j in range(2):
        b, at = bodies[j], PER_BODY * j
        if b >= 0:
            share = numbers[at + SHARE]
            spun = cross((twists[b, 3], twists[b, 4], twists[b, 5]), three(numbers, at + ARM))
            x += share * twists[b, 0] + spun[0]
            y += share * twists[b, 1] + spun[1]
            z += share * twists[b, 2] + spun[2]
    return (x, y, z)


@njit
def answer_of(numbers):
    """How the slip changes by a unit push [1/kg]."""
    return three(numbers, ANSWER)


@njit
def softness_along(numbers, t):
    """The square of the vector t (3,), times the change of the relative place along it by a unit impulse along it."""
    xx, yy, zz = three(numbers, SOFTNESS)
    xy, yz, zx = three(numbers, SOFTNESS + 3)
    x = xx * t[0] + xy * t[1] + zx * t[2]
    y = xy * t[0] + yy * t[1] + yz * t[2]
    z = zx * t[0] + yz * t[1] + zz * t[2]
    return dot((x, y, z), t)


@njit
def push_bodies(bodies, numbers, twists, J, n, more, d):
    """Move the bodies by the impulse more n + d [kg m], d along the surface."""
    for j in range(2):
        b, at = bodies[j], PER_BODY * j
        if b >= 0:
            f = numbers[at + MOBILITY]
            turn = _turned(J, b, cross(three(numbers, at + LEVER), d))
            for a in range(3):
                twists[b, a] += f * (more * n[a] + d[a])
                twists[b, 3 + a] += more * numbers[at + TURN + a] + turn[a]
