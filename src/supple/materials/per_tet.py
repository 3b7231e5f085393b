"""A body's material as arrays with one row per tetrahedron, as solvers read it, for one material or several.

The energies of `stretch_energies` have two parameters and are compiled into the kernels of elements. All others are
laws: of many deformation gradients at once, they give energies, stresses and Hessians as arrays.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import SceneError

NOT_ELASTIC = -1
BY_LAW = -2
UNKNOWN = -1  # to kernels both are


class Law(ABC):
    """An energy per rest volume psi(F, p) of a deformation gradient and a row of parameters, zero at rest.

    Attributes
    ----------
    counts : numbers of parameters that a row may have
    infinite_when_flat : whether psi goes to infinity wherever J goes to zero. No law has an energy for J <= 0.
    bulk : the parameter K of the law, where psi has the volume term K/2 (J - 1)^2, of which quadratic tets average J.
        None where none exists.
    """

    counts: range
    infinite_when_flat: bool = False
    bulk: int | None = None

    @abstractmethod
    def densities(self, F: NDArray[np.float64], p: NDArray[np.float64]) -> NDArray[np.float64]:
        """(k,) psi [Pa] of F (k, 3, 3) and parameters p (k, q); infinite for J <= 0."""

    @abstractmethod
    def models(
        self, F: NDArray[np.float64], p: NDArray[np.float64], second: bool, project: bool
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """psi (k,), P = d psi / dF (k, 3, 3) and, with `second`, its Hessian (k, 9, 9), else (0, 9, 9) [Pa].

        Entry (3 i + j, 3 k + l) of a Hessian is d^2 psi / (dF_ij dF_kl). With `project` it is positive semi-definite.
        """


class Flow(ABC):
    """How the inelastic part F_i of F = F_e F_i changes; the law is one of F_e.

    A row of internal variables is F_i^-1 (nine numbers, row after row), a measure of all flow so far, and the energy
    that was dissipated per rest volume [J/m^3].

    Attributes
    ----------
    step_law : whose derivative by the trial F_e, that without flow in the step, is the stress at the step's end
    """

    step_law: Law

    @abstractmethod
    def step_parameters(self, p: NDArray[np.float64], internal: NDArray[np.float64], h: float) -> NDArray[np.float64]:
        """Parameters of `step_law` for a step of h [s], from those of the law (k, q) and internal variables (k, 11)."""

    @abstractmethod
    def advanced(
        self, F: NDArray[np.float64], p: NDArray[np.float64], internal: NDArray[np.float64], h: float
    ) -> NDArray[np.float64]:
        """(k, 11) the internal variables at the end of a step of h [s] to the trial F_e (k, 3, 3)."""

    def stored_at_yield(self, p: NDArray[np.float64]) -> NDArray[np.float64] | None:
        """(k,) the energy of distortion at which permanent flow begins [J/m^3]; None for flow that recovers."""
        return None


@dataclass(frozen=True, eq=False)
class LawTets:
    """Tets with one law. A tet may have several, whose energies are added.

    Attributes
    ----------
    rows : (k,) numbers of the tets
    parameters : (k, q) of the law
    flow : how the tets flow; None where they are elastic
    points : at how many points of each tet the law is evaluated; what flows has internal variables at each of them
    """

    law: Law
    rows: NDArray[np.int64]
    parameters: NDArray[np.float64]
    flow: Flow | None = None
    points: int = 1

    def of(self, rows: NDArray[np.int64], parameters: NDArray[np.float64]) -> LawTets:
        """The same law for other tets."""
        return replace(self, rows=rows, parameters=np.ascontiguousarray(parameters))

    def shifted(self, by: int) -> LawTets:
        """The same tets, with numbers that are larger by this."""
        return replace(self, rows=self.rows + by)

    def selected(self, chosen: NDArray[np.bool_]) -> LawTets:
        """Those of the tets that are `chosen` (m,), with the same numbers."""
        keep = chosen[self.rows]
        return replace(self, rows=self.rows[keep], parameters=np.ascontiguousarray(self.parameters[keep]))


@dataclass(frozen=True, eq=False)
class TetMaterial:
    """Material parameters of m tets.

    Attributes
    ----------
    density : (m,) [kg/m^3]; damping : (m,) Kelvin-Voigt time [s]
    kind : (m,) int32, the row of `kinds.STRETCH_ENERGIES`, `BY_LAW` or `NOT_ELASTIC`
    mu, lam : (m,) parameters of each material's energy density [Pa]; of tets `BY_LAW` the Lamé parameters at rest
    laws : whose energies are added to those of `kind`; tets `BY_LAW` have no other
    """

    density: NDArray[np.float64]
    damping: NDArray[np.float64]
    kind: NDArray[np.int32]
    mu: NDArray[np.float64]
    lam: NDArray[np.float64]
    laws: tuple[LawTets, ...] = ()

    @property
    def elastic_laws(self) -> tuple[LawTets, ...]:
        """Those that do not flow."""
        return tuple(tets for tets in self.laws if tets.flow is None)

    @property
    def flowing_laws(self) -> tuple[tuple[LawTets, slice], ...]:
        """Those that flow, each with its rows of the internal variables: point after point, tet after tet."""
        laws: list[tuple[LawTets, slice]] = []
        begin = 0
        for tets in self.laws:
            if tets.flow is not None:
                laws.append((tets, slice(begin, begin + len(tets.rows) * tets.points)))
                begin = laws[-1][1].stop
        return tuple(laws)

    def with_laws(self, *laws: LawTets) -> TetMaterial:
        """These tets with more laws."""
        return replace(self, laws=(*self.laws, *laws))


def one_per_tet(value: ArrayLike, n_tets: int, what: str) -> NDArray[np.float64]:
    """`value` as (n_tets,) float64; one number is repeated.

    Raises
    ------
    SceneError : where there is another number of values.
    """
    values = np.asarray(value, dtype=np.float64)
    if values.ndim and values.shape != (n_tets,):
        raise SceneError(f"{what} has {values.size} values for {n_tets} tets; give one number, or one per tet")
    return np.ascontiguousarray(np.broadcast_to(values, n_tets))
