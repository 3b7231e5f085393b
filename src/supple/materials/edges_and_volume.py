"""The classic XPBD soft body: distance constraints on edges, volume constraints on tetrahedra."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from supple.kinds.forms import NON_NEGATIVE, NumberPerTet
from supple.materials.material import Material
from supple.materials.per_tet import NOT_ELASTIC, TetMaterial


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
