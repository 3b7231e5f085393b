"""St. Venant-Kirchhoff elasticity as a material; the energy is in `stretch_energies/st_venant_kirchhoff.py`."""

from dataclasses import dataclass

from supple.materials.material import Elastic
from supple.materials.stretch_energies import st_venant_kirchhoff


@dataclass(frozen=True, eq=False, kw_only=True)
class StVenantKirchhoff(Elastic):
    """St. Venant-Kirchhoff: quadratic in the Green strain. Under strong compression it becomes softer and collapses."""

    stretch_functions = st_venant_kirchhoff.FUNCTIONS
