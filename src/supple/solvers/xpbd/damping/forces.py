"""Viscous forces of tetrahedra and springs, linear in the velocity, symmetric and positive semi-definite.

They are zero in a rigid motion about the given positions. With v = (x - x_n) / h and the positions (x + x_n) / 2 they
are zero in a rigid rotation of any size, because F_m^T (F - F_n) + (F - F_n)^T F_m = F^T F - F_n^T F_n.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from supple.runtime.kernel_cache import kernel_with, njit, prange
from supple.solvers.xpbd.constraints.block_of_two import deformation_of, moved_by_stress
from supple.solvers.xpbd.sweeps.groups import FLAGS, WIDTH, Groups, nine, put_nine, put_twelve, twelve

_NO_FORCES, _FORCES = (0.0,) * 12, (-1.0,) * 4


@njit(fastmath=FLAGS, forceinline=True)
def _softened(stiffness, slope, h):
    """The part of a stiffness whose rates substeps of h [s] do not suppress; see `elements`."""
    factor = 1.0 + h * h * stiffness * slope
    return stiffness / (factor * factor)


@njit(fastmath=FLAGS, forceinline=True)
def viscous_tets(X, V, k, data, g, h):
    """The forces of group g that balance the viscous stress, into V; into k four means of the diagonal entries of their
    matrix [kg/s].

    With D = sym(F^T F') they are the gradient of shear |dev D|^2 + bulk / 2 (dJ/dF : F')^2. XPBD itself damps like
    tau = h. Columns of X and V are 12 coordinates [m] and velocities [m/s].

    The rows of `data`: 9 of b, mu V, bulk modulus times V, its slope, tau.
    """
    for i in range(WIDTH):
        b = nine(data[g], i)
        tau = max(data[g, 12, i] - h, 0.0)
        shear, bulk = tau * data[g, 9, i], tau * _softened(data[g, 10, i], data[g, 11, i], h)
        F, C, _ = deformation_of(twelve(X, i), b)
        G, _, _ = deformation_of(twelve(V, i), b)
        f00, f01, f02, f10, f11, f12, f20, f21, f22 = F
        c00, c01, c02, c10, c11, c12, c20, c21, c22 = C
        g00, g01, g02, g10, g11, g12, g20, g21, g22 = G
        d00, d11 = f00 * g00 + f10 * g10 + f20 * g20, f01 * g01 + f11 * g11 + f21 * g21
        d22 = f02 * g02 + f12 * g12 + f22 * g22
        d01 = shear * (f00 * g01 + f10 * g11 + f20 * g21 + f01 * g00 + f11 * g10 + f21 * g20)
        d02 = shear * (f00 * g02 + f10 * g12 + f20 * g22 + f02 * g00 + f12 * g10 + f22 * g20)
        d12 = shear * (f01 * g02 + f11 * g12 + f21 * g22 + f02 * g01 + f12 * g11 + f22 * g21)
        p = bulk * (
            (c00 * g00 + c10 * g10 + c20 * g20)
            + (c01 * g01 + c11 * g11 + c21 * g21)
            + (c02 * g02 + c12 * g12 + c22 * g22)
        )
        third = (d00 + d11 + d22) / 3.0
        d00, d11, d22 = 2.0 * shear * (d00 - third), 2.0 * shear * (d11 - third), 2.0 * shear * (d22 - third)
        stress = (
            f00 * d00 + f01 * d01 + f02 * d02 + p * c00,
            f00 * d01 + f01 * d11 + f02 * d12 + p * c01,
            f00 * d02 + f01 * d12 + f02 * d22 + p * c02,
            f10 * d00 + f11 * d01 + f12 * d02 + p * c10,
            f10 * d01 + f11 * d11 + f12 * d12 + p * c11,
            f10 * d02 + f11 * d12 + f12 * d22 + p * c12,
            f20 * d00 + f21 * d01 + f22 * d02 + p * c20,
            f20 * d01 + f21 * d11 + f22 * d12 + p * c21,
            f20 * d02 + f21 * d12 + f22 * d22 + p * c22,
        )
        put_twelve(V, i, moved_by_stress(_NO_FORCES, _FORCES, b, stress, 1.0))
        # A third of the traces of the diagonal blocks, shear (|F|^2 |b|^2 + |F b|^2 / 3) + bulk |dJ/dF b|^2, with the
        # means of |F b|^2 and |dJ/dF b|^2 over all directions of b.
        square = (f00 * f00 + f01 * f01 + f02 * f02) + (f10 * f10 + f11 * f11 + f12 * f12)
        area = (c00 * c00 + c01 * c01 + c02 * c02) + (c10 * c10 + c11 * c11 + c12 * c12)
        square, area = square + (f20 * f20 + f21 * f21 + f22 * f22), area + (c20 * c20 + c21 * c21 + c22 * c22)
        mean = shear * square * (10.0 / 27.0) + bulk * area / 9.0
        b10, b11, b12, b20, b21, b22, b30, b31, b32 = b
        b00, b01, b02 = b10 + b20 + b30, b11 + b21 + b31, b12 + b22 + b32
        k[0, i] = mean * (b00 * b00 + b01 * b01 + b02 * b02)
        k[1, i] = mean * (b10 * b10 + b11 * b11 + b12 * b12)
        k[2, i] = mean * (b20 * b20 + b21 * b21 + b22 * b22)
        k[3, i] = mean * (b30 * b30 + b31 * b31 + b32 * b32)


@njit(fastmath=FLAGS, forceinline=True)
def viscous_springs(X, V, k, data, g, h):
    """The same of springs from a vertex to the place t of an edge: 9 coordinates and 3 means.

    They are the gradient of viscosity / 2 (d . d' / |d|)^2, with d = x_0 - (1 - t) x_1 - t x_2.

    The rows of `data`: t, stiffness, its slope, tau.
    """
    for i in range(WIDTH):
        t, viscosity = data[g, 0, i], max(data[g, 3, i] - h, 0.0) * _softened(data[g, 1, i], data[g, 2, i], h)
        x0, y0, z0, x1, y1, z1, x2, y2, z2 = nine(X, i)
        s = 1.0 - t
        dx, dy, dz = x0 - s * x1 - t * x2, y0 - s * y1 - t * y2, z0 - s * z1 - t * z2
        x0, y0, z0, x1, y1, z1, x2, y2, z2 = nine(V, i)
        ex, ey, ez = x0 - s * x1 - t * x2, y0 - s * y1 - t * y2, z0 - s * z1 - t * z2
        squared = dx * dx + dy * dy + dz * dz
        # Coinciding ends have no direction.
        rate = (dx * ex + dy * ey + dz * ez) / squared if squared > 0.0 else 0.0
        fx, fy, fz = viscosity * rate * dx, viscosity * rate * dy, viscosity * rate * dz
        put_nine(V, i, (fx, fy, fz, -s * fx, -s * fy, -s * fz, -t * fx, -t * fy, -t * fz))
        third = viscosity / 3.0
        k[0, i], k[1, i], k[2, i] = third, s * s * third, t * t * third


class ViscousElements:
    """Elements of one kind, in the groups and chunks of the sweeps.

    Parameters
    ----------
    law : `viscous_tets` or `viscous_springs`
    vertices : (m, k); constants : (m, c); groups : of these elements

    Attributes
    ----------
    members : (g, WIDTH) the elements of each group; active : (g,) whether one of them can move
    """

    def __init__(self, law: Any, vertices: NDArray[np.int32], constants: NDArray[np.float64], groups: Groups) -> None:
        self.members, counts = groups.members, groups.counts
        self.active = np.ones(len(counts), dtype=np.bool_)
        self._corners = np.ascontiguousarray(vertices[groups.members], dtype=np.uint32)
        self._elements = self._corners, counts, groups.lanes(constants).astype(np.float32), groups.pointers
        self._kernel = _sum_of(law, vertices.shape[1])

    def choose(self, inverse_masses: NDArray[np.float64]) -> None:
        """Set which groups are active, of inverse masses (n,) [1/kg]."""
        self.active[:] = (inverse_masses[self._corners] > 0.0).any(axis=(1, 2))

    def add(self, motion: NDArray[np.float64], h: float, chosen: NDArray[np.bool_]) -> None:
        """Add the forces in substeps of h [s] to the columns 6 to 8 of `motion` (n, 10), and the diagonal to the last.

        The columns before are positions [m] and velocities [m/s]. Only groups that are `chosen` (g,) count.
        """
        corners, counts, data, pointers = self._elements
        self._kernel(motion, corners, counts, chosen, data, pointers, h)


@cache
def _sum_of(law: Any, corners: int) -> Any:
    name = law.py_func.__qualname__
    chunk = njit(fastmath=FLAGS)(kernel_with(_sum_chunk, name, law=law, CORNERS=corners))
    return njit(cache=True, parallel=True, rows=0)(kernel_with(_sum, name, _sum_chunk=chunk))


if TYPE_CHECKING:  # `kernel_with` gives these names to each copy of `_sum_chunk`
    CORNERS = 0

    def law(X, V, k, data, g, h): ...


def _sum_chunk(motion, corners, counts, active, data, first, last, h):
    X = np.zeros((3 * CORNERS, WIDTH))
    V = np.zeros((3 * CORNERS, WIDTH))
    k = np.zeros((CORNERS, WIDTH))
    for g in range(first, last):
        if not active[g]:
            continue
        for lane in range(counts[g]):
            for c in range(CORNERS):
                p = corners[g, lane, c]
                X[3 * c, lane], X[3 * c + 1, lane], X[3 * c + 2, lane] = motion[p, 0], motion[p, 1], motion[p, 2]
                V[3 * c, lane], V[3 * c + 1, lane], V[3 * c + 2, lane] = motion[p, 3], motion[p, 4], motion[p, 5]
        law(X, V, k, data, g, h)
        for lane in range(counts[g]):
            for c in range(CORNERS):
                p = corners[g, lane, c]
                motion[p, 6] += V[3 * c, lane]
                motion[p, 7] += V[3 * c + 1, lane]
                motion[p, 8] += V[3 * c + 2, lane]
                motion[p, 9] += k[c, lane]


def _sum(motion, corners, counts, active, data, pointers, h):
    n_chunks = len(pointers) - 1
    for parity in range(2):
        for k in prange((n_chunks + 1 - parity) // 2):
            c = 2 * k + parity
            _sum_chunk(motion, corners, counts, active, data, pointers[c], pointers[c + 1], h)
