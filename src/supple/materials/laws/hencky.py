"""The Hencky energy, quadratic in the logarithmic strains e_i, and its use for materials that flow.

    psi = mu |dev e|^2 + K/2 (ln J)^2

`HENCKY` is the elastic energy of metals. `MAXWELL` is that of a spring in series with a dashpot, whose K is zero.

Source: Hencky (1928); Simo, "Algorithms for static and dynamic multiplicative plasticity" (1992), section 2.
"""

from __future__ import annotations

from supple.materials.laws.isotropic_law import IsotropicLaw
from supple.materials.laws.log_strains import law_kernel, log_strains
from supple.runtime.kernel_cache import njit


@njit
def isotropic_tensor(shear, volume):
    """shear (I - 1/3) + volume 1, as six numbers."""
    a, b = 2.0 / 3.0 * shear + volume, volume - shear / 3.0
    return (a, a, a, b, b, b)


@njit
def _energy(s, p):
    """p : K, mu."""
    e, mean = log_strains(s)
    d0, d1, d2 = e[0] - mean, e[1] - mean, e[2] - mean
    m, pressure = 2.0 * p[1], 3.0 * p[0] * mean
    psi = p[1] * (d0 * d0 + d1 * d1 + d2 * d2) + 1.5 * pressure * mean
    tau = (m * d0 + pressure, m * d1 + pressure, m * d2 + pressure)
    return psi, tau, isotropic_tensor(m, p[0]), (m, m, m)


_KERNEL = law_kernel("hencky", _energy)
HENCKY = IsotropicLaw(_KERNEL, range(2, 7), infinite_when_flat=True)
MAXWELL = IsotropicLaw(_KERNEL, range(2, 4))
