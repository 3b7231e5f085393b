"""Base of the materials whose energy is a law with parameters of its own."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import SceneError
from supple.kinds.validators import POSITIVE, NumberPerTet
from supple.materials.material import Hyperelastic
from supple.materials.per_tet import BY_LAW, Law, LawTets, TetMaterial, one_per_tet


@dataclass(frozen=True, eq=False, kw_only=True)
class ByLaw(Hyperelastic):
    """A material with the energy of a `Law`.

    Parameters
    ----------
    bulk : bulk modulus K at rest [Pa]; one number, or one per tetrahedron.

    Attributes
    ----------
    shear_formula : the shear modulus at rest in terms of the parameters, for messages
    """

    shear_formula: ClassVar[str]

    bulk: Annotated[float | NDArray[np.float64], NumberPerTet(POSITIVE)]

    def __post_init__(self) -> None:
        super().__post_init__()
        self._check()
        mu = np.atleast_1d(self.rest_moduli()[0])
        if not (mu > 0.0).all():
            raise SceneError(
                f"{type(self).__name__}: the shear modulus at rest, {self.shear_formula}, is "
                f"{mu[~(mu > 0.0)][0]:g} Pa; give parameters with which it is above zero"
            )

    def _check(self) -> None:
        """Raise a SceneError where parameters do not suit each other."""

    @abstractmethod
    def rest_moduli(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Shear modulus and bulk modulus of small strains [Pa], scalars or per tet."""

    @abstractmethod
    def law(self) -> Law:
        """The energy."""

    @abstractmethod
    def law_parameters(self) -> tuple[tuple[str, ArrayLike], ...]:
        """The parameters of the law in its order, each with the name that messages have; scalars or per tet."""

    @property
    def youngs(self) -> float | NDArray[np.float64]:
        """Young's modulus of small strains [Pa]."""
        mu, bulk = self.rest_moduli()
        return 9.0 * bulk * mu / (3.0 * bulk + mu)

    @property
    def poisson(self) -> float | NDArray[np.float64]:
        """Poisson's ratio of small strains [-]."""
        mu, bulk = self.rest_moduli()
        return (3.0 * bulk - 2.0 * mu) / (6.0 * bulk + 2.0 * mu)

    def facts(self, scene: Any) -> str:
        return f"{super().facts(scene)} {small_strains(self)}"

    def per_tet(self, n_tets: int) -> TetMaterial:
        name = type(self).__name__
        columns = [one_per_tet(value, n_tets, f"{name}: {key}") for key, value in self.law_parameters()]
        mu, bulk = self.rest_moduli()
        basis = self._tet_material(n_tets, BY_LAW, mu, bulk - 2.0 * mu / 3.0)
        return basis.with_laws(LawTets(self.law(), np.arange(n_tets), np.column_stack(columns)))


def small_strains(material: Hyperelastic) -> str:
    """The moduli of small strains in words."""
    youngs, poisson = (
        " to ".join(f"{value:.6g}" for value in sorted({np.min(of_tets), np.max(of_tets)}))
        for of_tets in (material.youngs, material.poisson)
    )
    return f"(small strains: E = {youngs} Pa, nu = {poisson})"
