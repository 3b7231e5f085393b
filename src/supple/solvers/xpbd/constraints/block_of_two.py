"""The projection of one stable Neo-Hookean tet: both constraints at once (docs/theory/xpbd.md, "The block of two")."""

from supple.runtime.kernel_cache import njit
from supple.solvers.xpbd.sweeps.groups import FLAGS, WIDTH, nine, put_twelve, twelve


@njit(fastmath=FLAGS, forceinline=True)
def deformation_of(x, b):
    """F and dJ/dF of a tet, 9 entries each by rows, and J; x and b as of `block_of_two`."""
    x0, y0, z0, x1, y1, z1, x2, y2, z2, x3, y3, z3 = x
    b10, b11, b12, b20, b21, b22, b30, b31, b32 = b
    ux, uy, uz = x1 - x0, y1 - y0, z1 - z0
    vx, vy, vz = x2 - x0, y2 - y0, z2 - z0
    qx, qy, qz = x3 - x0, y3 - y0, z3 - z0
    f00, f01, f02 = ux * b10 + vx * b20 + qx * b30, ux * b11 + vx * b21 + qx * b31, ux * b12 + vx * b22 + qx * b32
    f10, f11, f12 = uy * b10 + vy * b20 + qy * b30, uy * b11 + vy * b21 + qy * b31, uy * b12 + vy * b22 + qy * b32
    f20, f21, f22 = uz * b10 + vz * b20 + qz * b30, uz * b11 + vz * b21 + qz * b31, uz * b12 + vz * b22 + qz * b32
    c00, c10, c20 = f11 * f22 - f21 * f12, f21 * f02 - f01 * f22, f01 * f12 - f11 * f02
    c01, c11, c21 = f12 * f20 - f22 * f10, f22 * f00 - f02 * f20, f02 * f10 - f12 * f00
    c02, c12, c22 = f10 * f21 - f20 * f11, f20 * f01 - f00 * f21, f00 * f11 - f10 * f01
    J = f00 * c00 + f10 * c10 + f20 * c20
    return (f00, f01, f02, f10, f11, f12, f20, f21, f22), (c00, c01, c02, c10, c11, c12, c20, c21, c22), J


@njit(fastmath=FLAGS, forceinline=True)
def stress_of_step(f, c, J, material, k, step):
    """The first Piola stress of a step, times V [J]: 9 entries by rows; see `deformation_of` and `block_of_two`."""
    f00, f01, f02, f10, f11, f12, f20, f21, f22 = f
    c00, c01, c02, c10, c11, c12, c20, c21, c22 = c
    mu, lam, rest, _ = material
    n0, n1, n2 = step * k[0], step * k[1], step * k[2]
    slope = (
        n0 * (c00 * c00 + c10 * c10 + c20 * c20)
        + n1 * (c01 * c01 + c11 * c11 + c21 * c21)
        + n2 * (c02 * c02 + c12 * c12 + c22 * c22)
    )
    pressure = lam * (J - rest - mu * J * (n0 + n1 + n2)) / (1.0 + lam * slope)
    s00, s01, s02 = mu * f00 + pressure * c00, mu * f01 + pressure * c01, mu * f02 + pressure * c02
    s10, s11, s12 = mu * f10 + pressure * c10, mu * f11 + pressure * c11, mu * f12 + pressure * c12
    s20, s21, s22 = mu * f20 + pressure * c20, mu * f21 + pressure * c21, mu * f22 + pressure * c22
    return s00, s01, s02, s10, s11, s12, s20, s21, s22


@njit(fastmath=FLAGS, forceinline=True)
def block_of_two(x, w, b, material, k, h2):
    """The corners of a tet after the projection of C_D and C_H.

    Parameters
    ----------
    x : 12 coordinates of the corners [m]; w : their inverse masses [1/kg]
    b : 9 entries of the shape gradients b_1, b_2, b_3 in the tet's principal axes [1/m]
    material : mu V, lam V [J], 1 + mu / lam, and the longest step [s^2]
    k : diagonal of sum w b b^T [1/(kg m^2)]; h2 : square of the length of the substep [s^2]
    """
    step = min(h2, material[3])
    f, c, J = deformation_of(x, b)
    return moved_by_stress(x, w, b, stress_of_step(f, c, J, material, k, step), step)


@njit(fastmath=FLAGS, forceinline=True)
def moved_by_stress(x, w, b, s, step):
    """The corners after the impulses of a stress s, times V, over a step [s^2]; see `stress_of_step`."""
    x0, y0, z0, x1, y1, z1, x2, y2, z2, x3, y3, z3 = x
    w0, w1, w2, w3 = w
    b10, b11, b12, b20, b21, b22, b30, b31, b32 = b
    s00, s01, s02, s10, s11, s12, s20, s21, s22 = s
    # dx_i = -w_i step S b_i, with b_0 = -(b_1 + b_2 + b_3)
    d1x, d1y, d1z = (
        s00 * b10 + s01 * b11 + s02 * b12,
        s10 * b10 + s11 * b11 + s12 * b12,
        s20 * b10 + s21 * b11 + s22 * b12,
    )
    d2x, d2y, d2z = (
        s00 * b20 + s01 * b21 + s02 * b22,
        s10 * b20 + s11 * b21 + s12 * b22,
        s20 * b20 + s21 * b21 + s22 * b22,
    )
    d3x, d3y, d3z = (
        s00 * b30 + s01 * b31 + s02 * b32,
        s10 * b30 + s11 * b31 + s12 * b32,
        s20 * b30 + s21 * b31 + s22 * b32,
    )
    m0, m1, m2, m3 = w0 * step, w1 * step, w2 * step, w3 * step
    return (
        x0 + m0 * (d1x + d2x + d3x),
        y0 + m0 * (d1y + d2y + d3y),
        z0 + m0 * (d1z + d2z + d3z),
        x1 - m1 * d1x,
        y1 - m1 * d1y,
        z1 - m1 * d1z,
        x2 - m2 * d2x,
        y2 - m2 * d2y,
        z2 - m2 * d2z,
        x3 - m3 * d3x,
        y3 - m3 * d3y,
        z3 - m3 * d3z,
    )


@njit(forceinline=True)
def constants_of_tet(data, g, i):
    """The material, the diagonal k and the inverse masses of the tet in lane i of group g, as of `block_of_two`."""
    return (
        (data[g, 9, i], data[g, 10, i], data[g, 11, i], data[g, 12, i]),
        (data[g, 13, i], data[g, 14, i], data[g, 15, i]),
        (data[g, 16, i], data[g, 17, i], data[g, 18, i], data[g, 19, i]),
    )


@njit(fastmath=FLAGS, forceinline=True)
def project_blocks_of_two(X, data, g, h):
    """`block_of_two` of group g, as `Sweep` needs it.

    The rows of `data`: 9 of b, 4 of the material, 3 of k, 4 inverse masses.
    """
    for i in range(WIDTH):
        x = twelve(X, i)
        b = nine(data[g], i)
        material, k, w = constants_of_tet(data, g, i)
        put_twelve(X, i, block_of_two(x, w, b, material, k, h * h))
