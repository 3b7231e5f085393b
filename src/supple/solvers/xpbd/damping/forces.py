"""Viscous forces of single tetrahedra and springs, per unit of velocity.

Both are linear in the velocity, symmetric and positive semi-definite, and zero in a rigid motion about the given
positions. With v = (x - x_n) / h and the positions (x + x_n) / 2 they are zero in a rigid rotation of any size, because
F_m^T (F - F_n) + (F - F_n)^T F_m = F^T F - F_n^T F_n.
"""

from __future__ import annotations

from supple.runtime.kernel_cache import njit
from supple.solvers.xpbd.sweeps.groups import FLAGS, WIDTH, nine, put_nine, put_twelve, twelve


@njit(fastmath=FLAGS, forceinline=True)
def _gradient(x, b):
    """The 9 entries of sum_i x_i b_i^T, of 12 coordinates x and the shape gradients b_1, b_2, b_3."""
    x0, y0, z0, x1, y1, z1, x2, y2, z2, x3, y3, z3 = x
    b10, b11, b12, b20, b21, b22, b30, b31, b32 = b
    ux, uy, uz = x1 - x0, y1 - y0, z1 - z0
    vx, vy, vz = x2 - x0, y2 - y0, z2 - z0
    qx, qy, qz = x3 - x0, y3 - y0, z3 - z0
    return (
        ux * b10 + vx * b20 + qx * b30,
        ux * b11 + vx * b21 + qx * b31,
        ux * b12 + vx * b22 + qx * b32,
        uy * b10 + vy * b20 + qy * b30,
        uy * b11 + vy * b21 + qy * b31,
        uy * b12 + vy * b22 + qy * b32,
        uz * b10 + vz * b20 + qz * b30,
        uz * b11 + vz * b21 + qz * b31,
        uz * b12 + vz * b22 + qz * b32,
    )


@njit(fastmath=FLAGS, forceinline=True)
def _cofactors(F):
    """dJ/dF, row by row."""
    f00, f01, f02, f10, f11, f12, f20, f21, f22 = F
    return (
        f11 * f22 - f21 * f12,
        f12 * f20 - f22 * f10,
        f10 * f21 - f20 * f11,
        f21 * f02 - f01 * f22,
        f22 * f00 - f02 * f20,
        f20 * f01 - f00 * f21,
        f01 * f12 - f11 * f02,
        f02 * f10 - f12 * f00,
        f00 * f11 - f10 * f01,
    )


@njit(fastmath=FLAGS, forceinline=True)
def _rates(F, G, C):
    """D = sym(F^T F') as 00, 11, 22 and twice 01, 02, 12, and J' = dJ/dF : F', with G = F' and C = dJ/dF."""
    f00, f01, f02, f10, f11, f12, f20, f21, f22 = F
    g00, g01, g02, g10, g11, g12, g20, g21, g22 = G
    c00, c01, c02, c10, c11, c12, c20, c21, c22 = C
    return (
        f00 * g00 + f10 * g10 + f20 * g20,
        f01 * g01 + f11 * g11 + f21 * g21,
        f02 * g02 + f12 * g12 + f22 * g22,
        f00 * g01 + f10 * g11 + f20 * g21 + f01 * g00 + f11 * g10 + f21 * g20,
        f00 * g02 + f10 * g12 + f20 * g22 + f02 * g00 + f12 * g10 + f22 * g20,
        f01 * g02 + f11 * g12 + f21 * g22 + f02 * g01 + f12 * g11 + f22 * g21,
        (c00 * g00 + c10 * g10 + c20 * g20) + (c01 * g01 + c11 * g11 + c21 * g21) + (c02 * g02 + c12 * g12 + c22 * g22),
    )


@njit(fastmath=FLAGS, forceinline=True)
def viscous_power_of_tet(x, v, b, shear, bulk):
    """Forces times velocities of `viscous_tet` [W]: 2 shear |dev D|^2 + bulk (dJ/dF : F')^2."""
    F = _gradient(x, b)
    d00, d11, d22, d01, d02, d12, rate = _rates(F, _gradient(v, b), _cofactors(F))
    third = (d00 + d11 + d22) / 3.0
    d00, d11, d22 = d00 - third, d11 - third, d22 - third
    squares = 2.0 * (d00 * d00 + d11 * d11 + d22 * d22) + d01 * d01 + d02 * d02 + d12 * d12
    return shear * squares + bulk * (rate * rate)


@njit(fastmath=FLAGS, forceinline=True)
def viscous_tet(x, v, b, shear, bulk):
    """The forces (12) that balance the viscous stress of a tet, means of the diagonal entries (4) of
    their matrix [kg/s], and the square of the rates of the stretches [1/s^2].

    With D = sym(F^T F') they are the gradient of shear |dev D|^2 + bulk / 2 (dJ/dF : F')^2.

    Parameters
    ----------
    x, v : 12 coordinates of the corners [m], and of their velocities [m/s]
    b : 9 entries of the shape gradients b_1, b_2, b_3 [1/m]; shear, bulk : viscosity times volume [J s]
    """
    b10, b11, b12, b20, b21, b22, b30, b31, b32 = b
    F = _gradient(x, b)
    C = _cofactors(F)
    f00, f01, f02, f10, f11, f12, f20, f21, f22 = F
    c00, c01, c02, c10, c11, c12, c20, c21, c22 = C
    d00, d11, d22, d01, d02, d12, p = _rates(F, _gradient(v, b), C)
    rate = d00 * d00 + d11 * d11 + d22 * d22
    # 2 shear dev D
    third = (d00 + d11 + d22) / 3.0
    twice = 2.0 * shear
    d00, d11, d22 = twice * (d00 - third), twice * (d11 - third), twice * (d22 - third)
    d01, d02, d12 = shear * d01, shear * d02, shear * d12
    p = bulk * p
    s00 = f00 * d00 + f01 * d01 + f02 * d02 + p * c00
    s01 = f00 * d01 + f01 * d11 + f02 * d12 + p * c01
    s02 = f00 * d02 + f01 * d12 + f02 * d22 + p * c02
    s10 = f10 * d00 + f11 * d01 + f12 * d02 + p * c10
    s11 = f10 * d01 + f11 * d11 + f12 * d12 + p * c11
    s12 = f10 * d02 + f11 * d12 + f12 * d22 + p * c12
    s20 = f20 * d00 + f21 * d01 + f22 * d02 + p * c20
    s21 = f20 * d01 + f21 * d11 + f22 * d12 + p * c21
    s22 = f20 * d02 + f21 * d12 + f22 * d22 + p * c22
    h1x, h1y, h1z = (
        s00 * b10 + s01 * b11 + s02 * b12,
        s10 * b10 + s11 * b11 + s12 * b12,
        s20 * b10 + s21 * b11 + s22 * b12,
    )
    h2x, h2y, h2z = (
        s00 * b20 + s01 * b21 + s02 * b22,
        s10 * b20 + s11 * b21 + s12 * b22,
        s20 * b20 + s21 * b21 + s22 * b22,
    )
    h3x, h3y, h3z = (
        s00 * b30 + s01 * b31 + s02 * b32,
        s10 * b30 + s11 * b31 + s12 * b32,
        s20 * b30 + s21 * b31 + s22 * b32,
    )
    # A third of the traces of the diagonal blocks, shear (|F|^2 |b|^2 + |F b|^2 / 3) + bulk |dJ/dF b|^2, with the means
    # of |F b|^2 and |dJ/dF b|^2 over all directions of b.
    square = f00 * f00 + f01 * f01 + f02 * f02 + f10 * f10 + f11 * f11 + f12 * f12 + f20 * f20 + f21 * f21 + f22 * f22
    area = c00 * c00 + c01 * c01 + c02 * c02 + c10 * c10 + c11 * c11 + c12 * c12 + c20 * c20 + c21 * c21 + c22 * c22
    mean = shear * square * (10.0 / 27.0) + bulk * area / 9.0
    b00, b01, b02 = b10 + b20 + b30, b11 + b21 + b31, b12 + b22 + b32
    d0 = mean * (b00 * b00 + b01 * b01 + b02 * b02)
    d1 = mean * (b10 * b10 + b11 * b11 + b12 * b12)
    d2 = mean * (b20 * b20 + b21 * b21 + b22 * b22)
    d3 = mean * (b30 * b30 + b31 * b31 + b32 * b32)
    return (
        -(h1x + h2x + h3x),
        -(h1y + h2y + h3y),
        -(h1z + h2z + h3z),
        h1x,
        h1y,
        h1z,
        h2x,
        h2y,
        h2z,
        h3x,
        h3y,
        h3z,
        d0,
        d1,
        d2,
        d3,
        rate,
    )


@njit(fastmath=FLAGS, forceinline=True)
def _length_and_rate(x, v, t):
    """Of a spring from a vertex to the place t of an edge: d (3), d . d' and d . d; see `viscous_spring`."""
    x0, y0, z0, x1, y1, z1, x2, y2, z2 = x
    s = 1.0 - t
    dx, dy, dz = x0 - s * x1 - t * x2, y0 - s * y1 - t * y2, z0 - s * z1 - t * z2
    x0, y0, z0, x1, y1, z1, x2, y2, z2 = v
    ex, ey, ez = x0 - s * x1 - t * x2, y0 - s * y1 - t * y2, z0 - s * z1 - t * z2
    squared = dx * dx + dy * dy + dz * dz
    return (dx, dy, dz), dx * ex + dy * ey + dz * ez, squared


@njit(fastmath=FLAGS, forceinline=True)
def viscous_spring(x, v, t, viscosity):
    """The forces (9) of a spring from a vertex to the place t of an edge, mean diagonal entries (3) of the matrix,
    and the square of the rate of its length [1/s^2].

    They are the gradient of viscosity / 2 (d . d' / |d|)^2, with d = x_0 - (1 - t) x_1 - t x_2.

    Parameters
    ----------
    x, v : 9 coordinates [m] and velocities [m/s]; t : place on the edge; viscosity : [kg/s]
    """
    (dx, dy, dz), product, squared = _length_and_rate(x, v, t)
    s = 1.0 - t
    # Coinciding ends have no direction.
    f = viscosity * product / squared if squared > 0.0 else 0.0
    fx, fy, fz = f * dx, f * dy, f * dz
    third = viscosity / 3.0
    rate = product / squared if squared > 0.0 else 0.0
    return (
        fx,
        fy,
        fz,
        -s * fx,
        -s * fy,
        -s * fz,
        -t * fx,
        -t * fy,
        -t * fz,
        third,
        s * s * third,
        t * t * third,
        rate * rate,
    )


@njit(fastmath=FLAGS, forceinline=True)
def viscous_power_of_spring(x, v, t, viscosity):
    """Forces times velocities of `viscous_spring` [W]: viscosity (d . d' / |d|)^2."""
    _, product, squared = _length_and_rate(x, v, t)
    return viscosity * product * product / squared if squared > 0.0 else 0.0


@njit(fastmath=FLAGS, forceinline=True)
def softened(stiffness, slope, h):
    """The part of a stiffness whose rates substeps of h [s] do not suppress; see `elements`."""
    factor = 1.0 + h * h * stiffness * slope
    return stiffness / (factor * factor)


@njit(fastmath=FLAGS, forceinline=True)
def forces_of_tets(X, V, k, data, g, h):
    """`viscous_tet` of group g in the columns of X and V, which then holds the forces, and of k for the rest.

    The rows of `data`: 9 of b, mu V, bulk modulus times V, its slope, tau. XPBD itself damps like tau = h.
    """
    for i in range(WIDTH):
        x = twelve(X, i)
        v = twelve(V, i)
        b = nine(data[g], i)
        tau = max(data[g, 12, i] - h, 0.0)
        f = viscous_tet(x, v, b, tau * data[g, 9, i], tau * softened(data[g, 10, i], data[g, 11, i], h))
        put_twelve(V, i, f)
        k[0, i], k[1, i], k[2, i], k[3, i], k[4, i] = f[12], f[13], f[14], f[15], f[16]


@njit(fastmath=FLAGS, forceinline=True)
def forces_of_springs(X, V, k, data, g, h):
    """`viscous_spring` in the same way. The rows of `data`: t, stiffness, slope, tau."""
    for i in range(WIDTH):
        x = nine(X, i)
        v = nine(V, i)
        tau = max(data[g, 3, i] - h, 0.0)
        f = viscous_spring(x, v, data[g, 0, i], tau * softened(data[g, 1, i], data[g, 2, i], h))
        put_nine(V, i, f)
        k[0, i], k[1, i], k[2, i], k[3, i] = f[9], f[10], f[11], f[12]


@njit(fastmath=FLAGS, forceinline=True)
def powers_of_tets(X, V, k, data, g, h):
    """`viscous_power_of_tet` of group g in the first row of k."""
    for i in range(WIDTH):
        tau = max(data[g, 12, i] - h, 0.0)
        bulk = tau * softened(data[g, 10, i], data[g, 11, i], h)
        k[0, i] = viscous_power_of_tet(twelve(X, i), twelve(V, i), nine(data[g], i), tau * data[g, 9, i], bulk)


@njit(fastmath=FLAGS, forceinline=True)
def powers_of_springs(X, V, k, data, g, h):
    """`viscous_power_of_spring` in the same way."""
    for i in range(WIDTH):
        tau = max(data[g, 3, i] - h, 0.0)
        viscosity = tau * softened(data[g, 1, i], data[g, 2, i], h)
        k[0, i] = viscous_power_of_spring(nine(X, i), nine(V, i), data[g, 0, i], viscosity)
