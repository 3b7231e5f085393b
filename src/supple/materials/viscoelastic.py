"""Viscoelastic materials: any hyperelastic one, with a Prony series."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from supple.errors import SceneError
from supple.kinds.validators import ListOf, OneOf
from supple.materials.by_law import small_strains
from supple.materials.elastic import ELASTIC_MATERIALS
from supple.materials.guccione import Guccione
from supple.materials.holzapfel_gasser_ogden import HolzapfelGasserOgden
from supple.materials.isotropic import rest_lame_parameters
from supple.materials.j2_plastic import J2Plastic
from supple.materials.laws.hencky import MAXWELL
from supple.materials.laws.maxwell import MAXWELL_FLOW
from supple.materials.material import Hyperelastic
from supple.materials.own.energy_material import EnergyMaterial
from supple.materials.per_tet import LawTets, TetMaterial
from supple.materials.rubber import MooneyRivlin, Ogden, Yeoh

# Those that neither relax nor flow.
UNRELAXED: tuple[type[Hyperelastic], ...] = (
    *ELASTIC_MATERIALS,
    MooneyRivlin,
    Yeoh,
    Ogden,
    HolzapfelGasserOgden,
    Guccione,
    EnergyMaterial,
)


@dataclass(frozen=True, eq=False, kw_only=True)
class Viscoelastic(Hyperelastic):
    """A hyperelastic material with Maxwell elements beside it, whose stress relaxes as a Prony series.

    The shear modulus relaxes as G(t) = G0 (1 - sum g_k (1 - exp(-t / T_k))). `material` has the energy that is left
    after a long time, of the shear modulus G0 (1 - sum g_k); each element is a spring of g_k G0 that is quadratic in
    the logarithmic strains, in series with a dashpot. The bulk modulus does not relax. `Implicit` only.

    Parameters
    ----------
    material : hyperelastic, of any class; its density and damping are those of the whole.
    prony : pairs (g_k, T_k): share of the shear modulus at once, above 0, with a sum below 1; time [s], above 0.

    Raises
    ------
    SceneError : where a value is out of range.

    Source: Reese, Govindjee, "A theory of finite viscoelasticity and numerical aspects" (1998).
    """

    material: Annotated[Hyperelastic, OneOf(UNRELAXED, "a hyperelastic one", Hyperelastic)]
    prony: Annotated[Sequence[tuple[float, float]], ListOf(("pairs",), most=20)]
    density: float = field(init=False)
    damping: float = field(init=False)

    def __post_init__(self) -> None:
        if not isinstance(self.material, Hyperelastic) or isinstance(self.material, (Viscoelastic, J2Plastic)):
            raise SceneError(f"Viscoelastic: material is a {type(self.material).__name__}; give a hyperelastic one")
        for key in ("density", "damping"):
            object.__setattr__(self, key, getattr(self.material, key))
        super().__post_init__()
        pairs = _numbers(self.prony)
        if pairs.ndim != 2 or pairs.shape[1] != 2:
            raise SceneError("Viscoelastic: prony is not a list of pairs (share of the shear modulus, time [s])")
        if not (np.isfinite(pairs) & (pairs > 0.0)).all():
            raise SceneError("Viscoelastic: prony has a share or a time that is not above zero and finite")
        if not pairs[:, 0].sum() < 1.0:
            raise SceneError(f"Viscoelastic: the shares of prony add up to {pairs[:, 0].sum():g}; it must be below 1")
        object.__setattr__(self, "prony", tuple((share, time) for share, time in pairs.tolist()))

    def facts(self, scene: Any) -> str:
        return f"{super().facts(scene)} {type(self.material).__name__} {small_strains(self)}"

    @property
    def youngs(self) -> float | NDArray[np.float64]:
        """Young's modulus of small strains after a long time [Pa]."""
        return self.material.youngs

    @property
    def poisson(self) -> float | NDArray[np.float64]:
        """Poisson's ratio of small strains after a long time [-]."""
        return self.material.poisson

    def per_tet(self, n_tets: int) -> TetMaterial:
        basis = self.material.per_tet(n_tets)
        at_once = rest_lame_parameters(basis)[0] / (1.0 - sum(g for g, _ in self.prony))
        rows, zero = np.arange(n_tets), np.zeros(n_tets)
        elements = (np.column_stack([zero, g * at_once, np.full(n_tets, time)]) for g, time in self.prony)
        return basis.with_laws(*(LawTets(MAXWELL, rows, p, MAXWELL_FLOW) for p in elements))


def _numbers(value: object) -> NDArray[np.float64]:
    try:
        return np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        return np.zeros(0)
