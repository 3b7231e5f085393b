"""As-rigid-as-possible elasticity as a material; the energy is in `stretch_energies/arap.py`."""

from dataclasses import dataclass

from supple.materials.material import Elastic
from supple.materials.stretch_energies import arap


@dataclass(frozen=True, eq=False, kw_only=True)
class ARAP(Elastic):
    """As-rigid-as-possible: squared distance to the nearest rotation, times mu = E / (2 (1 + nu)).

    There is no volume term: small strains behave as with a first Lamé parameter of 0, that is with Poisson's ratio 0
    and Young's modulus 2 mu.
    """

    stretch_functions = arap.FUNCTIONS
