"""The energy of joints in a step: of the differences that vanish, and of laws along and across their axes.

With the multipliers lambda, a difference q has the energy lambda . q + k |q|^2 / 2. `joint_step` updates the
multipliers until the differences vanish.
"""

from __future__ import annotations

import math
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
        if len(pulls):
            _add(geometry, geometry.arguments, pulls, out)

    def add_hessian(self, x: NDArray[np.float64], out: HessianBlocks, project: bool) -> None:
        """With `project`, of the functions the nearest positive semi-definite one by their vectors."""
        out.couplings.append(self._linear_couplings)
        geometry = self.geometry
        if not len(self.laws.table):
            return
        at = derivatives(geometry.functions, self.arguments(x))
        g = self._law_values(x)
        count = len(at.value)
        first = _sum(self.laws, self.laws.efforts(g, self.law_multipliers), count)
        second = _sum(self.laws, self.laws.stiffness(g, self.law_multipliers), count)
        H = np.einsum("s,sai,sbj->saibj", second, at.gradient, at.gradient)
        H = (H + first[:, None, None, None, None] * at.hessian).reshape(count, 12, 12)
        if project:
            eigenvalues, vectors = np.linalg.eigh(H)
            H = np.einsum("sij,sj,skj->sik", vectors, np.maximum(eigenvalues, 0.0), vectors)
        C = geometry.arguments.coefficients
        blocks = np.einsum("sap,saibj,sbq->spqij", C, H.reshape(count, 4, 3, 4, 3), C, optimize=True)
        out.couplings.append(_couplings(geometry, geometry.arguments.joint, blocks))

    def differences(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """(f, 3) the vectors that vanish where the joints hold [m]."""
        return self.geometry.at(self.geometry.differences, x, self._offsets[0])

    def coordinates(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """(s,) values of the functions."""
        g = values(self.geometry.functions, self.arguments(x))
        return np.where(turns(self.geometry.functions), self.start + wrapped(g - self.start), g)

    def renewed(self, x: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The multipliers (f, 3) and (l,) that balance the forces of this energy at x."""
        efforts = self.laws.efforts(self._law_values(x), self.law_multipliers)
        new = self.multipliers + self._k[:, None] * self.differences(x)
        return new, np.where(self.laws.table["adapts"], efforts, self.law_multipliers)

    def efforts(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """(l,) of the laws [N], [N m]; a positive one pushes towards smaller coordinates."""
        return self.laws.efforts(self._law_values(x), self.law_multipliers)

    @staticmethod
    def add_by_vectors(geometry: JointGeometry, by_vectors: NDArray[np.float64], out: NDArray[np.float64]) -> None:
        """Add a gradient by the vertices to `out` (n, 3), from one (s, 4, 3) by the vectors of the functions."""
        _add(geometry, geometry.arguments, by_vectors, out)

    def actions(self, x: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The forces (j, 3) [N] on the first bodies, and their torques (j, 3) about the joints' points [N m]."""
        geometry = self.geometry
        count = len(geometry.joints)
        points = geometry.at(geometry.centers, x, np.zeros((count, 3)))
        forces, torques = np.zeros((count, 3)), np.zeros((count, 3))
        rows, pulls, _ = self._forces(x)
        for vectors, gradient in ((geometry.differences, rows), (geometry.arguments, pulls)):
            if not len(gradient):
                continue
            by_corner = _by_corner(vectors, gradient)[:, :4]
            arms = x[geometry.corners[vectors.joint, :4]] - points[vectors.joint][:, None]
            np.subtract.at(forces, vectors.joint, by_corner.sum(axis=1))
            np.subtract.at(torques, vectors.joint, np.cross(arms, by_corner).sum(axis=1))
        return forces, torques

    @cached_property
    def _k(self) -> NDArray[np.float64]:
        return self.stiffness[self.geometry.differences.joint]

    @cached_property
    def _offsets(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Of the differences and of the functions' vectors."""
        geometry, poses = self.geometry, self.geometry.poses(self.time)
        return geometry.differences.offsets(poses), geometry.arguments.offsets(poses)

    @cached_property
    def _linear_couplings(self) -> Couplings:
        c = self.geometry.differences.coefficients
        scalars = np.einsum("f,fp,fq->fpq", self._k, c, c)
        joint = self.geometry.differences.joint
        total = np.zeros((len(self.geometry.joints), 8, 8))
        np.add.at(total, joint, scalars)
        blocks = total[:, :, :, None, None] * np.eye(3)
        return _couplings(self.geometry, np.arange(len(total)), blocks)

    def arguments(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """(s, 4, 3) the vectors of the functions."""
        return self.geometry.at(self.geometry.arguments, x, self._offsets[1])

    def _law_values(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        return self.coordinates(x)[self.laws.table["function"]] if len(self.laws.table) else np.zeros(0)

    def _forces(self, x: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Derivatives by the differences (f, 3) and by the functions' vectors (s, 4, 3), and psi' of each function."""
        linear = self.multipliers + self._k[:, None] * self.differences(x)
        count = len(self.geometry.functions)
        if not len(self.laws.table):
            return linear, np.zeros((0, 4, 3)), np.zeros(0)
        first = _sum(self.laws, self.efforts(x), count)
        at = derivatives(self.geometry.functions, self.arguments(x))
        return linear, first[:, None, None] * at.gradient, first


def _by_corner(vectors: Vectors, gradient: NDArray[np.float64]) -> NDArray[np.float64]:
    """The gradient (f, 8, 3) by the control points, of one (f, ..., 3) by the vectors."""
    rows, each = len(vectors.joint), math.prod(vectors.is_point.shape[1:])
    c, g = vectors.coefficients.reshape(rows, each, 8), gradient.reshape(rows, each, 3)
    return np.einsum("fak,fai->fki", c, g)


def _add(geometry: JointGeometry, vectors: Vectors, by_vector: NDArray[np.float64], out: NDArray[np.float64]) -> None:
    """Add the gradient by the vertices, of one (f, ..., 3) by the vectors."""
    np.add.at(out, geometry.corners[vectors.joint], _by_corner(vectors, by_vector))


def _sum(laws: Laws, values: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """(count,) sums over the laws of each function."""
    return np.bincount(laws.table["function"], weights=values, minlength=count).astype(np.float64)


def _couplings(geometry: JointGeometry, joint: NDArray[np.int64], blocks: NDArray[np.float64]) -> Couplings:
    """Blocks (b, 8, 8, 3, 3) of the corners of joints (b,), each pair once."""
    i, j = _PAIRS
    used = _PAIRS_ALONE | ~geometry.alone[joint][:, None]
    corners = geometry.corners[joint]
    return Couplings(corners[:, i][used], corners[:, j][used], np.ascontiguousarray(blocks[:, i, j][used]))
