"""How much softer than its material a body is at a length of the substep: estimated, and measured once it is strained.

The estimate is for the worst loads. `DeliveredWork` measures a substep of each frame; where sums over the last frames
are below the estimate, they replace it, except for bodies that are hardly strained. They are above it in fast blows.

A tet starts its projection from positions that its neighbours have already changed in the same sweep. The error of the
stiffness is of the order of h^2 w^2, with w the frequency at which a tet alone oscillates. For its shear, w^2 is
2 mu V k, with k the largest eigenvalue of sum w_i b_i b_i^T (w_i the inverse masses of its vertices, b_i its shape
gradients); the first Lamé parameter adds to it. Over beams of 2 to 6 cells across, nu = 0.3 to 0.49, the static sag
exceeds the converged one by at most

    FACTOR h^2 <2 V k (lam_L + mu / 2)>

with the mean over the volume; it is within 15 % of this for the coarsest beams at nu = 0.45 and 0.49, and several times
smaller for fine meshes at nu = 0.3 (docs/theory/xpbd.md). For `EdgesAndVolume`, the mean of (w_1 + w_2) / compliance
over the edges stands for the bracket; hard constraints and rigid bodies have no
stiffness that could be compared.

Of a shell, the estimate is that in bending. What its membrane lacks makes it longer by that share of its strain, which
is small where cloth or a plate bends: the product of both counts.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.materials.elastic import EdgesAndVolume
from supple.materials.material import Elastic
from supple.materials.shells.elements import ShellElements
from supple.materials.shells.kernels import strains_of
from supple.model.system import BodyRange, System
from supple.scene.rod import Rod
from supple.scene.shell import Shell

FACTOR = 0.14
# The same for membranes of shells in <2 mu (1 + a) V k>: hanging sheets of four meshes have .61 to .71, a balloon .85;
# and for their bending in <D sum w |grad theta|^2>: cantilevers have 1.3 to 1.6, of rods of 6 to 24 edges .03 to .5.
STRETCHING, BENDING = 0.85, 1.6
# By which sums over earlier frames fall in every frame.
FALL = 0.8
# Of twice the shear modulus times the volume: with less work than that of this squared strain, the estimate counts.
LEAST_STRAIN = 1e-3
# Of what single tets lack and have too much: the least error. A sum in which all of it cancels is too good.
LEAST_PART = 0.15
# Of the estimate: the least error. The sum is that of the present deformation; of a body that is stretched by far more
# than it is bent, it says little about the bending.
LEAST_OF_ESTIMATE = 1.0 / 3.0
# Of the accuracy: what the number of substeps aims at, so that a frame is seldom beyond it.
AIM = 0.75


@dataclass(frozen=True, eq=False)
class MeasuredWork:
    """What the frames before have measured.

    Attributes
    ----------
    sums : (b, 3) see `DeliveredWork.end`, of the last frames [J]; h : length of the substeps of the last one [s]
    rates : (b,) estimated, to know the bodies by
    strains : (b,) of shells, the root of the mean square of the Green strain at the end of the last frame
    """

    sums: NDArray[np.float64]
    h: float
    rates: NDArray[np.float64]
    strains: NDArray[np.float64]


class Softening:
    """The estimates for every body of a system, and their corrections by measurements.

    Attributes
    ----------
    names : of the bodies; rates : (b,) the estimated error of a body's stiffness is its rate times h^2 [1/s^2], of
        shells that in bending; stretching : (b,) of membranes
    """

    def __init__(self, system: System) -> None:
        self._system = system
        self.names = [part.name for part in system.bodies]
        self.rates = FACTOR * np.array([_mean_square_frequency(system, part) for part in system.bodies])
        self.stretching = np.zeros(len(system.bodies))
        self._shells, shells = [], system.shells
        for k, part in enumerate(system.bodies):
            if shells is not None and isinstance(part.body, Shell):
                rows = shells.rows_of(part.vertices)
                self._shells.append((k, np.flatnonzero(rows)))
                ratios, areas = shells.stretching_ratios(system.inverse_masses)[rows], shells.areas[rows]
                self.stretching[k] = STRETCHING * float(ratios @ areas / areas.sum())
                self.rates[k] = BENDING * _of_hinges(shells, system, part)
            elif system.rods is not None and isinstance(part.body, Rod):
                own = system.rods.rows_of(part.vertices)[system.rods.joints[:, 0]]
                ratios = system.rods.ratios(system.inverse_masses, system.rest_positions)[own]
                self.rates[k] = BENDING * float(ratios.max(axis=1).mean()) if len(ratios) else 0.0
        self._least = LEAST_STRAIN**2 * np.array([_shear_stiffness(system, part) for part in system.bodies])

    def own(self, work: MeasuredWork | None) -> MeasuredWork | None:
        """The work; None where it is that of other bodies or of another material."""
        return work if work is not None and np.array_equal(work.rates, self.rates) else None

    def after(
        self,
        earlier: MeasuredWork | None,
        frame: NDArray[np.float64],
        h: float,
        asleep: NDArray[np.bool_],
        points: NDArray[np.float64],
    ) -> MeasuredWork:
        """With the measurement (b, 3) of a frame with substeps of h [s], in which the bodies `asleep` (b,) rested, and
        which ended with points (n, >= 3) [m]."""
        strains = self._strains(points)
        if earlier is None:
            return MeasuredWork(frame, h, self.rates, strains)
        # Errors fall with h^2 at least.
        before = earlier.sums * [(h / earlier.h) ** 2, 1.0, (h / earlier.h) ** 2]
        return MeasuredWork(np.where(asleep[:, None], before, FALL * before + frame), h, self.rates, strains)

    def shares(self, h: float, work: MeasuredWork | None) -> NDArray[np.float64]:
        """(b,) the share of its stiffness that each body lacks at substeps of h [s], the present ones of the work."""
        estimated = self._estimated(h)
        if work is None:
            return estimated
        measured, trust = self._measured(work)
        shares, error = trust * np.minimum(measured, estimated) + (1.0 - trust) * estimated, self.stretching * h**2
        return np.maximum(shares, work.strains * error / (1.0 + error)) if self._shells else shares

    def by_body(self, h: float, work: MeasuredWork | None) -> dict[str, float]:
        """The shares by the names of the bodies."""
        return dict(zip(self.names, self.shares(h, work).tolist(), strict=True))

    def substeps(self, dt: float, accuracy: float, work: MeasuredWork | None) -> tuple[int, str]:
        """How many substeps keep every body's stiffness within `accuracy`, and which body needs them."""
        counts = dt * np.sqrt(self.rates * (1.0 - accuracy) / accuracy)
        if work is not None:
            measured, trust = self._measured(work)
            # From h^2 to h^4, where tets begin to overshoot: this power needs no second correction in either case.
            change = np.clip((measured / (AIM * accuracy)) ** 0.25, FALL, 2.0)
            counts = trust * np.minimum(change * (dt / work.h), counts) + (1.0 - trust) * counts
            stretched = np.maximum(work.strains / (AIM * accuracy) - 1.0, 0.0)
            counts = np.maximum(counts, dt * np.sqrt(self.stretching * stretched)) if self._shells else counts
        worst = int(counts.argmax())
        return max(1, math.ceil(float(counts[worst]) - 1e-9)), self.names[worst]

    def _strains(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        out, shells = np.zeros(len(self.names)), self._system.shells
        if shells is not None:
            e = strains_of(points, shells.triangles, shells.gradients)
            squares = (e * e * [1.0, 1.0, 2.0]).sum(axis=1)
            for k, rows in self._shells:
                out[k] = math.sqrt(squares[rows] @ shells.areas[rows] / shells.areas[rows].sum())
        return out

    def _estimated(self, h: float) -> NDArray[np.float64]:
        error = self.rates * h**2
        return error / (1.0 + error)

    def _measured(self, work: MeasuredWork) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """(b,) the share that each body lacks, and what it counts against the estimate, from 0 to 1."""
        lacks, has, sizes = work.sums.T
        error = np.maximum(lacks, LEAST_PART * sizes)
        strained = np.maximum(has, 0.0)
        tiny = np.finfo(float).tiny
        share = np.minimum(error, strained) / np.maximum(strained, tiny)
        share = np.maximum(share, LEAST_OF_ESTIMATE * self._estimated(work.h))
        return share, strained / np.maximum(strained + self._least, tiny)


def enough(used: int, shares: Mapping[str, float], accuracy: float) -> int:
    """How many substeps let no body lack more than `accuracy`, where it lacks these shares with `used` substeps."""
    worst = min(max(shares.values()), 1.0 - 1e-6)
    return math.ceil(used * math.sqrt(worst / (1.0 - worst) * (1.0 - accuracy) / accuracy) - 1e-9)


def _shear_stiffness(system: System, part: BodyRange) -> float:
    """Twice the shear modulus times the volume [J]; zero for what is not measured."""
    material, volumes = part.body.material, system.rest_volumes[part.tets]
    if part.rigid or not isinstance(material, Elastic):
        return 0.0
    return 2.0 * float(np.broadcast_to(material.per_tet(len(volumes)).mu, len(volumes)) @ volumes)


def _mean_square_frequency(system: System, part: BodyRange) -> float:
    material, w = part.body.material, system.inverse_masses
    if isinstance(material, EdgesAndVolume):
        if material.edge_compliance == 0.0:
            return 0.0
        return float(w[system.edges[part.edges]].sum(axis=1).mean()) / material.edge_compliance
    if part.rigid or not isinstance(material, Elastic):
        return 0.0
    volumes, Dm_inv = system.rest_volumes[part.tets], system.rest_shape_inverse[part.tets]
    b = np.concatenate([-Dm_inv.sum(axis=1, keepdims=True), Dm_inv], axis=1)
    curvatures = np.linalg.eigvalsh(np.einsum("tn,tni,tnj->tij", w[system.tets[part.tets]], b, b))[:, 2]
    each = material.per_tet(len(volumes))
    # lam of the stable Neo-Hookean energy is lam_L + mu.
    squares = 2.0 * volumes * np.maximum(curvatures, 0.0) * (each.lam - 0.5 * each.mu)
    return float(squares @ volumes) / float(volumes.sum())


def _of_hinges(shells: ShellElements, system: System, part: BodyRange) -> float:
    """The mean of D sum w |grad theta|^2 at rest over the hinges of a shell that may turn, zero without any."""
    mine = (shells.hinges[:, 0] >= part.vertices.start) & (shells.hinges[:, 0] < part.vertices.stop)
    w = system.inverse_masses[shells.hinges]
    rows = np.flatnonzero(mine & (w > 0.0).any(axis=1))
    return float(shells.ratios(system.rest_positions, w)[rows].mean()) if len(rows) else 0.0
