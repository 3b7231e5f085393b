"""Energies of the principal logarithmic strains e_i = ln s_i, and their derivatives by the principal stretches.

An energy psi(e_0, e_1, e_2) is given by

    tau_i = d psi / d e_i,    c_ij = d tau_i / d e_j,    b_ij = (tau_i - tau_j) / (e_i - e_j),

tau_i being the principal Kirchhoff stresses. From these follow, with r = (s_i - s_j) / (s_i + s_j),

    psi_i  = tau_i / s_i
    psi_ij = (c_ij - delta_ij tau_i) / (s_i s_j)
    d_ij   = (psi_i - psi_j) / (s_i - s_j) = (b_ij artanh(r) / r - (tau_i + tau_j) / 2) / (s_i s_j)
    t_ij   = (psi_i + psi_j) / (s_i + s_j) = (tau_i s_j + tau_j s_i) / (s_i s_j (s_i + s_j)),

in which nothing is 0/0 where b_ij is given in closed form. Six numbers of a symmetric matrix are in the order 00, 11,
22, 12, 02, 01, three numbers of pairs in the order 12, 02, 01.

Source: Simo, "Algorithms for static and dynamic multiplicative plasticity that preserve the classical return mapping
schemes of the infinitesimal theory" (1992), for the derivatives by principal logarithmic strains.
"""

from __future__ import annotations

import math
from types import FunctionType
from typing import TYPE_CHECKING, Any

import numpy as np

from supple.materials.stretch_energies.stretches import volume_change
from supple.runtime.kernel_cache import njit, prange

VALUES = 16  # of a tet: psi, psi_i, psi_ij, and the quotients d and t


@njit
def log_strains(s):
    """e_i = ln s_i, and their mean."""
    e = (math.log(s[0]), math.log(s[1]), math.log(s[2]))
    return e, (e[0] + e[1] + e[2]) / 3.0


@njit
def exp_remainder(x, grown):
    """e^x - 1 - x, accurate near 0, from x and `grown` = e^x - 1."""
    if abs(x) > 0.1:
        return grown - x
    inner = 1.0 + x / 7.0 * (1.0 + x / 8.0 * (1.0 + x / 9.0))
    return 0.5 * x * x * (1.0 + x / 3.0 * (1.0 + x / 4.0 * (1.0 + x / 5.0 * (1.0 + x / 6.0 * inner))))


@njit
def exp_quotient(x, y, grown_x, grown_y):
    """(e^x - e^y) / (x - y), from x, y and `grown` = e^x - 1 of both."""
    z = x - y
    if abs(z) > 0.02:
        return (grown_x - grown_y) / z
    inner = 1.0 + z / 5.0 * (1.0 + z / 6.0 * (1.0 + z / 7.0))
    return (grown_y + 1.0) * (1.0 + 0.5 * z * (1.0 + z / 3.0 * (1.0 + 0.25 * z * inner)))


@njit
def _artanh_quotient(a, b):
    """artanh(r) / r for r = (a - b) / (a + b)."""
    r = (a - b) / (a + b)
    if abs(r) > 0.1:
        return 0.5 * math.log(a / b) / r
    q = r * r
    return 1.0 + q * (1.0 / 3.0 + q * (0.2 + q * (1.0 / 7.0 + q * (1.0 / 9.0 + q * (1.0 / 11.0 + q / 13.0)))))


@njit
def deviatoric_projection(g):
    """P g P with P = I - 1/3: the derivative by e of a function whose derivative by the deviator is g (six numbers)."""
    r0, r1, r2 = (g[0] + g[5] + g[4]) / 3.0, (g[5] + g[1] + g[3]) / 3.0, (g[4] + g[3] + g[2]) / 3.0
    q = (r0 + r1 + r2) / 3.0
    return (
        g[0] - 2.0 * r0 + q,
        g[1] - 2.0 * r1 + q,
        g[2] - 2.0 * r2 + q,
        g[3] - r1 - r2 + q,
        g[4] - r0 - r2 + q,
        g[5] - r0 - r1 + q,
    )


@njit
def with_squared_volume_change(s, psi, beta, g, bulk):
    """psi, tau and c of an energy of the deviatoric strains plus bulk/2 (J - 1)^2.

    beta, g : first (three) and second (six) derivatives of the first energy by the deviatoric strains
    """
    j = volume_change(s)
    J = 1.0 + j
    p, k = bulk * j * J, bulk * J * (j + J)
    mean = (beta[0] + beta[1] + beta[2]) / 3.0
    tau = (beta[0] - mean + p, beta[1] - mean + p, beta[2] - mean + p)
    c = deviatoric_projection(g)
    return psi + 0.5 * bulk * j * j, tau, (c[0] + k, c[1] + k, c[2] + k, c[3] + k, c[4] + k, c[5] + k)


@njit
def put_values(s, psi, tau, c, b, out, e):
    """psi, psi_i, psi_ij, d_ij and t_ij into the `VALUES` numbers of out[e]."""
    u, v, w = 1.0 / s[0], 1.0 / s[1], 1.0 / s[2]
    out[e, 0] = psi
    out[e, 1], out[e, 2], out[e, 3] = tau[0] * u, tau[1] * v, tau[2] * w
    out[e, 4] = (c[0] - tau[0]) * u * u
    out[e, 5] = (c[1] - tau[1]) * v * v
    out[e, 6] = (c[2] - tau[2]) * w * w
    out[e, 7], out[e, 8], out[e, 9] = c[3] * v * w, c[4] * u * w, c[5] * u * v
    out[e, 10] = (b[0] * _artanh_quotient(s[1], s[2]) - 0.5 * (tau[1] + tau[2])) * v * w
    out[e, 11] = (b[1] * _artanh_quotient(s[0], s[2]) - 0.5 * (tau[0] + tau[2])) * u * w
    out[e, 12] = (b[2] * _artanh_quotient(s[0], s[1]) - 0.5 * (tau[0] + tau[1])) * u * v
    out[e, 13] = (tau[1] * s[2] + tau[2] * s[1]) * v * w / (s[1] + s[2])
    out[e, 14] = (tau[0] * s[2] + tau[2] * s[0]) * u * w / (s[0] + s[2])
    out[e, 15] = (tau[0] * s[1] + tau[1] * s[0]) * u * v / (s[0] + s[1])


if TYPE_CHECKING:  # `law_kernel` gives this name to each copy of `_values`

    def energy(s: Any, p: Any) -> Any: ...


def _values(s, p, out):
    for e in prange(len(s)):
        if s[e, 2] > 0.0:
            stretches = (s[e, 0], s[e, 1], s[e, 2])
            psi, tau, c, b = energy(stretches, p[e])
            put_values(stretches, psi, tau, c, b, out, e)
        else:
            out[e, 0] = np.inf
            for k in range(1, VALUES):
                out[e, k] = np.nan


def law_kernel(name: str, function: Any, cache: bool = True) -> Any:
    """The kernel (s (k, 3), p (k, q), out (k, 16)) of a compiled function (s, p) -> psi, tau, c, b.

    Parameters
    ----------
    name : unique among the laws; Numba's cache distinguishes kernels by their names.
    function : of the principal stretches s (three numbers) and the parameters p (q,).
    cache : whether the machine code is kept on disk.
    """
    name = f"values_of_{name}"
    # Not a closure: Numba gives these another name in each process where they hold a compiled function.
    values = FunctionType(_values.__code__, {**_values.__globals__, "energy": function}, name)
    values.__qualname__, values.__module__ = name, _values.__module__
    return njit(cache=cache, parallel=True)(values)
