"""Base classes of materials: density, damping, engineering constants, and the checks of what a user gives."""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import SceneError
from supple.kinds.kind import Kind
from supple.kinds.validators import NON_NEGATIVE, POSITIVE, Name, Number, NumberPerTet
from supple.materials.kinds import STRETCH_ENERGIES
from supple.materials.laws.internal import add_resting_densities, add_resting_hessians, add_resting_piolas
from supple.materials.laws.pointwise import densities_at, hessians_at, piolas_at
from supple.materials.per_tet import NOT_ELASTIC, TetMaterial, one_per_tet
from supple.materials.stretch_energies.stretches import StretchFunctions


def lame_from_engineering(youngs: ArrayLike, poisson: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lamé parameters of a linear isotropic material.

    Parameters
    ----------
    youngs : Young's modulus E [Pa], scalar or array.
    poisson : Poisson's ratio nu [-], scalar or array, below 0.5.

    Returns
    -------
    mu, lam : shear modulus mu_L and first Lamé parameter lam_L [Pa].
    """
    E = np.asarray(youngs, dtype=np.float64)
    nu = np.asarray(poisson, dtype=np.float64)
    mu = E / (2.0 * (1.0 + nu))
    lam = E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))
    return mu, lam


POISSON = Number(above=-1.0, below=0.5)


@dataclass(frozen=True, eq=False, kw_only=True)
class Material(Kind, ABC):
    """Base of all materials.

    Parameters
    ----------
    density : mass density at rest [kg/m^3], above zero.
    damping : Kelvin-Voigt time tau [s]: the stress at strain e and strain rate e' is that of strain e + tau e'.
        Acts on deformation only, never on rigid motion.

    Raises
    ------
    SceneError : where a value is not finite or out of range.
    """

    density: Annotated[float, NumberPerTet(POSITIVE)] = 1000.0
    damping: Annotated[float, NumberPerTet(NON_NEGATIVE)] = 0.0

    def __init_subclass__(cls) -> None:
        """In scene files, StableNeoHookean is stable_neo_hookean."""
        cls.kind = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", cls.__name__).lower()

    @property
    def label(self) -> str:
        """The name of the material in messages."""
        return type(self).__name__

    def facts(self, scene: Any) -> str:
        """Its class, with the moduli of small strains where other parameters were given."""
        return type(self).__name__

    @property
    def otherwise(self) -> Material | None:
        """What stands for a material of a user in a recording, where its class is not known."""
        name = type(self).__name__
        ours = type(self).__module__.startswith("supple.")
        return None if ours else NotRecorded(name=name, density=self.density, damping=self.damping)

    @abstractmethod
    def per_tet(self, n_tets: int) -> TetMaterial:
        """The parameters of this material, one row per tet of a body.

        Parameters
        ----------
        n_tets : number of tets of the body's mesh.

        Raises
        ------
        SceneError : where a parameter is given per tet, for another number of tets.
        """

    def _tet_material(self, n_tets: int, kind: int, mu: ArrayLike, lam: ArrayLike) -> TetMaterial:
        name = type(self).__name__
        return TetMaterial(
            density=one_per_tet(self.density, n_tets, f"{name}: density"),
            damping=one_per_tet(self.damping, n_tets, f"{name}: damping"),
            kind=np.full(n_tets, kind, dtype=np.int32),
            mu=one_per_tet(mu, n_tets, f"{name}: mu"),
            lam=one_per_tet(lam, n_tets, f"{name}: lam"),
        )


@dataclass(frozen=True, eq=False, kw_only=True)
class NotRecorded(Material):
    """The material of a recorded body whose law the recording does not have.

    Parameters
    ----------
    name : of the class that the body was simulated with
    """

    name: Annotated[str, Name()]

    def per_tet(self, n_tets: int) -> TetMaterial:
        return self._tet_material(n_tets, NOT_ELASTIC, 0.0, 0.0)


@dataclass(frozen=True, eq=False, kw_only=True)
class Hyperelastic(Material):
    """Base of the materials with an energy per rest volume, of which stresses are the derivative.

    Attributes
    ----------
    youngs, poisson : Young's modulus [Pa] and Poisson's ratio [-] of small strains; one number, or one per tet
    """

    if TYPE_CHECKING:  # fields of some materials, properties of others

        @property
        def youngs(self) -> float | NDArray[np.float64]: ...
        @property
        def poisson(self) -> float | NDArray[np.float64]: ...

    def energy_density(self, F: ArrayLike) -> NDArray[np.float64]:
        """Strain energy per rest volume, zero at rest.

        Parameters
        ----------
        F : (..., 3, 3) deformation gradients; (m, 3, 3) where parameters are given per tet.

        Returns
        -------
        (...) energy densities [Pa].
        """
        return self._evaluated((densities_at, add_resting_densities), F, ())

    def first_piola(self, F: ArrayLike) -> NDArray[np.float64]:
        """First Piola-Kirchhoff stress P = d psi / d F.

        Parameters
        ----------
        F : (..., 3, 3) deformation gradients; (m, 3, 3) where parameters are given per tet.

        Returns
        -------
        (..., 3, 3) stresses [Pa].
        """
        return self._evaluated((piolas_at, add_resting_piolas), F, (3, 3))

    def hessian(self, F: ArrayLike, project: bool = False) -> NDArray[np.float64]:
        """Second derivative of the energy density, H[3 i + j, 3 k + l] = d^2 psi / (dF_ij dF_kl).

        Parameters
        ----------
        F : (..., 3, 3) deformation gradients; (m, 3, 3) where parameters are given per tet.
        project : return the nearest positive semi-definite matrix instead (negative eigenvalues become 0).

        Returns
        -------
        (..., 9, 9) symmetric [Pa].
        """
        return self._evaluated((hessians_at, add_resting_hessians), F, (9, 9), bool(project))

    def _evaluated(
        self,
        functions: tuple[Callable[..., NDArray[np.float64]], Callable[..., None]],
        F: ArrayLike,
        shape: tuple[int, ...],
        *options: Any,
    ) -> NDArray[np.float64]:
        """What functions compute of every F, an array of that shape each: of elastic tets, and of what may flow."""
        function, add_flow = functions
        F = np.asarray(F, dtype=np.float64)
        if F.shape[-2:] != (3, 3):
            raise SceneError(f"F has shape {F.shape}; its last two axes must be (3, 3)")
        flat = np.ascontiguousarray(F.reshape(-1, 3, 3))
        tets = self.per_tet(len(flat))
        out = function(tets, flat, *options)
        add_flow(tets, flat, *options, out)
        return out.reshape(F.shape[:-2] + shape)


@dataclass(frozen=True, eq=False, kw_only=True)
class Elastic(Hyperelastic):
    """A hyperelastic material given by its engineering constants.

    Parameters
    ----------
    youngs : Young's modulus E of small strains [Pa]; one number, or one per tetrahedron of the body.
    poisson : Poisson's ratio nu [-], above -1 and below 0.5; one number, or one per tetrahedron. Below 0
        (auxetic), some energies have no lower bound at large strains; see docs/reference/materials.md.

    Raises
    ------
    SceneError : where a value is not finite or out of range.
    """

    stretch_functions: ClassVar[StretchFunctions]

    youngs: Annotated[float | NDArray[np.float64], NumberPerTet(POSITIVE)]
    poisson: Annotated[float | NDArray[np.float64], NumberPerTet(POISSON)]

    @classmethod
    def energy_kind(cls) -> int:
        """The number by which kernels know the energy of this class.

        Raises
        ------
        SceneError : where the energy is not among those that the kernels are compiled for.
        """
        for kind, energy in enumerate(STRETCH_ENERGIES):
            if energy is cls.stretch_functions:
                return kind
        raise SceneError(
            f"{cls.__name__}: its energy is not registered; add it to STRETCH_ENERGIES of supple.materials.kinds"
        )

    def lame_parameters(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The mu and lam [Pa] of this material's energy density (scalars or per tet)."""
        return lame_from_engineering(self.youngs, self.poisson)

    def per_tet(self, n_tets: int) -> TetMaterial:
        name = type(self).__name__
        one_per_tet(self.youngs, n_tets, f"{name}: youngs")
        one_per_tet(self.poisson, n_tets, f"{name}: poisson")
        return self._tet_material(n_tets, self.energy_kind(), *self.lame_parameters())
