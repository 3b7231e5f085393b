"""Sweeps over stable Neo-Hookean tets: the block of two constraints, and its Kelvin-Voigt damping.

Each row of `data` is a tet: 9 shape gradients b_1, b_2, b_3 in its principal axes, mu V, lam V, 1 + mu/lam, the step
length, 3 curvatures (`constraints_stable_neo_hookean.py`; derivation: docs/xpbd.md, "The block of two").
"""

from supple.numerics.kernel_cache import njit, prange
from supple.xpbd.sweeps.compilation import FLAGS, serial_and_parallel


@njit(fastmath=FLAGS, error_model="numpy", inline="always")
def _edges_times(x, p0, p1, p2, p3, b):
    """F = Ds [b_1, b_2, b_3]^T of a tet with these corners, row by row."""
    b10, b11, b12 = b[0], b[1], b[2]
    b20, b21, b22 = b[3], b[4], b[5]
    b30, b31, b32 = b[6], b[7], b[8]
    ux, uy, uz = x[p1, 0] - x[p0, 0], x[p1, 1] - x[p0, 1], x[p1, 2] - x[p0, 2]
    vx, vy, vz = x[p2, 0] - x[p0, 0], x[p2, 1] - x[p0, 1], x[p2, 2] - x[p0, 2]
    qx, qy, qz = x[p3, 0] - x[p0, 0], x[p3, 1] - x[p0, 1], x[p3, 2] - x[p0, 2]
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


@njit(cache=True, fastmath=FLAGS, error_model="numpy")
def _push(points, p0, p1, p2, p3, b, S, step):
    """dx_i = -w_i step S b_i, with b_0 = -(b_1 + b_2 + b_3), for a stress S, row by row."""
    b10, b11, b12 = b[0], b[1], b[2]
    b20, b21, b22 = b[3], b[4], b[5]
    b30, b31, b32 = b[6], b[7], b[8]
    s00, s01, s02, s10, s11, s12, s20, s21, s22 = S
    x0, y0, z0, w0 = points[p0, 0], points[p0, 1], points[p0, 2], points[p0, 3]
    x1, y1, z1, w1 = points[p1, 0], points[p1, 1], points[p1, 2], points[p1, 3]
    x2, y2, z2, w2 = points[p2, 0], points[p2, 1], points[p2, 2], points[p2, 3]
    x3, y3, z3, w3 = points[p3, 0], points[p3, 1], points[p3, 2], points[p3, 3]
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
    points[p0, 0] = x0 + m0 * (d1x + d2x + d3x)
    points[p0, 1] = y0 + m0 * (d1y + d2y + d3y)
    points[p0, 2] = z0 + m0 * (d1z + d2z + d3z)
    points[p1, 0] = x1 - m1 * d1x
    points[p1, 1] = y1 - m1 * d1y
    points[p1, 2] = z1 - m1 * d1z
    points[p2, 0] = x2 - m2 * d2x
    points[p2, 1] = y2 - m2 * d2y
    points[p2, 2] = z2 - m2 * d2z
    points[p3, 0] = x3 - m3 * d3x
    points[p3, 1] = y3 - m3 * d3y
    points[p3, 2] = z3 - m3 * d3z


@njit(cache=True, fastmath=FLAGS, error_model="numpy")
def _elastic_chunk(points, corners, data, first, last, bounds):
    for s in range(first, last):
        for c in range(bounds[s, 0], bounds[s, 1]):
            p0, p1, p2, p3 = corners[c, 0], corners[c, 1], corners[c, 2], corners[c, 3]
            b = data[c]
            mu, lam, rest = b[9], b[10], b[11]
            step = b[12]
            k0, k1, k2 = b[13], b[14], b[15]

            f00, f01, f02, f10, f11, f12, f20, f21, f22 = _edges_times(points, p0, p1, p2, p3, b)
            # dJ/dF by columns
            c00, c10, c20 = f11 * f22 - f21 * f12, f21 * f02 - f01 * f22, f01 * f12 - f11 * f02
            c01, c11, c21 = f12 * f20 - f22 * f10, f22 * f00 - f02 * f20, f02 * f10 - f12 * f00
            c02, c12, c22 = f10 * f21 - f20 * f11, f20 * f01 - f00 * f21, f00 * f11 - f10 * f01
            J = f00 * c00 + f10 * c10 + f20 * c20

            n0, n1, n2 = step * k0, step * k1, step * k2
            slope = (
                n0 * (c00 * c00 + c10 * c10 + c20 * c20)
                + n1 * (c01 * c01 + c11 * c11 + c21 * c21)
                + n2 * (c02 * c02 + c12 * c12 + c22 * c22)
            )
            pressure = lam * (J - rest - mu * J * (n0 + n1 + n2)) / (1.0 + lam * slope)
            # The first Piola stress of the step, times V
            s00, s01, s02 = mu * f00 + pressure * c00, mu * f01 + pressure * c01, mu * f02 + pressure * c02
            s10, s11, s12 = mu * f10 + pressure * c10, mu * f11 + pressure * c11, mu * f12 + pressure * c12
            s20, s21, s22 = mu * f20 + pressure * c20, mu * f21 + pressure * c21, mu * f22 + pressure * c22

            S = (s00, s01, s02, s10, s11, s12, s20, s21, s22)
            _push(points, p0, p1, p2, p3, b, S, step)


@njit(cache=True, fastmath=FLAGS, error_model="numpy")
def _viscous_chunk(points, previous, corners, data, h, first, last, bounds, gammas, backwards):
    for s in range(last - 1, first - 1, -1) if backwards else range(first, last):
        gamma = 0.5 * gammas[s]  # half in each of the two sweeps
        if gamma == 0.0:
            continue
        low, high = bounds[s, 0], bounds[s, 1]
        for k in range(high - low):
            c = high - 1 - k if backwards else low + k
            p0, p1, p2, p3 = corners[c, 0], corners[c, 1], corners[c, 2], corners[c, 3]
            b = data[c]
            mu, lam = b[9], b[10]
            k0, k1, k2 = b[13], b[14], b[15]

            f00, f01, f02, f10, f11, f12, f20, f21, f22 = _edges_times(points, p0, p1, p2, p3, b)
            g00, g01, g02, g10, g11, g12, g20, g21, g22 = _edges_times(previous, p0, p1, p2, p3, b)
            # Growth of Green's strain over the substep, without its trace: zero in any rigid motion.
            r00 = f00 * f00 + f10 * f10 + f20 * f20
            r11 = f01 * f01 + f11 * f11 + f21 * f21
            r22 = f02 * f02 + f12 * f12 + f22 * f22
            r01 = f00 * f01 + f10 * f11 + f20 * f21
            r02 = f00 * f02 + f10 * f12 + f20 * f22
            r12 = f01 * f02 + f11 * f12 + f21 * f22
            q00 = g00 * g00 + g10 * g10 + g20 * g20
            q11 = g01 * g01 + g11 * g11 + g21 * g21
            q22 = g02 * g02 + g12 * g12 + g22 * g22
            q01 = g00 * g01 + g10 * g11 + g20 * g21
            q02 = g00 * g02 + g10 * g12 + g20 * g22
            q12 = g01 * g02 + g11 * g12 + g21 * g22
            # The length of the viscous step follows the rule of the elastic one (k2 is the largest curvature), divided
            # by the square of the largest stretch, before or after. Row sums are an upper bound of it, and 1 at rest.
            stretched = max(
                max(abs(r00) + abs(r01) + abs(r02), abs(r01) + abs(r11) + abs(r12), abs(r02) + abs(r12) + abs(r22)),
                max(abs(q00) + abs(q01) + abs(q02), abs(q01) + abs(q11) + abs(q12), abs(q02) + abs(q12) + abs(q22)),
            )
            step = min(h * h, 1.0 / (2.0 * mu * gamma * k2 * max(stretched, 1.0)))
            e00, e11, e22 = 0.5 * (r00 - q00), 0.5 * (r11 - q11), 0.5 * (r22 - q22)
            e01, e02, e12 = 0.5 * (r01 - q01), 0.5 * (r02 - q02), 0.5 * (r12 - q12)
            third = (e00 + e11 + e22) / 3.0
            e00, e11, e22 = e00 - third, e11 - third, e22 - third
            shear = 2.0 * mu * gamma
            # The lam of a stitch may be below mu / 3; damping must not add energy there either.
            bulk = max(lam - mu / 3.0, 0.0) * gamma
            c00, c10, c20 = f11 * f22 - f21 * f12, f21 * f02 - f01 * f22, f01 * f12 - f11 * f02
            c01, c11, c21 = f12 * f20 - f22 * f10, f22 * f00 - f02 * f20, f02 * f10 - f12 * f00
            c02, c12, c22 = f10 * f21 - f20 * f11, f20 * f01 - f00 * f21, f00 * f11 - f10 * f01
            J = f00 * c00 + f10 * c10 + f20 * c20
            J_before = g00 * (g11 * g22 - g21 * g12) + g10 * (g21 * g02 - g01 * g22) + g20 * (g01 * g12 - g11 * g02)
            n0, n1, n2 = step * k0, step * k1, step * k2
            t00, t01, t02 = (
                shear * (f00 * e00 + f01 * e01 + f02 * e02),
                shear * (f00 * e01 + f01 * e11 + f02 * e12),
                shear * (f00 * e02 + f01 * e12 + f02 * e22),
            )
            t10, t11, t12 = (
                shear * (f10 * e00 + f11 * e01 + f12 * e02),
                shear * (f10 * e01 + f11 * e11 + f12 * e12),
                shear * (f10 * e02 + f11 * e12 + f12 * e22),
            )
            t20, t21, t22 = (
                shear * (f20 * e00 + f21 * e01 + f22 * e02),
                shear * (f20 * e01 + f21 * e11 + f22 * e12),
                shear * (f20 * e02 + f21 * e12 + f22 * e22),
            )
            slope = (
                n0 * (c00 * c00 + c10 * c10 + c20 * c20)
                + n1 * (c01 * c01 + c11 * c11 + c21 * c21)
                + n2 * (c02 * c02 + c12 * c12 + c22 * c22)
            )
            sheared = (
                n0 * (c00 * t00 + c10 * t10 + c20 * t20)
                + n1 * (c01 * t01 + c11 * t11 + c21 * t21)
                + n2 * (c02 * t02 + c12 * t12 + c22 * t22)
            )
            pressure = bulk * (J - J_before - sheared) / (1.0 + bulk * slope)
            s00, s01, s02 = t00 + pressure * c00, t01 + pressure * c01, t02 + pressure * c02
            s10, s11, s12 = t10 + pressure * c10, t11 + pressure * c11, t12 + pressure * c12
            s20, s21, s22 = t20 + pressure * c20, t21 + pressure * c21, t22 + pressure * c22

            S = (s00, s01, s02, s10, s11, s12, s20, s21, s22)
            _push(points, p0, p1, p2, p3, b, S, step)


@serial_and_parallel
def sweep_elastic(points, corners, data, pointers, bounds):
    """Project the even chunks, then the odd ones."""
    n_chunks = len(pointers) - 1
    for parity in range(2):
        for k in prange((n_chunks + 1 - parity) // 2):
            c = 2 * k + parity
            _elastic_chunk(points, corners, data, pointers[c], pointers[c + 1], bounds)


@serial_and_parallel
def sweep_viscous(points, previous, corners, data, h, pointers, bounds, gammas):
    """Damp the even chunks, the odd ones, then both backward."""
    n_chunks = len(pointers) - 1
    for turn in range(4):
        parity = 0 if turn == 0 or turn == 3 else 1
        for k in prange((n_chunks + 1 - parity) // 2):
            c = 2 * k + parity
            first, last = pointers[c], pointers[c + 1]
            _viscous_chunk(points, previous, corners, data, h, first, last, bounds, gammas, turn >= 2)
