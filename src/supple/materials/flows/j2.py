"""Plastic flow of J2 plasticity: along the deviator of the stress, by the exponential map; see `laws/j2.py`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.materials.flows.internal import DISSIPATED, FLOW, flowed
from supple.materials.laws.hencky import HENCKY
from supple.materials.laws.j2 import J2_STEP, plastic_increment, yield_stress
from supple.materials.per_tet import Flow
from supple.runtime.kernel_cache import njit


class J2Flow(Flow):
    """Parameters of the law: K, mu, Y0, H, Y1 [Pa], r. The measure of flow is the accumulated plastic strain."""

    name = "j2"
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


@njit(cache=True)
def _increments(p, accumulated, trial, out, works):
    """The growth of the accumulated plastic strain, and the plastic work, the integral of the yield stress over it."""
    for e in range(len(out)):
        a, d = accumulated[e], plastic_increment(p[e], accumulated[e], trial[e])
        out[e] = d
        works[e] = yield_stress(p[e], a + d)[2] - yield_stress(p[e], a)[2] if d > 0.0 else 0.0


J2_FLOW = J2Flow()
