"""The Yeoh energy: psi = c10 (I1 - 3) + c20 (I1 - 3)^2 + c30 (I1 - 3)^3 + K/2 (J - 1)^2, I1 of F / J^(1/3).

With the deviatoric logarithmic strains e_i, I1 - 3 is the sum of e^(2 e_i) - 1 - 2 e_i: nothing cancels near rest.

Source: Yeoh, "Some forms of the strain energy function for rubber" (1993).
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
    """p : K, c10, c20, c30."""
    e, mean = log_strains(s)
    x, y, z = 2.0 * (e[0] - mean), 2.0 * (e[1] - mean), 2.0 * (e[2] - mean)
    f, g, h = math.expm1(x), math.expm1(y), math.expm1(z)
    i = exp_remainder(x, f) + exp_remainder(y, g) + exp_remainder(z, h)
    psi = i * (p[1] + i * (p[2] + i * p[3]))
    first = p[1] + i * (2.0 * p[2] + 3.0 * i * p[3])
    second = 2.0 * p[2] + 6.0 * i * p[3]
    u, v, w = 2.0 * f + 2.0, 2.0 * g + 2.0, 2.0 * h + 2.0
    beta = (2.0 * first * f, 2.0 * first * g, 2.0 * first * h)
    tangent = (
        2.0 * first * u + second * u * u,
        2.0 * first * v + second * v * v,
        2.0 * first * w + second * w * w,
        second * v * w,
        second * u * w,
        second * u * v,
    )
    quotients = (
        4.0 * first * exp_quotient(y, z, g, h),
        4.0 * first * exp_quotient(x, z, f, h),
        4.0 * first * exp_quotient(x, y, f, g),
    )
    psi, tau, c = with_squared_volume_change(s, psi, beta, tangent, p[0])
    return psi, tau, c, quotients


YEOH = IsotropicLaw(law_kernel("yeoh", _energy), range(4, 5), bulk=0)
