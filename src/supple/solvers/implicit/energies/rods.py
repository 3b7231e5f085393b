"""The energy of rods, and their damping: see `supple.materials.rods.elements`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.materials.rods.elements import FORMS, PAIRED, SHARES, RodElements, forms_of
from supple.materials.rods.frames import frame_jets
from supple.numerics.sparse.couplings import Couplings
from supple.solvers.implicit.energies.damping import StrainRate
from supple.solvers.implicit.energies.potential import HessianBlocks, JointlyEvaluated, Projection

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class RodEnergy(JointlyEvaluated):
    """The elastic energy of all rods."""

    rods: RodElements
    label = "elasticity"
    projection = Projection.RELEASED_FIRST

    def _edges(self) -> tuple[Floats, Floats, Floats]:
        """(e,) stretches without force, the stiffness of stretches [N] and that of cross sections [N/m]."""
        rods = self.rods
        return np.zeros(len(rods.lengths)), rods.stretching, rods.section

    def _joints(self) -> tuple[Floats, Floats]:
        """(j, 3) bends without moments, and their stiffness [N m]."""
        return np.zeros_like(self.rods.stiffness), self.rods.stiffness

    def value(self, x: Floats) -> float:
        return self._energy(x, self.rods.stretches(x) - self._edges()[0], self.rods.bends(x) - self._joints()[0])

    def _energy(self, x: Floats, stretched: Floats, bent: Floats) -> float:
        rods, (_, stretching, section) = self.rods, self._edges()
        total = 0.5 * float((stretching * rods.lengths) @ stretched**2 + section @ rods.shears(x))
        with np.errstate(invalid="ignore"):
            total += 0.5 * float(np.einsum("ck,ck->", self._joints()[1], bent**2))
        return total if np.isfinite(total) else np.inf

    def add_model(self, x: Floats, gradient: Floats, hessian: HessianBlocks | None, project: bool) -> float:
        """See `Potential.add_model`; with `project`, forces and moments do not change with directions."""
        rods, (free, stretching, section), (unbent, stiffness) = self.rods, self._edges(), self._joints()
        stretched, bent = rods.stretches(x) - free, rods.bends(x) - unbent
        tensions, moments = stretching * stretched, stiffness * bent
        rods.add_gradient(x, tensions, section, moments, gradient)
        if hessian is not None:
            hessian.patches.append(self._of_edges(x, tensions, project))
            if len(rods.joints):
                hessian.patches.append(self._of_joints(x, moments, project))
        return self._energy(x, stretched, bent)

    def _of_edges(self, x: Floats, tensions: Floats, project: bool) -> Couplings:
        rods, (_, stretching, section) = self.rods, self._edges()
        e, u, _ = rods.ways(x)
        length = np.linalg.norm(e, axis=1)
        t = e / length[:, None]
        values, slopes = rods.section_slopes(x)
        along, grown = values.T
        H = np.zeros((len(e), 3, 3, 3, 3))  # by e, u, m and their components
        H[:, :2, :, :2] = np.einsum("e,ekvi,ekwj->eviwj", section, slopes, slopes)
        pairs, identity = np.einsum("ei,ej->eij", t, t), np.eye(3)
        H[:, 0, :, 0] += (stretching / rods.lengths)[:, None, None] * pairs
        turned = np.maximum(tensions, 0.0) if project else tensions
        H[:, 0, :, 0] += (turned / length)[:, None, None] * (identity - pairs)
        H[:, 2, :, 2] += section[:, None, None] * identity
        widened = np.maximum(grown, 0.0) if project else grown
        H[:, 1, :, 1] += (section * widened / rods.radius)[:, None, None] * identity
        if not project:
            bent = (section * along / length)[:, None, None]
            mixed = bent * (identity - pairs)
            H[:, 0, :, 1] += mixed
            H[:, 1, :, 0] += mixed
            turning = np.einsum("ei,ej->eij", u - along[:, None] * t, t)
            rest = turning + np.swapaxes(turning, 1, 2) + along[:, None, None] * (identity - pairs)
            H[:, 0, :, 0] -= bent / length[:, None, None] * rest
        return _couplings(rods.nodes, np.einsum("vp,eviwj,wq->epqij", SHARES, H, SHARES))

    def _of_joints(self, x: Floats, moments: Floats, project: bool) -> Couplings:
        rods, (_, stiffness) = self.rods, self._joints()
        bends, slopes = rods.bend_slopes(x)
        of_bends = slopes.reshape(-1, 3, 12)
        H = np.einsum("ck,ckv,ckw->cvw", stiffness, of_bends, of_bends, optimize=True)
        if not project:
            e, u, _ = rods.ways(x)
            (a, b), (da, db), (dda, ddb) = (rods.turned(part) for part in frame_jets(e, u))
            q = forms_of(a, b)[:, 3, None]
            of_q = np.concatenate([np.einsum("cik,cikv->cv", b, da), np.einsum("cik,cikv->cv", a, db)], axis=1) / q
            weights = np.concatenate([2.0 * moments, -np.einsum("ck,ck->c", moments, bends)[:, None]], axis=1)
            N = np.einsum("cf,fij->cij", weights / q, FORMS)
            H[:, :6, :6] += np.einsum("cik,cikvw->cvw", np.einsum("cij,cjk->cik", N, b), dda)
            H[:, 6:, 6:] += np.einsum("cjk,cjkvw->cvw", np.einsum("cij,cik->cjk", N, a), ddb)
            mixed = np.einsum("cij,cikv,cjkw->cvw", N, da, db, optimize=True)
            H[:, :6, 6:] += mixed
            H[:, 6:, :6] += np.swapaxes(mixed, 1, 2)
            pairs = np.einsum("cv,cw->cvw", np.einsum("ck,ckv->cv", moments, of_bends), of_q)
            H -= pairs + np.swapaxes(pairs, 1, 2)
        return _couplings(
            rods.nodes[rods.joints].reshape(-1, 8),
            np.einsum("vp,cviwj,wq->cpqij", PAIRED, H.reshape(-1, 4, 3, 4, 3), PAIRED, optimize=True),
        )


def _couplings(nodes: NDArray[np.int32], blocks: Floats) -> Couplings:
    """Of blocks (k, p, p, 3, 3) between nodes (k, p), of which two may be one vertex."""
    p, q = np.triu_indices(nodes.shape[1])
    rows, columns, own = nodes[:, p], nodes[:, q], blocks[:, p, q]
    twice = (rows == columns) & (p != q)
    own[twice] += np.swapaxes(own[twice], 1, 2)
    return Couplings(rows.ravel(), columns.ravel(), own.reshape(-1, 3, 3))


@dataclass(frozen=True, eq=False)
class RodDamping(RodEnergy):
    """The dissipation potential of one step, Kelvin-Voigt as that of tets: see `damping`."""

    rate: StrainRate
    work = "damping"

    def _edges(self) -> tuple[Floats, Floats, Floats]:
        rods, count = self.rods, len(self.rods.lengths)
        factor = self.rate.factor * rods.damping
        return self.rate.reference[:count], factor * rods.stretching, np.zeros(count)

    def _joints(self) -> tuple[Floats, Floats]:
        factor = self.rate.factor * self.rods.joint_damping
        reference = self.rate.reference[len(self.rods.lengths) :].reshape(-1, 3)
        return reference, factor[:, None] * self.rods.stiffness


@dataclass(frozen=True, eq=False)
class RodViscosity:
    """The viscosity of rods, under the names of `Viscosity`."""

    rods: RodElements

    @classmethod
    def of(cls, rods: RodElements | None) -> RodViscosity | None:
        """None where no rod is damped."""
        return None if rods is None or not rods.damping.any() else cls(rods)

    def strains(self, x: Floats) -> Floats:
        """Stretches of the edges, then bends of the joints, (e + 3 j,)."""
        return np.concatenate([self.rods.stretches(x), self.rods.bends(x).ravel()])

    def damping(self, rate: StrainRate) -> RodDamping:
        """The dissipation potential of one step."""
        return RodDamping(self.rods, rate)
