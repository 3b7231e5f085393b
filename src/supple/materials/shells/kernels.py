"""Strains, energies and forces of triangles, one by one; the formulas are those of `membrane`."""

from __future__ import annotations

import math

import numpy as np

from supple.numerics.mat3 import dot, row, subtract
from supple.runtime.kernel_cache import njit


@njit(inline="always")
def strain(x, triangles, gradients, t):
    """The two columns of F of a triangle, and the Green strain 11, 22, 12."""
    p = row(x, triangles[t, 0])
    u, v, g = subtract(row(x, triangles[t, 1]), p), subtract(row(x, triangles[t, 2]), p), gradients[t]
    a, b, c, d = g[1, 0], g[2, 0], g[1, 1], g[2, 1]
    one = (a * u[0] + b * v[0], a * u[1] + b * v[1], a * u[2] + b * v[2])
    two = (c * u[0] + d * v[0], c * u[1] + d * v[1], c * u[2] + d * v[2])
    return one, two, 0.5 * (dot(one, one) - 1.0), 0.5 * (dot(two, two) - 1.0), 0.5 * dot(one, two)


@njit(cache=True)
def strains_of(x, triangles, gradients):
    """The Green strains (t, 3), 11, 22 and 12, at places x (n, >= 3)."""
    out = np.empty((len(triangles), 3))
    for t in range(len(triangles)):
        _, _, out[t, 0], out[t, 1], out[t, 2] = strain(x, triangles, gradients, t)
    return out


@njit(inline="always")
def stress(e1, e2, e12, mu, a, neo_hookean):
    """The energy per volume [J/m^3] and the stress 11, 22, 12 [Pa]; see `membrane`."""
    if not neo_hookean:
        c, d = 2.0 * mu, 2.0 * mu * a * (e1 + e2)
        energy = mu * (e1 * e1 + e2 * e2 + 2.0 * e12 * e12) + mu * a * (e1 + e2) * (e1 + e2)
        return energy, c * e1 + d, c * e2 + d, c * e12
    c1, c2, c12 = 1.0 + 2.0 * e1, 1.0 + 2.0 * e2, 2.0 * e12
    det = max(c1 * c2 - c12 * c12, 1e-300)
    log = math.log(det)
    term = math.expm1(-a * log) / a if abs(a) > 1e-9 else -log
    power = mu * math.exp(-a * log) / det
    return mu * (e1 + e2 + 0.5 * term), mu - power * c2, mu - power * c1, power * c12


@njit(cache=True)
def membrane_energies(x, triangles, gradients, constants, out):
    """Write the energies (t,) of triangles [J]; constants : (t, 4) volume [m^3], mu [Pa], a, 1 where neo-Hookean."""
    for t in range(len(triangles)):
        _, _, e1, e2, e12 = strain(x, triangles, gradients, t)
        V, mu, a, law = constants[t, 0], constants[t, 1], constants[t, 2], constants[t, 3]
        out[t] = V * stress(e1, e2, e12, mu, a, law > 0.0)[0]


@njit(cache=True)
def add_membrane_forces(x, triangles, gradients, constants, factor, out):
    """Add `factor` times the forces of triangles, see `membrane_energies`, to `out` (n, 3)."""
    for t in range(len(triangles)):
        f1, f2, e1, e2, e12 = strain(x, triangles, gradients, t)
        V, mu, a, law = factor * constants[t, 0], constants[t, 1], constants[t, 2], constants[t, 3]
        _, s1, s2, s12 = stress(e1, e2, e12, mu, a, law > 0.0)
        for p in range(3):
            g = gradients[t, p]
            u, w = V * (s1 * g[0] + s12 * g[1]), V * (s12 * g[0] + s2 * g[1])
            for j in range(3):
                out[triangles[t, p], j] -= u * f1[j] + w * f2[j]
