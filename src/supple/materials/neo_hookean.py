"""Neo-Hookean elasticity with a logarithm as a material; the energy is in `stretch_energies/neo_hookean.py`."""

from dataclasses import dataclass

from supple.materials.material import Elastic
from supple.materials.stretch_energies import neo_hookean


@dataclass(frozen=True, eq=False, kw_only=True)
class NeoHookean(Elastic):
    """Neo-Hookean with a logarithm: the energy of an inverted element is infinite, so a body must start without any.

    `energy_density` is +inf for J <= 0; stress and Hessian do not exist there and are not-a-number.
    """

    stretch_functions = neo_hookean.FUNCTIONS
