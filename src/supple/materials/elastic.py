"""The elastic materials with two constants; the energy of each is a file in `stretch_energies/`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from supple.kinds.validators import NON_NEGATIVE, NumberPerTet
from supple.materials.material import Elastic, Material, lame_from_engineering
from supple.materials.per_tet import NOT_ELASTIC, TetMaterial
from supple.materials.stretch_energies import (
    arap,
    fixed_corotated,
    neo_hookean,
    st_venant_kirchhoff,
    stable_neo_hookean,
)


@dataclass(frozen=True, eq=False, kw_only=True)
class EdgesAndVolume(Material):
    """Edges of a given length and tetrahedra of a given volume, each with a compliance (inverse stiffness).

    A material for XPBD only: it has no energy density per unit of volume, and its stiffness depends on the mesh. To
    specify a Young's modulus, use `StableNeoHookean`.

    Parameters
    ----------
    edge_compliance : alpha of C = |x1 - x2| - l [m/N]; 0 is rigid.
    volume_compliance : alpha of C = V - V0 [m^5/N]; 0 keeps every tet's volume.

    Source: Macklin, Müller, Chentanez, "XPBD" (2016); Müller, "Simple and Unbreakable Simulation of Soft Bodies".
    """

    edge_compliance: Annotated[float, NumberPerTet(NON_NEGATIVE)] = 0.0
    volume_compliance: Annotated[float, NumberPerTet(NON_NEGATIVE)] = 0.0

    def per_tet(self, n_tets: int) -> TetMaterial:
        return self._tet_material(n_tets, NOT_ELASTIC, 0.0, 0.0)


@dataclass(frozen=True, eq=False, kw_only=True)
class ARAP(Elastic):
    """As-rigid-as-possible: squared distance to the nearest rotation, times mu = E / (2 (1 + nu)).

    The energy has no volume term: small strains behave as with a first Lamé parameter of 0, that is with Poisson's
    ratio 0 and Young's modulus 2 mu.
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


# Row k is the class whose energy has the kind k (see `kinds.py`).
ELASTIC_MATERIALS: tuple[type[Elastic], ...] = (StableNeoHookean, NeoHookean, FixedCorotated, ARAP, StVenantKirchhoff)
