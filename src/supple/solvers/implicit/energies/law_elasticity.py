"""Elastic energy of tets whose materials are laws with parameters of their own; see `materials.laws`.

With B = Dm^-1, whose rows are the shape gradients g_1, g_2, g_3 and g_0 = -(g_1 + g_2 + g_3): the gradient by node p is
V P g_p, and block (p, q) of the Hessian has the entries V sum_jl H_(ij)(kl) g_p,j g_q,l.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from supple.materials.laws.internal import inverse_flow
from supple.materials.laws.isotropic_law import IsotropicLaw
from supple.materials.per_tet import Flow, Law, LawTets
from supple.materials.tet_energies import put_gradient
from supple.numerics.deformation import deformation_gradients
from supple.numerics.mat3 import load_mat
from supple.runtime.kernel_cache import njit, prange
from supple.solvers.implicit.energies.potential import HessianBlocks, JointlyEvaluated, Projection

NO_PRESSURES = np.zeros(0)


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

    @classmethod
    def of(
        cls,
        part: LawTets,
        tets: NDArray[np.int32],
        Dm_inv: NDArray[np.float64],
        volumes: NDArray[np.float64],
    ) -> LawElements:
        """Those of `part`, from the arrays of all tets of a system."""
        rows = part.rows
        chosen = np.ascontiguousarray(tets[rows]), np.ascontiguousarray(Dm_inv[rows]), volumes[rows]
        return cls(part.law, rows, *chosen, part.parameters)


@dataclass(frozen=True, eq=False)
class LawElasticity(JointlyEvaluated):
    """The sum of V psi(F) over all tets of all laws.

    Attributes
    ----------
    elements : of laws that do not flow, and in a step of those that do
    flowing : of laws that flow, with the flow and the rows of its internal variables
    """

    elements: tuple[LawElements, ...]
    flowing: tuple[tuple[LawElements, Flow, slice], ...] = ()
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

    def in_step(self, internal: NDArray[np.float64], h: float) -> LawElasticity:
        """The energy of a step of h [s] from these internal variables: flow makes F_e = Ds B F_i^-1 the trial one."""
        stepping = []
        for each, flow, rows in self.flowing:
            p = flow.step_parameters(each.parameters, internal[rows], h)
            B = np.ascontiguousarray(each.B @ inverse_flow(internal[rows]))
            stepping.append(replace(each, law=flow.step_law, B=B, parameters=np.ascontiguousarray(p)))
        return replace(self, elements=(*self.elements, *stepping), flowing=())

    def flowed(self, x: NDArray[np.float64], internal: NDArray[np.float64], h: float) -> NDArray[np.float64]:
        """The internal variables at the end of a step of h [s] to x (n, 3)."""
        after = internal.copy()
        for each, flow, rows in self.flowing:
            F = deformation_gradients(x, each.tets, np.ascontiguousarray(each.B @ inverse_flow(internal[rows])))
            after[rows] = flow.advanced(F, each.parameters, internal[rows], h)
        return after

    def add_model(
        self,
        x: NDArray[np.float64],
        gradient: NDArray[np.float64],
        hessian: HessianBlocks | None,
        project: bool,
        pressures: NDArray[np.float64] = NO_PRESSURES,
    ) -> float:
        """See `Elasticity.add_model`; laws with a bulk modulus take the pressures (m,) of all tets."""
        total = 0.0
        for each in self.elements:
            F = deformation_gradients(x, each.tets, each.B)
            arguments = F, each.parameters, hessian is not None, project
            if len(pressures) and isinstance(each.law, IsotropicLaw) and each.law.bulk is not None:
                psi, P, H = each.law.models(*arguments, pressures[each.rows])
            else:
                psi, P, H = each.law.models(*arguments)
            total += float((each.volumes * psi).sum())
            forces = np.empty((len(psi), 4, 3))
            element_forces(P, each.B, each.volumes, forces)
            if hessian is not None:
                blocks = np.empty((len(psi), 12, 12))
                element_stiffness(H, each.B, each.volumes, blocks)
                hessian.tets[each.rows] += blocks
            for k in range(3):
                weights = forces[:, :, k].ravel()
                gradient[:, k] += np.bincount(each.tets.ravel(), weights=weights, minlength=len(gradient))
        return total


@njit(parallel=True, cache=True)
def element_forces(P, B, volumes, out):
    """The gradients (k, 4, 3) by the nodes [N] of stresses P (k, 3, 3), with B (k, 3, 3) and volumes (k,)."""
    for e in prange(len(P)):
        put_gradient(load_mat(P, e), load_mat(B, e), volumes[e], out, e)


@njit(parallel=True, cache=True)
def element_stiffness(H, B, volumes, out):
    """The Hessians (k, 12, 12) by the nodes [N/m] of Hessians H (k, 9, 9) by F."""
    for e in prange(len(H)):
        half = np.empty((9, 9))  # (3 i + j, 3 q + k): contracted with g_q
        for a in range(9):
            for q in range(3):
                for k in range(3):
                    half[a, 3 * q + k] = volumes[e] * (
                        H[e, a, 3 * k] * B[e, q, 0] + H[e, a, 3 * k + 1] * B[e, q, 1] + H[e, a, 3 * k + 2] * B[e, q, 2]
                    )
        for p in range(3):
            for i in range(3):
                row = 3 * p + i
                for column in range(row + 1):
                    value = (
                        B[e, p, 0] * half[3 * i, column]
                        + B[e, p, 1] * half[3 * i + 1, column]
                        + B[e, p, 2] * half[3 * i + 2, column]
                    )
                    out[e, 3 + row, 3 + column] = value
                    out[e, 3 + column, 3 + row] = value
        # Shape gradients sum to zero, so the blocks of every row do: a translation has exactly zero energy.
        for row in range(9):
            for k in range(3):
                value = -(out[e, 3 + row, 3 + k] + out[e, 3 + row, 6 + k] + out[e, 3 + row, 9 + k])
                out[e, 3 + row, k] = value
                out[e, k, 3 + row] = value
        for i in range(3):
            for k in range(i + 1):
                value = -(out[e, 3 + i, k] + out[e, 6 + i, k] + out[e, 9 + i, k])
                out[e, i, k] = value
                out[e, k, i] = value
