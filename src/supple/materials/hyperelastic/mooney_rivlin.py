"""The Mooney-Rivlin material; the energy is a case of that in `laws/ogden.py`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.kinds.forms import ANY_NUMBER, NumberPerTet
from supple.materials.hyperelastic.by_law import ByLaw
from supple.materials.laws.ogden import OGDEN
from supple.materials.per_tet import Law


@dataclass(frozen=True, eq=False, kw_only=True)
class MooneyRivlin(ByLaw):
    """Mooney-Rivlin: psi = c10 (I1 - 3) + c01 (I2 - 3) + K/2 (J - 1)^2, with I1 and I2 of F / J^(1/3).

    Parameters
    ----------
    c10, c01 : [Pa], of any sign, with a shear modulus 2 (c10 + c01) above zero; one number, or one per tetrahedron.
    bulk : bulk modulus K [Pa]. Where another program has D1, K = 2 / D1.

    Source: Mooney, "A theory of large elastic deformation" (1940); Rivlin, "Large elastic deformations of isotropic
    materials IV" (1948).
    """

    c10: Annotated[float | NDArray[np.float64], NumberPerTet(ANY_NUMBER)]
    c01: Annotated[float | NDArray[np.float64], NumberPerTet(ANY_NUMBER)] = 0.0

    shear_formula = "2 (c10 + c01)"

    def rest_moduli(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        return 2.0 * (np.asarray(self.c10) + np.asarray(self.c01)), np.asarray(self.bulk)

    def law(self) -> Law:
        return OGDEN

    def law_parameters(self) -> tuple[tuple[str, ArrayLike], ...]:
        # mu/alpha = c10 where alpha = 2, and c01 where alpha = -2.
        c10, c01 = 2.0 * np.asarray(self.c10), -2.0 * np.asarray(self.c01)
        return ("bulk", self.bulk), ("c10", c10), ("alpha", 2.0), ("c01", c01), ("alpha", -2.0)
