"""The classic XPBD soft body: distance constraints on edges, volume constraints on tetrahedra."""

from __future__ import annotations

from dataclasses import dataclass

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

    edge_compliance: float = 0.0
    volume_compliance: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        self._require_finite("edge_compliance", positive=False, unit="m/N")
        self._require_finite("volume_compliance", positive=False, unit="m^5/N")

    def per_tet(self, n_tets: int) -> TetMaterial:
        return self._tet_material(n_tets, NOT_ELASTIC, 0.0, 0.0)
