"""Metal plasticity at finite strain."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from supple.errors import SceneError
from supple.kinds.validators import NON_NEGATIVE, POSITIVE, NumberPerTet
from supple.materials.laws.hencky import HENCKY
from supple.materials.laws.j2 import J2_FLOW
from supple.materials.material import POISSON, Hyperelastic, lame_from_engineering
from supple.materials.per_tet import BY_LAW, LawTets, TetMaterial, one_per_tet


@dataclass(frozen=True, eq=False, kw_only=True)
class J2Plastic(Hyperelastic):
    """Elastic-plastic with the yield condition of von Mises and isotropic hardening; rate-independent.

    F = F_e F_p. The energy is quadratic in the logarithmic elastic strains; the yield stress (of Kirchhoff's stress) is
    Y(a) = yield_stress + hardening a + (saturation_stress - yield_stress) (1 - exp(-saturation_rate a)), with the
    accumulated plastic strain a. Flow keeps the volume. `Implicit` only.

    Parameters
    ----------
    youngs : E [Pa]; poisson : nu [-], above -1 and below 0.5. One number, or one per tetrahedron, as all others.
    yield_stress : at first yield [Pa], above zero.
    hardening : H [Pa], zero or more.
    saturation_stress : [Pa], at least `yield_stress`; None: as `yield_stress`.
    saturation_rate : delta [-], zero or more.

    Raises
    ------
    SceneError : where a value is out of range.

    Source: Simo, "Algorithms for static and dynamic multiplicative plasticity that preserve the classical return
    mapping schemes of the infinitesimal theory" (1992).
    """

    youngs: Annotated[float | NDArray[np.float64], NumberPerTet(POSITIVE)]
    poisson: Annotated[float | NDArray[np.float64], NumberPerTet(POISSON)]
    yield_stress: Annotated[float | NDArray[np.float64], NumberPerTet(POSITIVE)]
    hardening: Annotated[float | NDArray[np.float64], NumberPerTet(NON_NEGATIVE)] = 0.0
    saturation_stress: Annotated[float | NDArray[np.float64] | None, NumberPerTet(POSITIVE)] = None
    saturation_rate: Annotated[float | NDArray[np.float64], NumberPerTet(NON_NEGATIVE)] = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.saturation_stress is None:
            object.__setattr__(self, "saturation_stress", self.yield_stress)
        if (np.asarray(self.saturation_stress) < np.asarray(self.yield_stress)).any():
            raise SceneError("J2Plastic: saturation_stress is below yield_stress; give one that is not")

    def per_tet(self, n_tets: int) -> TetMaterial:
        mu, lam = lame_from_engineering(self.youngs, self.poisson)
        keys = ("yield_stress", "hardening", "saturation_stress", "saturation_rate")
        given = [("youngs", lam + 2.0 * mu / 3.0), ("youngs", mu), *((key, getattr(self, key)) for key in keys)]
        columns = [one_per_tet(value, n_tets, f"J2Plastic: {key}") for key, value in given]
        basis = self._tet_material(n_tets, BY_LAW, mu, lam)
        return basis.with_laws(LawTets(HENCKY, np.arange(n_tets), np.column_stack(columns), J2_FLOW))
