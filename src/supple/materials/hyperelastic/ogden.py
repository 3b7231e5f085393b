"""The Ogden material; the energy is in `laws/ogden.py`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import SceneError
from supple.kinds.forms import ListOf
from supple.materials.hyperelastic.by_law import ByLaw
from supple.materials.laws.ogden import OGDEN
from supple.materials.per_tet import Law


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
