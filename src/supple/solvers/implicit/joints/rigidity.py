"""Rigidity of bodies as conditions with multipliers, beside those of joints, for the midpoint rule.

With the second moment per mass S, F S^(1/4) = A is linear in the four control points, and a body is rigid where

    g = A^T A - S^(1/2) = S^(1/4) (F^T F - 1) S^(1/4)

vanishes (3, 3) [m]. The energy is that of the method of multipliers, L : g + k |g|^2 / 2. These units make inertia
equally stiff against a stretch along every axis of the body: M / (4 s) with the factor s of the inertia term.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from supple.model.system import System
from supple.solvers.implicit.energies.potential import HessianBlocks, Potential, Projection


@dataclass(frozen=True, eq=False)
class Rigidity(Potential):
    """The energy of the bodies (b,) that no pin moves, times `weight`.

    Attributes
    ----------
    tets : (b,) their rows of the system's tets; corners : (b, 4) control points; W : (b, 4, 3), A = x^T W
    target : (b, 3, 3) S^(1/2); shape : (b, 3, 3) S^(-1/4)
    inverse_masses : (b, 4, 4) of the control points, with what is welded to them [1/kg]
    k : (b,) [N/m]; multipliers : (b, 3, 3) L, symmetric [N]
    """

    label = "elasticity"
    projection = Projection.RELEASED_FIRST

    tets: NDArray[np.int64]
    corners: NDArray[np.int32]
    W: NDArray[np.float64]
    target: NDArray[np.float64]
    shape: NDArray[np.float64]
    inverse_masses: NDArray[np.float64]
    k: NDArray[np.float64]
    multipliers: NDArray[np.float64]
    weight: float = 1.0

    @classmethod
    def of(cls, system: System) -> Rigidity:
        """The bodies with joints and welds, with k such that k / s is as stiff as inertia."""
        free = [part for part in system.linked_bodies if part.vertices.start not in system.pinned_vertices]
        tets = np.array([part.tets.start for part in free], dtype=np.int64)
        corners = system.tets[tets]
        rest = system.rest_positions[corners]
        rest = rest - rest.mean(axis=1, keepdims=True)
        squares, axes = np.linalg.eigh(0.25 * np.einsum("bki,bkj->bij", rest, rest))

        def power(p: float) -> NDArray[np.float64]:
            return np.einsum("bik,bk,bjk->bij", axes, squares**p, axes)

        masses = system.masses[corners]
        matrices = masses[:, :, None] * np.eye(4)
        welding = system.welding
        for k, corner in enumerate(corners):
            own = welding.control[:, 0] == corner[0]
            weights = welding.weights[own]
            matrices[k] += weights.T @ (system.masses[welding.vertices[own], None] * weights)
        shapes = power(0.5), power(-0.25)
        k = 0.25 * masses.sum(axis=1)
        W = 0.25 * rest @ power(-0.75)
        return cls(
            tets, corners, W, *shapes, np.linalg.inv(matrices).astype(np.float64), k, np.zeros((len(free), 3, 3))
        )

    def value(self, x: NDArray[np.float64]) -> float:
        g = self.conditions(x)
        return self.weight * float(np.vdot(self.multipliers + 0.5 * self.k[:, None, None] * g, g))

    def add_gradient(self, x: NDArray[np.float64], out: NDArray[np.float64]) -> None:
        pulled = 2.0 * self._affine(x) @ self.forces(x)
        np.add.at(out, self.corners, self.weight * np.einsum("bka,bia->bki", self.W, pulled))

    def add_hessian(self, x: NDArray[np.float64], out: HessianBlocks, project: bool) -> None:
        """With `project`, with the part of L + k g that is positive."""
        A, P, one = self._affine(x), self.forces(x), np.eye(3)
        if project:
            values, vectors = np.linalg.eigh(P)
            P = np.einsum("bik,bk,bjk->bij", vectors, np.maximum(values, 0.0), vectors)
        H = np.einsum("ij,bac->biajc", one, P)
        H += self.k[:, None, None, None, None] * (
            np.einsum("bic,bja->biajc", A, A) + np.einsum("ac,bij->biajc", one, A @ A.transpose(0, 2, 1))
        )
        H = np.einsum("bka,biajc,blc->bkilj", self.W, 2.0 * self.weight * H, self.W, optimize=True)
        out.tets[self.tets] += H.reshape(-1, 12, 12)

    def conditions(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """(b, 3, 3) g [m]."""
        A = self._affine(x)
        return A.transpose(0, 2, 1) @ A - self.target

    def gradients(self, x: NDArray[np.float64], a: int, b: int) -> NDArray[np.float64]:
        """(b, 4, 3) of the component (a, b) of g, by the control points."""
        A, W = self._affine(x), self.W
        return W[:, :, None, a] * A[:, None, :, b] + W[:, :, None, b] * A[:, None, :, a]

    def forces(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """(b, 3, 3) L + k g, the multipliers that balance the forces of this energy at x [N]."""
        return self.multipliers + self.k[:, None, None] * self.conditions(x)

    def violation(self, x: NDArray[np.float64]) -> float:
        """The largest component of F^T F - 1 [-]."""
        return float(np.abs(self.shape @ self.conditions(x) @ self.shape).max(initial=0.0))

    def parts(self) -> tuple[Rigidity, Rigidity]:
        """The energy of the penalties; and that of the multipliers, without `weight`."""
        of_penalties = replace(self, multipliers=np.zeros_like(self.multipliers))
        return of_penalties, replace(self, k=np.zeros_like(self.k), weight=1.0)

    def settle(self, forces: NDArray[np.float64], velocities: NDArray[np.float64], h: float) -> None:
        """Take the impulses of forces (n, 3) on the control points in h [s] from the velocities (n, 3), in place.

        The forces are zero there afterwards.
        """
        velocities[self.corners] -= h * np.einsum("bkl,bli->bki", self.inverse_masses, forces[self.corners])
        forces[self.corners] = 0.0

    def _affine(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.einsum("bki,bka->bia", x[self.corners], self.W)
