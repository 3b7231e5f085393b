"""Elastic energy of all tets: sum V psi(F)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from supple.errors import SolverError
from supple.materials.elastic import StableNeoHookean
from supple.materials.elastic_tets.laws import TetLaws
from supple.materials.elastic_tets.mean_volume import MeanVolumes
from supple.materials.elastic_tets.quadratic import QuadraticTets
from supple.materials.laws.internal import rows_of_points
from supple.materials.material import Hyperelastic
from supple.materials.per_tet import BY_LAW, TetMaterial
from supple.materials.tet_energies import element_energies, element_models
from supple.model.system import System
from supple.scene.rod import Rod
from supple.scene.shell import Shell
from supple.solvers.implicit.energies.law_elasticity import NO_PRESSURES, LawElasticity, LawElements
from supple.solvers.implicit.energies.potential import HessianBlocks, JointlyEvaluated, Projection
from supple.solvers.implicit.energies.quadratic.term import Gathering, OfQuadraticTets, VirtualTets
from supple.solvers.implicit.energies.tet_elements import TetElements


@dataclass(frozen=True, eq=False)
class QuadraticElasticity(OfQuadraticTets):
    """The energy of the quadratic tets `rows` (k,): at their quadrature points, and of their mean volumes.

    Attributes
    ----------
    internal : the rows of the internal variables of all tets that belong to these points
    means : see `mean_volume`; None where no material has such a term
    """

    inner: Elasticity
    rows: NDArray[np.int64]
    internal: NDArray[np.int64]
    means: MeanVolumes | None

    @classmethod
    def of(cls, tets: QuadraticTets, laws: TetLaws, vertices: int) -> QuadraticElasticity:
        """With the laws of all tets; `vertices` : their number."""
        virtual = VirtualTets(tets.quadrature, Gathering.of(tets.nodes, vertices))
        means, own = laws.at_points
        elements = virtual.elements()
        at_points = Elasticity(elements, own, _law_elasticity(elements, own, np.ones(virtual.count, dtype=bool)))
        return cls(at_points, virtual, tets.rows, rows_of_points(laws.material), means)

    def value(self, x: NDArray[np.float64]) -> float:
        return super().value(x) if self.means is None else float(self.energies(x).sum())

    def energies(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """(k,) of each element [J]."""
        y = self.virtual.corners(x)
        energies = self.inner.energies(y).reshape(len(self.rows), -1).sum(axis=1)
        return energies if self.means is None else energies + self.means.states(self.virtual.determinants(y))[0]

    def add_model(
        self, x: NDArray[np.float64], gradient: NDArray[np.float64], hessian: HessianBlocks | None, project: bool
    ) -> float:
        """See `Potential.add_model`; with `project`, that of psi' + p J at each point, and the product of gradients."""
        if self.means is None:
            return super().add_model(x, gradient, hessian, project)
        y = self.virtual.corners(x)
        energies, pressures, stiffness = self.means.states(self.virtual.determinants(y))
        of_points = np.repeat(pressures, self.means.volumes.shape[1])
        blocks, forces = self.virtual.blocks(hessian), np.zeros_like(y)
        energy = self.inner.add_model(y, forces, blocks, project, of_points)
        self.virtual.add_forces(forces, gradient)
        if hessian is not None and blocks is not None:
            products = np.maximum(stiffness, 0.0) if project else stiffness
            hessian.patches.append(self.virtual.couplings(blocks.tets, (products, self.virtual.volume_gradients(y))))
        return energy + float(energies.sum())

    def in_step(self, internal: NDArray[np.float64], h: float) -> QuadraticElasticity:
        """As of `Elasticity`, with the internal variables of all tets."""
        if not len(self.internal):
            return self
        return replace(self, inner=self.inner.in_step(internal[self.internal], h))

    def flowed(self, x: NDArray[np.float64], internal: NDArray[np.float64], h: float) -> NDArray[np.float64]:
        """The rows `internal` at the end of a step, from the internal variables of all tets."""
        return self.inner.flowed(self.virtual.corners(x), internal[self.internal], h)


@dataclass(frozen=True, eq=False)
class Elasticity(JointlyEvaluated):
    """The hyperelastic energy of every tet with its own material.

    Attributes
    ----------
    material : one row per tet
    laws : the energies of tets that are given by laws, or None
    quadratic : the energy of the quadratic tets, or None
    """

    elements: TetElements
    material: TetMaterial
    laws: LawElasticity | None = None
    quadratic: QuadraticElasticity | None = None
    label = "elasticity"
    projection = Projection.RELEASED_FIRST

    def value(self, x: NDArray[np.float64]) -> float:
        parts = [part.value(x) for part in (self.laws, self.quadratic) if part is not None]
        return float(self._own_energies(x).sum()) + sum(parts)

    def energies(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """(m,) of each tet [J]."""
        energies = self._own_energies(x)
        if self.laws is not None:
            for rows, values in self.laws.energies(x):
                energies[rows] += values
        if self.quadratic is not None:
            energies[self.quadratic.rows] += self.quadratic.energies(x)
        return energies

    def _own_energies(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        s = self.elements
        energies = np.empty(len(s))
        element_energies(x, s.tets, s.rest_shape_inverse, s.rest_volumes, *self._parameters, energies)
        return energies

    def add_model(
        self,
        x: NDArray[np.float64],
        gradient: NDArray[np.float64],
        hessian: HessianBlocks | None,
        project: bool,
        pressures: NDArray[np.float64] = NO_PRESSURES,
    ) -> float:
        """See `Potential.add_model`; with pressures (m,), derivatives are of psi + pressure J, the energy of psi."""
        s = self.elements
        energies = np.empty(len(s))
        gradients = np.empty((len(s), 4, 3))
        of_own = np.where(self.own, pressures, 0.0) if len(pressures) else pressures
        tets = x, s.tets, s.rest_shape_inverse, s.rest_volumes, *self._parameters, of_own
        if hessian is None:
            element_models(*tets, False, project, energies, gradients, _NO_HESSIANS)
        else:
            hessian.add_tets(lambda blocks: element_models(*tets, True, project, energies, gradients, blocks))
        s.gather(gradients, gradient)
        total = float(energies.sum())
        if self.laws is not None:
            total += self.laws.add_model(x, gradient, hessian, project, pressures)
        return total if self.quadratic is None else total + self.quadratic.add_model(x, gradient, hessian, project)

    def in_step(self, internal: NDArray[np.float64], h: float) -> Elasticity:
        """The energy of a step of h [s] from these internal variables (k, 11), at whose end its forces act."""
        laws = None if self.laws is None else self.laws.in_step(internal, h)
        quadratic = None if self.quadratic is None else self.quadratic.in_step(internal, h)
        return replace(self, laws=laws, quadratic=quadratic)

    def flowed(self, x: NDArray[np.float64], internal: NDArray[np.float64], h: float) -> NDArray[np.float64]:
        """(k, 11) the internal variables at the end of a step of h [s] to x (n, 3)."""
        after = internal if self.laws is None else self.laws.flowed(x, internal, h)
        if self.quadratic is not None and len(self.quadratic.internal):
            after = after.copy()
            after[self.quadratic.internal] = self.quadratic.flowed(x, internal, h)
        return after

    @cached_property
    def own(self) -> NDArray[np.bool_]:
        """(m,) which tets have an energy of their own F: not those of laws, nor the quadratic ones."""
        own = self.material.kind != BY_LAW
        if self.quadratic is not None:
            own[self.quadratic.rows] = False
        return own

    @cached_property
    def _parameters(self) -> tuple[NDArray[np.int32], NDArray[np.float64], NDArray[np.float64]]:
        """Kind, mu and lam (m,) of each tet's own energy: zero where laws or quadratic tets have it."""
        material = self.material
        own = self.own
        if own.all():
            return material.kind, material.mu, material.lam
        zero = np.int32(StableNeoHookean.energy_kind())  # with mu = lam = 0, an energy that is zero for every F
        return np.where(own, material.kind, zero), np.where(own, material.mu, 0.0), np.where(own, material.lam, 0.0)


_NO_HESSIANS = np.zeros((0, 12, 12))


def refuse_materials(system: System) -> None:
    """Raise `SolverError` where a body's material has no elastic energy; the text names the body."""
    for part in system.bodies:
        if not isinstance(part.body, (Shell, Rod)) and not isinstance(part.body.material, Hyperelastic):
            raise SolverError(
                f"body {part.name!r}: {type(part.body.material).__name__} is a material for XPBD only; for Implicit, "
                "give it an elastic one such as StableNeoHookean"
            )


def elasticity_of(system: System) -> Elasticity:
    """The elastic energy of a system.

    Raises
    ------
    SolverError : where a body's material has none; the text names the body.
    """
    refuse_materials(system)
    elements = TetElements.of_system(system)
    material, quadratic = system.laws.material, None
    own = np.ones(len(system.tets), dtype=bool)
    if system.quadratic is not None:
        quadratic = QuadraticElasticity.of(system.quadratic, system.laws, len(system.rest_positions))
        own[system.quadratic.rows] = False
    return Elasticity(elements, material, _law_elasticity(elements, material, own), quadratic)


def _law_elasticity(elements: TetElements, material: TetMaterial, own: NDArray[np.bool_]) -> LawElasticity | None:
    """The laws of all tets of a material; of elastic ones, those of the tets (m,) that have an energy of their own."""
    arrays = elements.tets, elements.rest_shape_inverse, elements.rest_volumes
    elastic = [LawElements.of(part.selected(own), *arrays) for part in material.elastic_laws]
    flowing = [
        (LawElements.of(part, *arrays), part.flow, rows)
        for part, rows in material.flowing_laws
        if part.flow is not None and part.points == 1 and len(part.rows)
    ]
    parts = tuple(each for each in elastic if len(each.rows))
    return LawElasticity(parts, tuple(flowing)) if parts or flowing else None
