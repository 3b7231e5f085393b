"""The stable Neo-Hookean constraint set: C_D = sqrt(tr F^T F), C_H = J - (1 + mu / lam), of each tet together.

With alpha_D = 1 / (mu V), alpha_H = 1 / (lam V) their energy is V (mu/2 Ic + lam/2 (J - 1 - mu/lam)^2): that of
`StableNeoHookean`, up to a constant. Neither constraint is zero at rest, only the sum of their forces is; taking one
after the other leaves a residual that depends on the substep and makes the body too soft. Here both are taken in one
step, which is exactly zero at rest (derivation: docs/xpbd.md, "The block of two").

Source of the constraints: Macklin and Müller, "A Constraint-based Formulation of Stable Neo-Hookean Materials" (2021).
"""

from __future__ import annotations

import logging
from typing import cast

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from supple.materials.material import Elastic
from supple.system import BodyRange, System
from supple.xpbd.ordering import Layout
from supple.xpbd.segments import Segments, gather, sort_into_segments

logger = logging.getLogger(__name__)

# No flag that assumes finite numbers (NaN must be seen) and none that reorders sums (same bits for any thread count).
FLAGS = {"contract", "arcp", "nsz"}


class BlocksOfTwo:
    """Both constraints of any tetrahedra, in an order that is given.

    Parameters
    ----------
    tets : (m, 4); Dm_inv : (m, 3, 3) [1/m]; volumes : (m,) at rest [m^3]
    moduli : mu and lam, (m,) each, as they stand in the energy density, above zero [Pa]
    inverse_masses : of all vertices [1/kg]
    segments : the order of the tets; damping : Kelvin-Voigt time of each of its kinds [s]
    """

    called = "stable Neo-Hookean tets"

    def __init__(
        self,
        tets: tuple[NDArray, NDArray, NDArray],
        moduli: tuple[NDArray, NDArray],
        inverse_masses: NDArray[np.float64],
        segments: Segments,
        damping: NDArray[np.float64],
    ) -> None:
        order = segments.order
        (corners, Dm_inv, V), (mu, lam) = (tuple(values[order] for values in some) for some in (tets, moduli))
        self.segments = segments
        self.corners = np.ascontiguousarray(corners, dtype=np.uint32)
        self.count = len(order)
        # A sweep takes about three times as long for one of these tets as for an edge or a volume.
        self.work = 3 * self.count
        gradients, self.curvatures = _principal_axes(Dm_inv, inverse_masses[corners])
        # The columns of `data`: 9 shape gradients, mu V, lam V, 1 + mu/lam, step length, 3 curvatures: two cache lines.
        self.data = np.empty((self.count, 16))
        self.data[:, :9] = gradients.reshape(-1, 9)
        self.data[:, 9] = mu * V
        self.data[:, 10] = lam * V
        self.data[:, 11] = 1.0 + mu / lam
        self.data[:, 13:16] = self.curvatures
        self.damping = damping
        self.damped = bool(damping.any())
        self._prepared_for = 0.0

    def project(self, points: NDArray[np.float64], h: float, parallel: bool) -> None:
        """See `ConstraintSet.project`."""
        if h != self._prepared_for:
            self._prepare(h)
        pointers, bounds = self.segments.chunk_pointers, self.segments.bounds
        (_sweep_parallel if parallel else _sweep)(points, self.corners, self.data, pointers, bounds)

    def damp(self, points: NDArray[np.float64], previous: NDArray[np.float64], h: float, parallel: bool) -> None:
        """See `ConstraintSet.damp`."""
        pointers, bounds = self.segments.chunk_pointers, self.segments.bounds
        gammas = self.damping[self.segments.kinds] / h
        damp = _damp_parallel if parallel else _damp
        damp(points, previous, self.corners, self.data, h, pointers, bounds, gammas)

    def _prepare(self, h: float) -> None:
        """Step lengths for substeps of h: h^2 phi with phi the largest length at which a tet cannot overshoot."""
        stiffness = 2.0 * self.data[:, 9] * self.curvatures[:, 2] * h**2
        self.data[:, 12] = h**2 * np.minimum(1.0, 1.0 / stiffness)
        self._prepared_for = h
        shortened = np.count_nonzero(stiffness > 1.0) / self.count
        if shortened > 0.5:
            logger.warning(
                "XPBD: %.0f %% of the %s are too stiff, or too light, for substeps of %.3g s and "
                "act softer than they are; about %.3g times as many substeps give them their stiffness",
                100.0 * shortened,
                self.called,
                h,
                np.sqrt(np.quantile(stiffness, 0.9)),
            )


class StableNeoHookeanConstraints(BlocksOfTwo):
    """The tetrahedra of all bodies made of `StableNeoHookean`."""

    def __init__(self, system: System, parts: list[BodyRange], layout: Layout) -> None:
        materials = [cast(Elastic, part.body.material).per_tet(part.tets.stop - part.tets.start) for part in parts]
        rows, kind, table = gather(parts, "tets", [material.damping[:, None] for material in materials])
        mu = np.concatenate([material.mu for material in materials])
        lam = np.concatenate([material.lam for material in materials])  # E / (2 (1 + nu) (1 - 2 nu)): above zero
        movable = (system.inverse_masses[system.tets[rows]] > 0.0).any(axis=1)
        rows, kind, mu, lam = rows[movable], kind[movable], mu[movable], lam[movable]
        tets = system.tets[rows], system.rest_shape_inverse[rows], system.rest_volumes[rows]
        segments = sort_into_segments(layout, system.tets[rows], kind)
        super().__init__(tets, (mu, lam), system.inverse_masses, segments, table[:, 0])


def _principal_axes(
    Dm_inv: NDArray[np.float64], w: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Shape gradients in the axes in which sum_i w_i b_i b_i^T is diagonal, and that diagonal.

    The energy is isotropic, so each tet may have rest coordinates of its own; these make the matrix that couples the
    two constraints diagonal, three numbers instead of six.
    """
    b = np.concatenate([-Dm_inv.sum(axis=1, keepdims=True), Dm_inv], axis=1)
    curvatures, axes = np.linalg.eigh(np.einsum("tn,tni,tnj->tij", w, b, b))
    axes[np.linalg.det(axes) < 0.0, :, 0] *= -1.0  # rotations only: a reflection would turn the sign of J
    return Dm_inv @ axes, np.maximum(curvatures, 0.0)


@njit(cache=True, fastmath=FLAGS, error_model="numpy")
def _elastic_chunk(points, corners, data, first, last, bounds):
    for s in range(first, last):
        for c in range(bounds[s, 0], bounds[s, 1]):
            p0, p1, p2, p3 = corners[c, 0], corners[c, 1], corners[c, 2], corners[c, 3]
            b = data[c]
            b10, b11, b12 = b[0], b[1], b[2]
            b20, b21, b22 = b[3], b[4], b[5]
            b30, b31, b32 = b[6], b[7], b[8]
            mu, lam, rest = b[9], b[10], b[11]
            step = b[12]
            k0, k1, k2 = b[13], b[14], b[15]

            x0, y0, z0, w0 = points[p0, 0], points[p0, 1], points[p0, 2], points[p0, 3]
            x1, y1, z1, w1 = points[p1, 0], points[p1, 1], points[p1, 2], points[p1, 3]
            x2, y2, z2, w2 = points[p2, 0], points[p2, 1], points[p2, 2], points[p2, 3]
            x3, y3, z3, w3 = points[p3, 0], points[p3, 1], points[p3, 2], points[p3, 3]
            ux, uy, uz = x1 - x0, y1 - y0, z1 - z0
            vx, vy, vz = x2 - x0, y2 - y0, z2 - z0
            qx, qy, qz = x3 - x0, y3 - y0, z3 - z0

            f00, f01, f02 = (
                ux * b10 + vx * b20 + qx * b30,
                ux * b11 + vx * b21 + qx * b31,
                ux * b12 + vx * b22 + qx * b32,
            )
            f10, f11, f12 = (
                uy * b10 + vy * b20 + qy * b30,
                uy * b11 + vy * b21 + qy * b31,
                uy * b12 + vy * b22 + qy * b32,
            )
            f20, f21, f22 = (
                uz * b10 + vz * b20 + qz * b30,
                uz * b11 + vz * b21 + qz * b31,
                uz * b12 + vz * b22 + qz * b32,
            )
            # dJ/dF, by columns
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
def _viscous_chunk(points, previous, corners, data, h, first, last, bounds, gammas, backwards):
    for s in range(last - 1, first - 1, -1) if backwards else range(first, last):
        # Half of it in each of the two sweeps
        gamma = 0.5 * gammas[s]
        if gamma == 0.0:
            continue
        low, high = bounds[s, 0], bounds[s, 1]
        for k in range(high - low):
            c = high - 1 - k if backwards else low + k
            p0, p1, p2, p3 = corners[c, 0], corners[c, 1], corners[c, 2], corners[c, 3]
            b = data[c]
            b10, b11, b12 = b[0], b[1], b[2]
            b20, b21, b22 = b[3], b[4], b[5]
            b30, b31, b32 = b[6], b[7], b[8]
            mu, lam = b[9], b[10]
            k0, k1, k2 = b[13], b[14], b[15]

            x0, y0, z0, w0 = points[p0, 0], points[p0, 1], points[p0, 2], points[p0, 3]
            x1, y1, z1, w1 = points[p1, 0], points[p1, 1], points[p1, 2], points[p1, 3]
            x2, y2, z2, w2 = points[p2, 0], points[p2, 1], points[p2, 2], points[p2, 3]
            x3, y3, z3, w3 = points[p3, 0], points[p3, 1], points[p3, 2], points[p3, 3]
            ux, uy, uz = x1 - x0, y1 - y0, z1 - z0
            vx, vy, vz = x2 - x0, y2 - y0, z2 - z0
            qx, qy, qz = x3 - x0, y3 - y0, z3 - z0

            f00, f01, f02 = (
                ux * b10 + vx * b20 + qx * b30,
                ux * b11 + vx * b21 + qx * b31,
                ux * b12 + vx * b22 + qx * b32,
            )
            f10, f11, f12 = (
                uy * b10 + vy * b20 + qy * b30,
                uy * b11 + vy * b21 + qy * b31,
                uy * b12 + vy * b22 + qy * b32,
            )
            f20, f21, f22 = (
                uz * b10 + vz * b20 + qz * b30,
                uz * b11 + vz * b21 + qz * b31,
                uz * b12 + vz * b22 + qz * b32,
            )
            ux, uy, uz = _between(previous, p0, p1)
            vx, vy, vz = _between(previous, p0, p2)
            qx, qy, qz = _between(previous, p0, p3)
            g00, g01, g02 = (
                ux * b10 + vx * b20 + qx * b30,
                ux * b11 + vx * b21 + qx * b31,
                ux * b12 + vx * b22 + qx * b32,
            )
            g10, g11, g12 = (
                uy * b10 + vy * b20 + qy * b30,
                uy * b11 + vy * b21 + qy * b31,
                uy * b12 + vy * b22 + qy * b32,
            )
            g20, g21, g22 = (
                uz * b10 + vz * b20 + qz * b30,
                uz * b11 + vz * b21 + qz * b31,
                uz * b12 + vz * b22 + qz * b32,
            )
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
            # The length of the viscous step, by the rule for the elastic one (k2 is the largest curvature), less the
            # square of the largest stretch, before or after: row sums bound it, and are 1 at rest.
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
            bulk = (lam - mu / 3.0) * gamma
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


@njit(cache=True, fastmath=FLAGS)
def _between(x, i, j):
    return x[j, 0] - x[i, 0], x[j, 1] - x[i, 1], x[j, 2] - x[i, 2]


@njit(cache=True)
def _sweep(points, corners, data, pointers, bounds):
    n_chunks = len(pointers) - 1
    for parity in range(2):
        for c in range(parity, n_chunks, 2):
            _elastic_chunk(points, corners, data, pointers[c], pointers[c + 1], bounds)


@njit(cache=True, parallel=True)
def _sweep_parallel(points, corners, data, pointers, bounds):
    n_chunks = len(pointers) - 1
    for parity in range(2):
        for k in prange((n_chunks + 1 - parity) // 2):
            c = 2 * k + parity
            _elastic_chunk(points, corners, data, pointers[c], pointers[c + 1], bounds)


@njit(cache=True)
def _damp(points, previous, corners, data, h, pointers, bounds, gammas):
    n_chunks = len(pointers) - 1
    for turn in range(4):
        # even, odd, and back: odd, even
        for c in range(0 if turn in (0, 3) else 1, n_chunks, 2):
            first, last = pointers[c], pointers[c + 1]
            _viscous_chunk(points, previous, corners, data, h, first, last, bounds, gammas, turn >= 2)


@njit(cache=True, parallel=True)
def _damp_parallel(points, previous, corners, data, h, pointers, bounds, gammas):
    n_chunks = len(pointers) - 1
    for turn in range(4):
        parity = 0 if turn == 0 or turn == 3 else 1
        for k in prange((n_chunks + 1 - parity) // 2):
            c = 2 * k + parity
            first, last = pointers[c], pointers[c + 1]
            _viscous_chunk(points, previous, corners, data, h, first, last, bounds, gammas, turn >= 2)
