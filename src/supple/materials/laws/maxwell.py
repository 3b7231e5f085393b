"""A Maxwell element at finite strain: a Hencky spring in series with a dashpot.

The dashpot flows without a change of volume at the rate dev tau / (2 G T), tau being the Kirchhoff stress of the
spring, G its shear modulus and T its time. In a step of h whose trial strains are e, the deviator of the spring's
strains goes to exp(-h/T) dev e: exact while F stays as it is. The stress at the end is the derivative of

    G exp(-h/T) |dev e|^2,

and G |dev e|^2 (1 - exp(-2 h/T)), never negative, is dissipated.

Source: Reese, Govindjee, "A theory of finite viscoelasticity and numerical aspects" (1998), with Hencky's energy for
the spring.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.materials.laws.hencky import MAXWELL
from supple.materials.laws.internal import DISSIPATED, FLOW, flowed
from supple.materials.per_tet import Flow


class MaxwellFlow(Flow):
    """Parameters of the law: 0, G [Pa], T [s]. The measure of flow is the sum of |strain| of the dashpot."""

    step_law = MAXWELL

    def step_parameters(self, p: NDArray[np.float64], internal: NDArray[np.float64], h: float) -> NDArray[np.float64]:
        return np.column_stack([p[:, 0], p[:, 1] * np.exp(-h / p[:, 2])])

    def advanced(
        self, F: NDArray[np.float64], p: NDArray[np.float64], internal: NDArray[np.float64], h: float
    ) -> NDArray[np.float64]:
        _, s, V, _ = MAXWELL.decomposed(F, p)
        e = np.log(s)
        e -= e.mean(axis=1)[:, None]
        strains = -np.expm1(-h / p[:, 2])[:, None] * e
        squares = (e * e).sum(axis=1)
        after = internal.copy()
        after[:, :9] = flowed(internal, V, strains).reshape(-1, 9)
        after[:, FLOW] += np.linalg.norm(strains, axis=1)
        after[:, DISSIPATED] += -p[:, 1] * squares * np.expm1(-2.0 * h / p[:, 2])
        return after


MAXWELL_FLOW = MaxwellFlow()
