"""Measures every frame: what is wrong with its end, and what the next frame must know."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.model.crushed import CRUSHED
from supple.model.system import System
from supple.solvers.xpbd.assessment.energy_balance import EnergyBalance
from supple.solvers.xpbd.assessment.findings import Findings, count_inverted, tangled_bodies
from supple.solvers.xpbd.assessment.softening import MeasuredWork, Softening
from supple.solvers.xpbd.assessment.surfaces import Overlap, SurfaceCheck
from supple.solvers.xpbd.contact.settings import XPBDContact
from supple.solvers.xpbd.moment import Moment

# Of the energy of the scene: what appears in a frame, and does not count. Old overlaps are removed with as little.
LEAST_GAIN = 2e-4


@dataclass(frozen=True)
class Ledger:
    """What an assessment must know of the frames before.

    Attributes
    ----------
    tangled : names of the bodies that began with inverted tets and still have some
    excess : energy without a source that has not been lost since [J]
    open : sum of the residuals of works [J], see `Report.energy_residual`
    scale : the largest energy so far without the excess of its time, to compare the excess with [J]
    """

    tangled: frozenset[str] = frozenset()
    excess: float = 0.0
    open: float = 0.0
    scale: float = 0.0


class Assessment:
    """What is needed to judge the frames of a system, in the solver's numbering.

    Parameters
    ----------
    settings : of contact; edge_length : mean surface edge [m]
    """

    def __init__(self, system: System, settings: XPBDContact | None, edge_length: float) -> None:
        self.system = system
        self.softening = Softening(system)
        self.balance = EnergyBalance(system, edge_length)
        self.surfaces = SurfaceCheck(system, settings, edge_length)
        self._ledger = Ledger()
        self._whole = np.zeros(len(system.tets), dtype=np.bool_)

    def begin(self, moment: Moment, J: NDArray[np.float64], h: float, ledger: Ledger | None) -> NDArray[np.bool_]:
        """Begin a frame. Returns the tets (m,) of the bodies without an inverted one.

        Parameters
        ----------
        J : (m,) of all tets; h : length of the substeps [s]; ledger : of the frame before, None at the start
        """
        tangled = tangled_bodies(self.system, J)
        self._ledger = Ledger(tangled=tangled) if ledger is None else ledger
        self.balance.begin(moment, h)
        sound = np.ones(len(J), dtype=np.bool_)
        for part in self.system.bodies:
            sound[part.tets] = part.name not in tangled
        self._whole = sound & (J >= CRUSHED)
        return sound

    def end(
        self,
        moment: Moment,
        overlaps: list[Overlap],
        J: NDArray[np.float64],
        h: float,
        accuracy: float,
        held: float,
        asleep: NDArray[np.bool_],
        works: Mapping[str, float],
        residual: float,
        measured: MeasuredWork,
    ) -> tuple[Findings, Ledger]:
        """Judge the end of a frame.

        Parameters
        ----------
        overlaps : of surfaces and obstacles; J : (m,) of all tets
        h : length of the substeps [s]; accuracy : how much stiffness a body may lack
        held : the share of the substeps in which the motion of bodies was shortened
        asleep : (b,) bodies that did not move; works : of the frame, by name, residual : of these [J]
        measured : of the stresses that substeps of h delivered, with this frame
        """
        before = self._ledger
        tangled = before.tangled & tangled_bodies(self.system, J)
        gain, energy, gainer = self.balance.end(moment, works)
        counts = not 0.0 < gain < LEAST_GAIN * max(before.scale, energy)
        excess = max(0.0, before.excess + (gain if counts else 0.0))
        scale = max(before.scale, energy - max(before.excess, excess))
        open_ = before.open + residual
        unsolved = abs(residual) > LEAST_GAIN * scale
        lacks = zip(self.softening.shares(h, measured).tolist(), self.softening.names, strict=True)
        findings = Findings(
            inverted=count_inverted(self.system, J, tangled),
            overlaps=overlaps,
            held=held,
            gained=excess / (scale + excess) if excess > 0.0 else 0.0,
            open=abs(open_) / (scale + abs(open_)) if unsolved else 0.0,
            gainer=self.system.bodies[gainer].name,
            crushed=bool((J[self._whole] < CRUSHED).any()),
            softened=[(share, name) for share, name in lacks if share > accuracy],
        )
        return findings, Ledger(tangled, excess, open_, scale)
