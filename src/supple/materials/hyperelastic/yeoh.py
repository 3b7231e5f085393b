"""The Yeoh material; the energy is in `laws/yeoh.py`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.kinds.forms import ANY_NUMBER, NumberPerTet
from supple.materials.hyperelastic.by_law import ByLaw
from supple.materials.laws.yeoh import YEOH
from supple.materials.per_tet import Law


@dataclass(frozen=True, eq=False, kw_only=True)
class Yeoh(ByLaw):
    """Yeoh: psi = c10 (I1 - 3) + c20 (I1 - 3)^2 + c30 (I1 - 3)^3 + K/2 (J - 1)^2, with I1 of F / J^(1/3).

    Parameters
    ----------
    c10 : [Pa], above zero; the shear modulus is 2 c10.
    c20, c30 : [Pa], of any sign. One number, or one per tetrahedron.
    bulk : bulk modulus K [Pa]. Where another program has D1, K = 2 / D1.

    Source: Yeoh, "Some forms of the strain energy function for rubber" (1993).
    """

    c10: Annotated[float | NDArray[np.float64], NumberPerTet(ANY_NUMBER)]
    c20: Annotated[float | NDArray[np.float64], NumberPerTet(ANY_NUMBER)] = 0.0
    c30: Annotated[float | NDArray[np.float64], NumberPerTet(ANY_NUMBER)] = 0.0

    shear_formula = "2 c10"

    def rest_moduli(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        return 2.0 * np.asarray(self.c10), np.asarray(self.bulk)

    def law(self) -> Law:
        return YEOH

    def law_parameters(self) -> tuple[tuple[str, ArrayLike], ...]:
        return ("bulk", self.bulk), ("c10", self.c10), ("c20", self.c20), ("c30", self.c30)
