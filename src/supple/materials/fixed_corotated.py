"""Fixed corotated elasticity as a material; the energy is in `stretch_energies/fixed_corotated.py`."""

from dataclasses import dataclass

from supple.materials.material import Elastic
from supple.materials.stretch_energies import fixed_corotated


@dataclass(frozen=True, eq=False, kw_only=True)
class FixedCorotated(Elastic):
    """Fixed corotated: stress linear in the stretches, with a volume term that is finite for inverted elements."""

    stretch_functions = fixed_corotated.FUNCTIONS
