"""Stable Neo-Hookean elasticity: psi = mu/2 (Ic - 3) - mu (J - 1) + lam/2 (J - 1)^2.

Source: Smith, de Goes, Kim, "Stable Neo-Hookean Flesh Simulation" (2018), without the logarithmic barrier.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.materials.lame import lame_from_engineering
from supple.materials.material import Elastic


@dataclass(frozen=True, eq=False, kw_only=True)
class StableNeoHookean(Elastic):
    """Stable Neo-Hookean: finite for inverted elements, which it can recover.

    Its linearization at rest has the first Lamé parameter lam - mu, so lam = lam_L + mu_L is what makes small strains
    follow the Young's modulus and Poisson's ratio that were typed.
    """

    def lame_parameters(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        mu, lam = lame_from_engineering(self.youngs, self.poisson)
        return mu, lam + mu
