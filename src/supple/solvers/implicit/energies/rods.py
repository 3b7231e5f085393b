"""The energy of rods, and their damping: see `supple.materials.rods.elements`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.materials.rods.elements import FORMS, RodElements, bends_of, forms_of
from supple.materials.rods.frames import frame_jets
from supple.numerics.sparse.couplings import Couplings
from supple.solvers.implicit.energies.damping import StrainRate
from supple.solvers.implicit.energies.potential import HessianBlocks, JointlyEvaluated, Projection

Floats = NDArray[np.float64]

# e, u and m of an edge as sums of its four nodes, see `RodElements.ways`.
_SHARES = np.array([[-1.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.5, -0.5], [-0.5, -0.5, 0.5, 0.5]])


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
        rods, (free, stretching, section), (unbent, stiffness) = self.rods, self._edges(), self._joints()
        total = 0.5 * float((stretching * rods.lengths) @ (rods.stretches(x) - free) ** 2)
        total += 0.5 * float(section @ rods.shears(x))
        with np.errstate(invalid="ignore"):
            total += 0.5 * float(np.einsum("ck,ck->", stiffness, (rods.bends(x) - unbent) ** 2))
        return total if np.isfinite(total) else np.inf

    def add_model(self, x: Floats, gradient: Floats, hessian: HessianBlocks | None, project: bool) -> float:
        """See `Potential.add_model`; with `project`, forces and moments do not change with directions."""
        rods = self.rods
        e, u, m = rods.ways(x)
        self._add_edges(e, u, m, gradient, hessian, project)
        self._add_joints(e, u, gradient, hessian, project)
        return self.value(x)

    def _add_edges(
        self, e: Floats, u: Floats, m: Floats, gradient: Floats, hessian: HessianBlocks | None, project: bool
    ) -> None:
        rods, (free, stretching, section) = self.rods, self._edges()
        length = np.linalg.norm(e, axis=1)
        t = e / length[:, None]
        tension = stretching * (length / rods.lengths - 1.0 - free)
        along, grown = np.einsum("ei,ei->e", u, t), (np.einsum("ei,ei->e", u, u) - rods.radius**2) / (2.0 * rods.radius)
        slopes = np.zeros((len(e), 2, 2, 3))  # of u . t and of the radius, by e and u
        slopes[:, 0, 0], slopes[:, 0, 1] = (u - along[:, None] * t) / length[:, None], t
        slopes[:, 1, 1] = u / rods.radius[:, None]
        forces = section[:, None, None] * np.einsum("ek,ekvi->evi", np.stack([along, grown], axis=1), slopes)
        forces[:, 0] += tension[:, None] * t
        forces = np.concatenate([forces, section[:, None, None] * m[:, None]], axis=1)
        _scatter(gradient, rods.nodes, np.einsum("vp,evi->epi", _SHARES, forces))
        if hessian is None:
            return
        H = np.zeros((len(e), 3, 3, 3, 3))  # by e, u, m and their components
        H[:, :2, :, :2] = np.einsum("e,ekvi,ekwj->eviwj", section, slopes, slopes)
        pairs, identity = np.einsum("ei,ej->eij", t, t), np.eye(3)
        H[:, 0, :, 0] += (stretching / rods.lengths)[:, None, None] * pairs
        turned = np.maximum(tension, 0.0) if project else tension
        H[:, 0, :, 0] += (turned / length)[:, None, None] * (identity - pairs)
        H[:, 2, :, 2] += section[:, None, None] * identity
        widened = np.maximum(grown, 0.0) if project else grown
        H[:, 1, :, 1] += (section * widened / rods.radius)[:, None, None] * identity
        if not project:
            bent = (section * along / length)[:, None, None]
            mixed = bent * (identity - pairs)
            H[:, 0, :, 1] += mixed
            H[:, 1, :, 0] += mixed
            across = u - along[:, None] * t
            turning = np.einsum("ei,ej->eij", across, t)
            rest = turning + np.swapaxes(turning, 1, 2) + along[:, None, None] * (identity - pairs)
            H[:, 0, :, 0] -= bent / length[:, None, None] * rest
        hessian.patches.append(_couplings(rods.nodes, np.einsum("vp,eviwj,wq->epqij", _SHARES, H, _SHARES)))

    def _add_joints(self, e: Floats, u: Floats, gradient: Floats, hessian: HessianBlocks | None, project: bool) -> None:
        rods, (unbent, stiffness) = self.rods, self._joints()
        if not len(rods.joints):
            return
        values, firsts, seconds = frame_jets(e, u)
        (a, b), (da, db) = rods.turned(values), rods.turned(firsts)
        forms = forms_of(a, b)
        q, bends = forms[:, 3], bends_of(forms)
        of_forms = np.concatenate(
            [np.einsum("fij,cjk,cikv->cfv", FORMS, b, da), np.einsum("fij,cik,cjkv->cfv", FORMS, a, db)], axis=2
        )
        of_q = of_forms[:, 3]
        of_bends = (2.0 * of_forms[:, :3] - bends[:, :, None] * of_q[:, None]) / q[:, None, None]
        moments = stiffness * (bends - unbent)
        slopes = np.einsum("ck,ckv->cv", moments, of_bends)
        nodes = rods.nodes[rods.joints].reshape(-1, 8)
        _scatter(gradient, nodes, _on_nodes(slopes.reshape(-1, 4, 3)))
        if hessian is None:
            return
        H = np.einsum("ck,ckv,ckw->cvw", stiffness, of_bends, of_bends, optimize=True)
        if not project:
            weights = np.concatenate([2.0 * moments, -np.einsum("ck,ck->c", moments, bends)[:, None]], axis=1)
            N = np.einsum("cf,fij->cij", weights / q[:, None], FORMS)
            dda, ddb = rods.turned(seconds)
            H[:, :6, :6] += np.einsum("cik,cikvw->cvw", np.einsum("cij,cjk->cik", N, b), dda)
            H[:, 6:, 6:] += np.einsum("cjk,cjkvw->cvw", np.einsum("cij,cik->cjk", N, a), ddb)
            mixed = np.einsum("cij,cikv,cjkw->cvw", N, da, db, optimize=True)
            H[:, :6, 6:] += mixed
            H[:, 6:, :6] += np.swapaxes(mixed, 1, 2)
            pairs = np.einsum("cv,cw->cvw", slopes / q[:, None], of_q)
            H -= pairs + np.swapaxes(pairs, 1, 2)
        of_ways = H.reshape(-1, 4, 3, 4, 3)
        halves = _on_nodes(of_ways.reshape(len(H), 4, 36)).reshape(-1, 8, 3, 4, 3).transpose(0, 3, 1, 2, 4)
        both = _on_nodes(halves.reshape(len(H), 4, 72)).reshape(-1, 8, 8, 3, 3).swapaxes(1, 2)
        hessian.patches.append(_couplings(nodes, both))


def _on_nodes(of_ways: Floats) -> Floats:
    """(j, 8, k) for the nodes of two edges, of values (j, 4, k) for e and u of both."""
    shares = np.zeros((4, 8))
    shares[:2, :4], shares[2:, 4:] = _SHARES[:2], _SHARES[:2]
    return np.einsum("vp,cvk->cpk", shares, of_ways)


def _scatter(gradient: Floats, nodes: NDArray[np.int32], forces: Floats) -> None:
    """Add forces (k, p, 3) of nodes (k, p)."""
    for i in range(3):
        gradient[:, i] += np.bincount(nodes.ravel(), forces[:, :, i].ravel(), len(gradient))


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
