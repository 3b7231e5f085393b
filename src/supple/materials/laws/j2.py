"""J2 plasticity: the energy of one step as a function of the trial strains, and the plastic flow.

The trial strains e are those without plastic flow within the step, q_trial = sqrt(6) mu |dev e|. Where it is above the
yield stress Y(a) of the accumulated plastic strain a, the increment d of a solves

    q = q_trial - 3 mu d = Y(a + d),    Y(a) = Y0 + H a + (Y1 - Y0) (1 - exp(-r a)),

and the energy of the step is

    psi = K/2 (ln J)^2 + q^2 / (6 mu) + integral of Y from a to a + d,

the minimum over d. Its derivative by e is the stress at the end of the step, so that steps are minimizations and
tangents symmetric.

Sources: Simo, Hughes, "Computational Inelasticity" (1998), sections 3.3 and 9.3; Ortiz, Stainier, "The variational
formulation of viscoplastic constitutive updates" (1999).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from supple.materials.laws.hencky import HENCKY, isotropic_tensor
from supple.materials.laws.internal import DISSIPATED, FLOW, flowed
from supple.materials.laws.isotropic_law import IsotropicLaw
from supple.materials.laws.log_strains import law_kernel, log_strains
from supple.materials.per_tet import Flow
from supple.runtime.kernel_cache import njit


@njit
def yield_stress(p, a):
    """Y(a), its derivative, and its integral from 0; p as of `_energy`."""
    more, decay = p[4] - p[2], math.exp(-p[5] * a)
    saturated = -more * math.expm1(-p[5] * a)
    integral = more * (a + math.expm1(-p[5] * a) / p[5]) if p[5] > 0.0 else 0.0
    return p[2] + p[3] * a + saturated, p[3] + more * p[5] * decay, p[2] * a + 0.5 * p[3] * a * a + integral


@njit
def plastic_increment(p, a, trial):
    """d >= 0 with q_trial - 3 mu d = Y(a + d), and 0 where q_trial is at most Y(a)."""
    d = 0.0
    for _ in range(100):
        # Convex and falling in d: Newton's method from the left never goes too far.
        Y, H, _ = yield_stress(p, a + d)
        rest = trial - 3.0 * p[1] * d - Y
        if rest <= 1e-15 * trial:
            break
        d += rest / (3.0 * p[1] + H)
    return d


@njit
def _energy(s, p):
    """p : K, mu, Y0, H, Y1, r, and a at the start of the step."""
    e, mean = log_strains(s)
    d0, d1, d2 = e[0] - mean, e[1] - mean, e[2] - mean
    size = math.sqrt(d0 * d0 + d1 * d1 + d2 * d2)
    pressure = 3.0 * p[0] * mean
    trial = math.sqrt(6.0) * p[1] * size
    d = plastic_increment(p, p[6], trial)
    if d == 0.0:
        m = 2.0 * p[1]
        psi = p[1] * size * size + 1.5 * pressure * mean
        tau = (m * d0 + pressure, m * d1 + pressure, m * d2 + pressure)
        return psi, tau, isotropic_tensor(m, p[0]), (m, m, m)
    q = trial - 3.0 * p[1] * d
    H = yield_stress(p, p[6] + d)[1]
    m = 2.0 * p[1] * q / trial
    # Along the direction of the strain the stiffness is 2 mu H / (3 mu + H), across it m.
    n = (2.0 * p[1] * H / (3.0 * p[1] + H) - m) / (size * size)
    c = isotropic_tensor(m, p[0])
    psi = q * q / (6.0 * p[1]) + yield_stress(p, p[6] + d)[2] - yield_stress(p, p[6])[2] + 1.5 * pressure * mean
    tau = (m * d0 + pressure, m * d1 + pressure, m * d2 + pressure)
    tangent = (
        c[0] + n * d0 * d0, c[1] + n * d1 * d1, c[2] + n * d2 * d2,
        c[3] + n * d1 * d2, c[4] + n * d0 * d2, c[5] + n * d0 * d1,
    )  # fmt: skip
    return psi, tau, tangent, (m, m, m)


J2_STEP = IsotropicLaw(law_kernel("j2_step", _energy), range(7, 8), infinite_when_flat=True)


class J2Flow(Flow):
    """Parameters of the law: K, mu, Y0, H, Y1 [Pa], r. The measure of flow is the accumulated plastic strain."""

    step_law = J2_STEP

    def step_parameters(self, p: NDArray[np.float64], internal: NDArray[np.float64], h: float) -> NDArray[np.float64]:
        return np.column_stack([p, internal[:, FLOW]])

    def advanced(
        self, F: NDArray[np.float64], p: NDArray[np.float64], internal: NDArray[np.float64], h: float
    ) -> NDArray[np.float64]:
        _, s, V, _ = HENCKY.decomposed(F, p)
        e = np.log(s)
        e -= e.mean(axis=1)[:, None]
        size = np.linalg.norm(e, axis=1)
        trial = np.sqrt(6.0) * p[:, 1] * size
        grown, works = np.empty(len(p)), np.empty(len(p))
        _increments(p, internal[:, FLOW].copy(), trial, grown, works)
        flows = grown > 0.0
        after = internal.copy()
        strains = np.sqrt(1.5) * (grown[flows] / size[flows])[:, None] * e[flows]
        after[flows, :9] = flowed(internal[flows], V[flows], strains).reshape(-1, 9)
        after[:, FLOW] += grown
        after[:, DISSIPATED] += works
        return after

    def stored_at_yield(self, p: NDArray[np.float64]) -> NDArray[np.float64]:
        return p[:, 2] ** 2 / (6.0 * p[:, 1])


@njit(cache=True)
def _increments(p, accumulated, trial, out, works):
    """The growth of the accumulated plastic strain, and the plastic work, the integral of the yield stress over it."""
    for e in range(len(out)):
        a, d = accumulated[e], plastic_increment(p[e], accumulated[e], trial[e])
        out[e] = d
        works[e] = yield_stress(p[e], a + d)[2] - yield_stress(p[e], a)[2] if d > 0.0 else 0.0


J2_FLOW = J2Flow()
