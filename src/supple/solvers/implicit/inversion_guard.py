"""Prevents the inversion of tets: which bodies are guarded, how far a step may go, and the check after it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from supple.errors import SolverError
from supple.materials.elastic_tets.quadratic import QuadraticTets
from supple.materials.kinds import without_inversion
from supple.materials.per_tet import TetMaterial
from supple.materials.tet_energies import deformation_gradient
from supple.model.system import System
from supple.numerics.bernstein import positive_coefficients, positive_elements
from supple.numerics.mat3 import det
from supple.numerics.noninverting_step import KEEP, noninverting_step, volume_signs
from supple.numerics.quadratic_noninverting_step import noninverting_step as quadratic_noninverting_step
from supple.runtime.kernel_cache import njit, prange, read_only
from supple.solvers.implicit.energies.quadratic.bernstein_barrier import BernsteinBarrier


@dataclass(eq=False)
class InversionGuard:
    """The step filter on all tets of every body that has no inverted one. Other bodies may recover first.

    J of a quadratic tet is bounded everywhere in it.

    A body is guarded as a whole. A guard on its positive tets alone would lock it: to recover, some of them have to
    pass through zero volume.

    Attributes
    ----------
    guarded : (m,) bool; keep : share of its volume that a tet keeps at least in one step, in (0, 1)
    complete : whether all tets are guarded
    by_coefficients : (k,) quadratic tets where all Bernstein coefficients of the determinant are positive at the start
        of a step, and at rest. They have a barrier and stay positive. In the others, which are strongly curved, the
        determinant itself is kept positive.
    """

    system: System
    guarded: NDArray[np.bool_]
    keep: float = KEEP
    complete: bool = False
    by_coefficients: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, dtype=np.bool_))

    @classmethod
    def at(cls, system: System, x: NDArray[np.float64], keep: float = KEEP) -> InversionGuard:
        """Guard the bodies that have no flat or inverted tet at x."""
        guard = cls(system, np.zeros(len(system.tets), dtype=np.bool_), keep)
        if (tets := system.quadratic) is not None:
            at_rest = (tets.rest_coefficients > 0.0).all(axis=1)
            guard.by_coefficients = _of_elements(positive_coefficients, tets, x) & at_rest
        guard.widen(x)
        return guard

    def largest_step(self, x: NDArray[np.float64], direction: NDArray[np.float64]) -> tuple[float, int]:
        """The largest step along `direction`, at most 1, and the tet that limits it (-1 where none does)."""
        step, tet = noninverting_step(x, direction, self.system.tets, self._linear, self.keep)
        if (tets := self.system.quadratic) is None:
            return float(step), int(tet)
        guarded = self.guarded[tets.rows]
        own, k = quadratic_noninverting_step(x, direction, tets.nodes, guarded, self.by_coefficients, self.keep)
        return (float(own), int(tets.rows[k])) if own < step else (float(step), int(tet))

    @property
    def _linear(self) -> NDArray[np.bool_]:
        """(m,) the guarded linear tets."""
        if self.system.quadratic is None:
            return self.guarded
        linear = self.guarded.copy()
        linear[self.system.quadratic.rows] = False
        return linear

    def name(self, tet: int) -> str:
        """Of a tet, by its number in its body."""
        for part in self.system.bodies:
            if part.tets.start <= tet < part.tets.stop:
                return f"tet {tet - part.tets.start} of body {part.name!r}"
        return f"tet {tet}"

    def allows(self, x: NDArray[np.float64]) -> bool:
        """Whether every guarded tet has a positive volume at x, a quadratic one everywhere in it."""
        kept = bool(keeps_volume(x, self.system.tets, self.system.rest_shape_inverse, self._linear))
        if (tets := self.system.quadratic) is None or not kept:
            return kept
        inverted = self.guarded[tets.rows] & ~_of_elements(positive_coefficients, tets, x)
        if not inverted.any():
            return True
        return not ((inverted & self.by_coefficients).any() or (inverted & ~are_positive(tets, x)).any())

    def quadratic_barrier(self, onset: float) -> BernsteinBarrier | None:
        """The barrier below J = `onset` of the guarded quadratic tets; None where none exists."""
        if (tets := self.system.quadratic) is None:
            return None
        material = self.system.laws.material
        chosen = np.flatnonzero(self.guarded[tets.rows] & self.by_coefficients)
        if len(chosen) == 0:
            return None
        rows = tets.rows[chosen]
        stiffness = onset * (material.mu[rows] + np.abs(material.lam[rows])) * self.system.rest_volumes[rows] / 20.0
        return BernsteinBarrier(tets.nodes[chosen], tets.rest_coefficients[chosen], stiffness, onset)

    def widen(self, x: NDArray[np.float64]) -> None:
        """From now on, also guard the bodies that have no flat or inverted tet at x."""
        if self.complete:
            return
        positive = _are_positive(self.system, x)
        for part in self.system.bodies:
            if positive[part.tets].all():
                self.guarded[part.tets] = True
        self.complete = bool(self.guarded.all())


def refuse_inverted(system: System, material: TetMaterial, x: NDArray[np.float64]) -> None:
    """Check that no tet whose material has no energy at J <= 0 is flat or inverted at x.

    Raises
    ------
    SolverError : where one is; the text names the body and its tets.
    """
    bad = without_inversion(material) & ~_are_positive(system, x)
    if not bad.any():
        return
    for part in system.bodies:
        tets = np.flatnonzero(bad[part.tets])
        if len(tets):
            names = ", ".join(str(e) for e in tets[:10]) + (", ..." if len(tets) > 10 else "")
            raise SolverError(
                f"body {part.name!r}: {len(tets)} of {part.tets.stop - part.tets.start} tets are flat or inverted at "
                f"the start (tets {names}), where {type(part.body.material).__name__} has no finite energy; start "
                "un-inverted, or use StableNeoHookean, which recovers"
            )


def _are_positive(system: System, x: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(m,) whether J is positive everywhere in a tet."""
    positive = volume_signs(x, system.tets) > 0.0
    if system.quadratic is not None:
        positive[system.quadratic.rows] = are_positive(system.quadratic, x)
    return positive


def are_positive(tets: QuadraticTets, x: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(k,) whether J is positive everywhere in a quadratic tet."""
    return _of_elements(positive_elements, tets, x)


def _of_elements(kernel: Callable[..., None], tets: QuadraticTets, x: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(k,) what a kernel writes for each quadratic tet."""
    out = np.empty(len(tets.rows), dtype=np.bool_)
    kernel(read_only(x), read_only(tets.nodes), out)
    return out


@njit(parallel=True, cache=True)
def keeps_volume(x, tets, Dm_inv, guarded):
    """Whether J = det(Ds Dm^-1) > 0 in every guarded tet, in rounded numbers: a step is taken only where this holds."""
    bad = 0
    for e in prange(len(tets)):
        if guarded[e] and not det(deformation_gradient(x, tets, Dm_inv, e)) > 0.0:
            bad += 1
    return bad == 0
