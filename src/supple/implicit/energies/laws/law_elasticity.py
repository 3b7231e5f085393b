"""Elastic energy of tets whose materials are laws with parameters of their own; see `materials.laws`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.implicit.energies.potential import HessianBlocks, Potential, Projection
from supple.materials.laws.elements import element_forces, element_stiffness
from supple.materials.per_tet import Law
from supple.numerics.deformation import deformation_gradients
from supple.numerics.threads import threads_for

_SERIAL_TETS = 2_000


@dataclass(frozen=True, eq=False)
class LawElements:
    """The tets of one law.

    Attributes
    ----------
    rows : (k,) which of the system's tets these are; tets : (k, 4); volumes : (k,) [m^3]
    B : (k, 3, 3) with F = Ds B [1/m]
    parameters : (k, q) of the law
    """

    law: Law
    rows: NDArray[np.int64]
    tets: NDArray[np.int32]
    B: NDArray[np.float64]
    volumes: NDArray[np.float64]
    parameters: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class LawElasticity(Potential):
    """The sum of V psi(F) over all tets of all laws."""

    elements: tuple[LawElements, ...]
    label = "elasticity"
    projection = Projection.RELEASED_FIRST

    def value(self, x: NDArray[np.float64]) -> float:
        return float(sum(energies.sum() for _, energies in self.energies(x)))

    def energies(self, x: NDArray[np.float64]) -> list[tuple[NDArray[np.int64], NDArray[np.float64]]]:
        """Of each law the numbers of its tets, and their energies [J]."""
        found = []
        for each in self.elements:
            F = deformation_gradients(x, each.tets, each.B)
            found.append((each.rows, each.volumes * each.law.densities(F, each.parameters)))
        return found

    def add_gradient(self, x: NDArray[np.float64], out: NDArray[np.float64]) -> None:
        self.add_model(x, out, None, project=False)

    def add_hessian(self, x: NDArray[np.float64], out: HessianBlocks, project: bool) -> None:
        self.add_model(x, np.zeros_like(x), out, project)

    def add_model(
        self, x: NDArray[np.float64], gradient: NDArray[np.float64], hessian: HessianBlocks | None, project: bool
    ) -> float:
        total = 0.0
        for each in self.elements:
            F = deformation_gradients(x, each.tets, each.B)
            psi, P, H = each.law.models(F, each.parameters, hessian is not None, project)
            total += float((each.volumes * psi).sum())
            forces = np.empty((len(psi), 4, 3))
            with threads_for(len(psi), _SERIAL_TETS):
                element_forces(P, each.B, each.volumes, forces)
                if hessian is not None:
                    blocks = np.empty((len(psi), 12, 12))
                    element_stiffness(H, each.B, each.volumes, blocks)
                    hessian.tets[each.rows] += blocks
            for k in range(3):
                weights = forces[:, :, k].ravel()
                gradient[:, k] += np.bincount(each.tets.ravel(), weights=weights, minlength=len(gradient))
        return total
