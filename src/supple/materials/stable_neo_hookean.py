"""Stable Neo-Hookean elasticity as a material; the energy is in `stretch_energies/stable_neo_hookean.py`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.materials.lame import lame_from_engineering
from supple.materials.material import Elastic
from supple.materials.stretch_energies import stable_neo_hookean


@dataclass(frozen=True, eq=False, kw_only=True)
class StableNeoHookean(Elastic):
    """Stable Neo-Hookean: finite for inverted elements, which can recover.

    Its linearization at rest has the first Lamé parameter lam - mu, so lam = lam_L + mu_L gives small strains the
    Young's modulus and Poisson's ratio of the user.
    """

    stretch_functions = stable_neo_hookean.FUNCTIONS

    def lame_parameters(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        mu, lam = lame_from_engineering(self.youngs, self.poisson)
        return mu, lam + mu
