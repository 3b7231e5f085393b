"""The energy of joints in a step: of the differences that vanish, and of laws along and across their axes.

With the multipliers lambda, a difference q has the energy lambda . q + k |q|^2 / 2. `joint_step` updates the
multipliers until the differences vanish.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from supple.model.joints.functions import derivatives, turns, values
from supple.model.joints.geometry import JointGeometry, Vectors
from supple.model.joints.laws import Laws, wrapped
from supple.numerics.sparse.couplings import Couplings
from supple.solvers.implicit.energies.potential import ContactPotential, HessianBlocks, Projection

_PAIRS = np.triu_indices(8)
_PAIRS_ALONE = (_PAIRS[0] < 4) & (_PAIRS[1] < 4)


@dataclass(frozen=True, eq=False)
class JointPotential(ContactPotential):
    """The energy at the end of a step.

    Attributes
    ----------
    time : at the end [s]; stiffness : (j,) k [N/m]; multipliers : (f, 3) lambda of the differences [N]
    laws, efforts : and their multipliers (l,)
    start : (s,) values of the functions at the beginning of the step; angles are followed from there
    """

    label = "joints"
    work = "joints"
    projection = Projection.RELEASED_FIRST

    geometry: JointGeometry
    time: float
    stiffness: NDArray[np.float64]
    laws: Laws
    start: NDArray[np.float64]
    multipliers: NDArray[np.float64]
    law_multipliers: NDArray[np.float64]

    def value(self, x: NDArray[np.float64]) -> float:
        q = self.differences(x)
        linear = np.einsum("fi,fi->", self.multipliers + 0.5 * self._k[:, None] * q, q)
        return float(linear + self.laws.energies(self._law_values(x), self.law_multipliers).sum())

    def add_gradient(self, x: NDArray[np.float64], out: NDArray[np.float64]) -> None:
        geometry = self.geometry
        forces, pulls, _ = self._forces(x)
        _add(geometry, geometry.differences, forces, out)
        for k, column in enumerate(geometry.arguments if len(pulls) else ()):
            _add(geometry, column, pulls[:, k], out)

    def add_hessian(self, x: NDArray[np.float64], out: HessianBlocks, project: bool) -> None:
        """With `project`, of the functions the nearest positive semi-definite one by their vectors."""
        out.couplings.append(self._linear_couplings)
        geometry = self.geometry
        if not len(self.laws.function):
            return
        at = derivatives(geometry.functions, self._arguments(x))
        g = self._law_values(x)
        count = len(at.value)
        first = _sum(self.laws, self.laws.efforts(g, self.law_multipliers), count)
        second = _sum(self.laws, self.laws.stiffness(g, self.law_multipliers), count)
        H = np.einsum("s,sai,sbj->saibj", second, at.gradient, at.gradient)
        H = (H + first[:, None, None, None, None] * at.hessian).reshape(count, 12, 12)
        if project:
            eigenvalues, vectors = np.linalg.eigh(H)
            H = np.einsum("sij,sj,skj->sik", vectors, np.maximum(eigenvalues, 0.0), vectors)
        C = np.stack([column.coefficients for column in geometry.arguments], axis=1)
        blocks = np.einsum("sap,saibj,sbq->spqij", C, H.reshape(count, 4, 3, 4, 3), C, optimize=True)
        out.couplings.append(_couplings(geometry, geometry.arguments[0].joint, blocks))

    def differences(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """(f, 3) the vectors that vanish where the joints hold [m]."""
        return _at(self.geometry, self.geometry.differences, x, self._difference_offsets)

    def coordinates(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """(s,) values of the functions."""
        g = values(self.geometry.functions, self._arguments(x))
        return np.where(turns(self.geometry.functions), self.start + wrapped(g - self.start), g)

    def renewed(self, x: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The multipliers (f, 3) and (l,) that balance the forces of this energy at x."""
        efforts = self.laws.efforts(self._law_values(x), self.law_multipliers)
        new = self.multipliers + self._k[:, None] * self.differences(x)
        return new, np.where(self.laws.adapts, efforts, self.law_multipliers)

    def efforts(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """(l,) of the laws [N], [N m]; a positive one pushes towards smaller coordinates."""
        return self.laws.efforts(self._law_values(x), self.law_multipliers)

    def actions(self, x: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The forces (j, 3) [N] on the first bodies, and their torques (j, 3) about the joints' points [N m]."""
        geometry = self.geometry
        count = len(geometry.joints)
        points = _at(geometry, geometry.centers, x, np.zeros((count, 3)))
        forces, torques = np.zeros((count, 3)), np.zeros((count, 3))
        rows, pulls, _ = self._forces(x)
        columns = [(geometry.differences, rows)]
        columns += [(column, pulls[:, k]) for k, column in enumerate(geometry.arguments if len(pulls) else ())]
        for vectors, gradient in columns:
            c = vectors.coefficients[:, :4]
            own = np.einsum("fk,fki->fi", c, x[geometry.corners[vectors.joint, :4]])
            arms = own - c.sum(axis=1)[:, None] * points[vectors.joint]
            np.add.at(forces, vectors.joint, -c.sum(axis=1)[:, None] * gradient)
            np.add.at(torques, vectors.joint, -np.cross(arms, gradient))
        return forces, torques

    @cached_property
    def _k(self) -> NDArray[np.float64]:
        return self.stiffness[self.geometry.differences.joint]

    @cached_property
    def _difference_offsets(self) -> NDArray[np.float64]:
        return self.geometry.differences.offsets(self.geometry.poses(self.time))

    @cached_property
    def _argument_offsets(self) -> list[NDArray[np.float64]]:
        poses = self.geometry.poses(self.time)
        return [column.offsets(poses) for column in self.geometry.arguments]

    @cached_property
    def _linear_couplings(self) -> Couplings:
        c = self.geometry.differences.coefficients
        scalars = np.einsum("f,fp,fq->fpq", self._k, c, c)
        joint = self.geometry.differences.joint
        total = np.zeros((len(self.geometry.joints), 8, 8))
        np.add.at(total, joint, scalars)
        blocks = total[:, :, :, None, None] * np.eye(3)
        return _couplings(self.geometry, np.arange(len(total)), blocks)

    def _arguments(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """(s, 4, 3) the vectors of the functions."""
        columns = zip(self.geometry.arguments, self._argument_offsets, strict=True)
        return np.stack([_at(self.geometry, column, x, offsets) for column, offsets in columns], axis=1)

    def _law_values(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        return self.coordinates(x)[self.laws.function] if len(self.laws.function) else np.zeros(0)

    def _forces(self, x: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Derivatives by the differences (f, 3) and by the functions' vectors (s, 4, 3), and psi' of each function."""
        linear = self.multipliers + self._k[:, None] * self.differences(x)
        count = len(self.geometry.functions)
        if not len(self.laws.function):
            return linear, np.zeros((0, 4, 3)), np.zeros(0)
        first = _sum(self.laws, self.efforts(x), count)
        at = derivatives(self.geometry.functions, self._arguments(x))
        return linear, first[:, None, None] * at.gradient, first


def _at(
    geometry: JointGeometry, vectors: Vectors, x: NDArray[np.float64], offsets: NDArray[np.float64]
) -> NDArray[np.float64]:
    corners = x[geometry.corners[vectors.joint]]
    return np.einsum("fk,fki->fi", vectors.coefficients, corners) + offsets


def _add(geometry: JointGeometry, vectors: Vectors, by_vector: NDArray[np.float64], out: NDArray[np.float64]) -> None:
    """Add the gradient by the vertices, of one (f, 3) by the vectors."""
    shares = vectors.coefficients[:, :, None] * by_vector[:, None, :]
    np.add.at(out, geometry.corners[vectors.joint], shares)


def _sum(laws: Laws, values: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """(count,) sums over the laws of each function."""
    return np.bincount(laws.function, weights=values, minlength=count).astype(np.float64)


def _couplings(geometry: JointGeometry, joint: NDArray[np.int64], blocks: NDArray[np.float64]) -> Couplings:
    """Blocks (b, 8, 8, 3, 3) of the corners of joints (b,), each pair once."""
    i, j = _PAIRS
    used = _PAIRS_ALONE | ~geometry.alone[joint][:, None]
    corners = geometry.corners[joint]
    return Couplings(corners[:, i][used], corners[:, j][used], np.ascontiguousarray(blocks[:, i, j][used]))
