"""Rubber: the materials of Mooney and Rivlin, of Ogden, and of Yeoh; their energies are in `laws/`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import SceneError
from supple.kinds.validators import ANY_NUMBER, ListOf, NumberPerTet
from supple.materials.by_law import ByLaw
from supple.materials.laws.ogden import OGDEN
from supple.materials.laws.yeoh import YEOH
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


@dataclass(frozen=True, eq=False, kw_only=True)
class Ogden(ByLaw):
    """Ogden: psi = sum_k mu_k / alpha_k (t_0^alpha_k + t_1^alpha_k + t_2^alpha_k - 3) + K/2 (J - 1)^2.

    t_i = J^(-1/3) s_i are the stretches without the change of volume. The shear modulus is sum mu_k alpha_k / 2.

    Parameters
    ----------
    mu : one number for each term [Pa], of any sign. Programs that write 2 mu / alpha^2 for mu / alpha have
        other mu: give 2 mu / alpha of theirs.
    alpha : one exponent for each term [-], not zero.
    bulk : bulk modulus K [Pa]. Where another program has D1, K = 2 / D1.

    Raises
    ------
    SceneError : where mu and alpha are not equally many finite numbers, or the shear modulus is not above zero.

    Source: Ogden, "Large deformation isotropic elasticity" (1972).
    """

    mu: Annotated[Sequence[float], ListOf(most=9)]
    alpha: Annotated[Sequence[float], ListOf(most=9)]

    shear_formula = "sum mu alpha / 2"

    def _check(self) -> None:
        for field in ("mu", "alpha"):
            try:
                values = np.asarray(getattr(self, field), dtype=np.float64)
            except (TypeError, ValueError):
                values = np.zeros((0, 0))
            if values.ndim != 1 or not len(values) or not np.isfinite(values).all():
                raise SceneError(f"Ogden: {field} is {getattr(self, field)!r}; give a list of finite numbers")
            object.__setattr__(self, field, tuple(values.tolist()))
        if len(self.mu) != len(self.alpha):
            raise SceneError(f"Ogden: {len(self.mu)} mu and {len(self.alpha)} alpha; give one of each for every term")
        if 0.0 in self.alpha:
            raise SceneError("Ogden: an alpha is 0; give exponents that are not zero")

    def rest_moduli(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        return np.asarray(0.5 * np.dot(self.mu, self.alpha)), np.asarray(self.bulk)

    def law(self) -> Law:
        return OGDEN

    def law_parameters(self) -> tuple[tuple[str, ArrayLike], ...]:
        terms = [
            (name, value)
            for pair in zip(self.mu, self.alpha, strict=True)
            for name, value in zip(("mu", "alpha"), pair, strict=True)
        ]
        return (("bulk", self.bulk), *terms)


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
