"""Rows of contact that move vertices alone: the impulse d moves them by w_i c_i d and by a couple, see `impulses`.

What the couple turns them by, th = -A^-1 (r_prev x d), is known where a pass begins: positions at the beginning of the
substep only change by the shifts before its sweeps.
"""

from supple.numerics.mat3 import cross, dot, subtract
from supple.runtime.kernel_cache import njit


@njit
def three(numbers, c):
    """The vector that begins at column c."""
    return (numbers[c], numbers[c + 1], numbers[c + 2])


@njit
def set_three(numbers, c, v):
    numbers[c], numbers[c + 1], numbers[c + 2] = v[0], v[1], v[2]


# Of the four points: w_i c_i and w_i [1/kg]; r_prev [m]; y_i [m]; A^-1, symmetric: xx yy zz xy yz zx [1/m^2], or zero.
SHARES, MASSES, PLACE, ARMS, TURN = 0, 4, 8, 11, 23
VERTEX_COLUMNS = 29


@njit
def prepare_vertices(numbers, inverse_masses, vertices, weights):
    """Set what remains the same in all passes of a substep, of the points (4,) of a row."""
    for i in range(4):
        numbers[MASSES + i] = inverse_masses[vertices[i]]
        numbers[SHARES + i] = weights[i] * inverse_masses[vertices[i]]


@njit
def begin_vertices(numbers, x_prev, vertices, weights):
    """Begin the sweeps of a pass at the beginning of the substep x_prev (n, 3) [m]; returns r_prev."""
    place, center, held = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), False
    for i in range(4):
        p, c = vertices[i], weights[i]
        x, y, z = x_prev[p, 0], x_prev[p, 1], x_prev[p, 2]
        place = (place[0] + c * x, place[1] + c * y, place[2] + c * z)
        center = (center[0] + 0.25 * x, center[1] + 0.25 * y, center[2] + 0.25 * z)
        held = held or numbers[MASSES + i] == 0.0
    set_three(numbers, PLACE, place)
    xx = yy = zz = xy = yz = zx = 0.0
    for i in range(4):
        p = vertices[i]
        x, y, z = subtract((x_prev[p, 0], x_prev[p, 1], x_prev[p, 2]), center)
        set_three(numbers, ARMS + 3 * i, (x, y, z))
        xx, yy, zz = xx + y * y + z * z, yy + z * z + x * x, zz + x * x + y * y
        xy, yz, zx = xy - x * y, yz - y * z, zx - z * x
    # The rows of the adjugate of a symmetric matrix are cross products of its rows.
    a = cross((xy, yy, yz), (zx, yz, zz))
    b = cross((zx, yz, zz), (xx, xy, zx))
    c = cross((xx, xy, zx), (xy, yy, yz))
    det = dot((xx, xy, zx), a)
    # Four vertices on a line cannot take up every moment, and what holds one does not keep the momentum either.
    f = 1.0 / det if not held and det > 1e-9 * (0.5 * (xx + yy + zz)) ** 3 else 0.0
    set_three(numbers, TURN, (f * a[0], f * b[1], f * c[2]))
    set_three(numbers, TURN + 3, (f * a[1], f * b[2], f * c[0]))
    return place


@njit
def slip_of_vertices(numbers, x, vertices, weights):
    """The relative motion over the substep, at its end x (n, 3) [m]."""
    slip = three(numbers, PLACE)
    slip = (-slip[0], -slip[1], -slip[2])
    for i in range(4):
        p, c = vertices[i], weights[i]
        slip = (slip[0] + c * x[p, 0], slip[1] + c * x[p, 1], slip[2] + c * x[p, 2])
    return slip


@njit
def push_vertices(numbers, x, vertices, d):
    """Displace the points by the impulse d [kg m], with both momenta conserved."""
    m = cross(d, three(numbers, PLACE))
    xx, yy, zz = three(numbers, TURN)
    xy, yz, zx = three(numbers, TURN + 3)
    th = (xx * m[0] + xy * m[1] + zx * m[2], xy * m[0] + yy * m[1] + yz * m[2], zx * m[0] + yz * m[1] + zz * m[2])
    for i in range(4):
        p, f, w = vertices[i], numbers[SHARES + i], numbers[MASSES + i]
        turned = cross(th, three(numbers, ARMS + 3 * i))
        for j in range(3):
            x[p, j] += f * d[j] + w * turned[j]
