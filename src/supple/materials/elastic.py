"""The elastic materials with two constants; the energy of each is a file in `stretch_energies/`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.materials.material import Elastic, lame_from_engineering
from supple.materials.stretch_energies import (
    arap,
    fixed_corotated,
    neo_hookean,
    st_venant_kirchhoff,
    stable_neo_hookean,
)


@dataclass(frozen=True, eq=False, kw_only=True)
class ARAP(Elastic):
    """As-rigid-as-possible: squared distance to the nearest rotation, times mu = E / (2 (1 + nu)).

    There is no volume term: small strains behave as with a first Lamé parameter of 0, that is with Poisson's ratio 0
    and Young's modulus 2 mu.
    """

    stretch_functions = arap.FUNCTIONS


@dataclass(frozen=True, eq=False, kw_only=True)
class FixedCorotated(Elastic):
    """Fixed corotated: stress linear in the stretches, with a volume term that is finite for inverted elements."""

    stretch_functions = fixed_corotated.FUNCTIONS


@dataclass(frozen=True, eq=False, kw_only=True)
class NeoHookean(Elastic):
    """Neo-Hookean with a logarithm: the energy of an inverted element is infinite, so a body must start without any.

    `energy_density` is +inf for J <= 0; stress and Hessian do not exist there and are not-a-number.
    """

    stretch_functions = neo_hookean.FUNCTIONS


@dataclass(frozen=True, eq=False, kw_only=True)
class StVenantKirchhoff(Elastic):
    """St. Venant-Kirchhoff: quadratic in the Green strain. Under strong compression it becomes softer and collapses."""

    stretch_functions = st_venant_kirchhoff.FUNCTIONS


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
