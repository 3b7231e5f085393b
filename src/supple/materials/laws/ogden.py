"""The Ogden energy, of which the Mooney-Rivlin energy is a case.

    psi = sum_k mu_k / alpha_k (t_0^alpha_k + t_1^alpha_k + t_2^alpha_k - 3) + K/2 (J - 1)^2,    t_i = J^(-1/3) s_i.

The sum over i is that of e^(alpha e_i) - 1 - alpha e_i for the deviatoric logarithmic strains e_i, whose sum is zero:
nothing cancels near rest. Terms with alpha = 2 and -2 are those of the invariants I1 - 3 and I2 - 3 of Mooney and
Rivlin, both of F / J^(1/3).

Source: Ogden, "Large deformation isotropic elasticity" (1972); Bonet, Wood, "Nonlinear Continuum Mechanics for Finite
Element Analysis", section 6.6.
"""

from __future__ import annotations

import math

from supple.materials.laws.isotropic_law import IsotropicLaw
from supple.materials.laws.log_strains import (
    exp_quotient,
    exp_remainder,
    law_kernel,
    log_strains,
    with_squared_volume_change,
)
from supple.runtime.kernel_cache import njit


@njit
def _energy(s, p):
    """p : K, then mu_k and alpha_k of every term."""
    e, mean = log_strains(s)
    e0, e1, e2 = e[0] - mean, e[1] - mean, e[2] - mean
    psi = x0 = x1 = x2 = g0 = g1 = g2 = b0 = b1 = b2 = 0.0
    for k in range(1, len(p), 2):
        mu, a = p[k], p[k + 1]
        f0, f1, f2 = a * e0, a * e1, a * e2
        y0, y1, y2 = math.expm1(f0), math.expm1(f1), math.expm1(f2)
        psi += mu / a * (exp_remainder(f0, y0) + exp_remainder(f1, y1) + exp_remainder(f2, y2))
        # The stress less mu, which all three would have in common.
        x0 += mu * y0
        x1 += mu * y1
        x2 += mu * y2
        g0 += mu * a * (y0 + 1.0)
        g1 += mu * a * (y1 + 1.0)
        g2 += mu * a * (y2 + 1.0)
        b0 += mu * a * exp_quotient(f1, f2, y1, y2)
        b1 += mu * a * exp_quotient(f0, f2, y0, y2)
        b2 += mu * a * exp_quotient(f0, f1, y0, y1)
    psi, tau, c = with_squared_volume_change(s, psi, (x0, x1, x2), (g0, g1, g2, 0.0, 0.0, 0.0), p[0])
    return psi, tau, c, (b0, b1, b2)


OGDEN = IsotropicLaw(law_kernel("ogden", _energy), range(3, 20, 2), bulk=0)
