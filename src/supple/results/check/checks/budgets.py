"""Checks of conserved quantities: momentum, angular momentum and energy, as far as a recording determines them."""

from __future__ import annotations

from abc import abstractmethod

import numpy as np
from numpy.typing import NDArray

from supple.results.check.frame_check import FrameCheck
from supple.results.check.report import CheckResult
from supple.results.check.settings import CheckSettings
from supple.results.check.trajectory import Snapshot, Trajectory

Floats = NDArray[np.float64]
# Of energies and works, which are recorded and computed here in double precision.
CLOSED = 1e-9
# Momenta by differences of positions that may be in single precision.
_OF_DIFFERENCES = 1e-3
# Works that take energy where nothing moves obstacles.
_PASSIVE = ("contact", "friction", "damping")


class Momentum(FrameCheck):
    """P(t) - P(0) = M g t, where no other force acts."""

    name = "momentum"
    needs = frozenset({"masses", "times", "gravity", "free"})
    good = "changes by gravity alone, within {worst}"
    bad = "changes by {worst} of itself without a force"

    def begin(self) -> None:
        self.why_not = self.of.acting
        self._scale = 0.0

    def see(self, at: Snapshot) -> None:
        m, v, g, first = self.of.masses, at.velocities, self.of.gravity, self.first or at
        t, total = at.time - first.time, float(m.sum())
        pushed = total * float(np.linalg.norm(g)) * t
        self._scale = max(self._scale, float(m @ np.linalg.norm(v, axis=1)) + pushed)
        change = float(np.linalg.norm(m @ v - m @ first.velocities - total * g * t))
        change = max(change - self.of.floors.momentum, 0.0) / (self._scale + total * self.of.floors.speed)
        most = self.settings.max_momentum_change
        if "files" in self.of.knows and most == CheckSettings.max_momentum_change:
            most = _OF_DIFFERENCES
        self.tally.see(at, change, not change <= most)


class Spin(FrameCheck):
    """Angular momentum about the center of mass, from frame to frame, where no other force acts.

    Implicit integrators conserve it only up to an error that falls with the step. With r' = r + h v' and forces without
    a torque about r', backward Euler gives L' - L = h sum m (v' - v) x v, velocities relative to the center of mass.
    Others give terms of at most the same size. A recording of the implicit solver may change L by
    h sum m |v' - v| (|v| + |v'|) in a step.
    """

    name = "spin"
    needs = frozenset({"recording"})
    bad = "angular momentum changes by {worst} of what turns, without a torque"

    def begin(self) -> None:
        self.why_not = self.of.acting
        self.good = "constant within {worst}" + (", beyond the error of the integrator" if self.of.implicit else "")
        if self.why_not is None and self.of.implicit and self.settings.every > 1:
            self.why_not = "the error of an implicit integrator is known from one frame to the next only"
        self._before: tuple[Floats, Floats] | None = None
        self._drift, self._scale = 0.0, 0.0

    def see(self, at: Snapshot) -> None:
        m, x, floors, size = self.of.masses, at.positions, self.of.floors, self.of.size
        total = float(m.sum())
        r, v = x - m @ x / total, at.velocities - m @ at.velocities / total
        L = m @ np.cross(r, v)
        moving = float(m @ (np.linalg.norm(r, axis=1) * np.linalg.norm(v, axis=1)))
        self._scale = max(self._scale, moving + total * size * floors.speed)
        if self._before is not None:
            old_L, old_v = self._before
            speeds = np.linalg.norm(at.velocities, axis=1)
            change = float(np.linalg.norm(L - old_L)) - size * floors.momentum - floors.roundoff * float(m @ speeds)
            if self.of.implicit:
                speeds = np.linalg.norm(v, axis=1) + np.linalg.norm(old_v, axis=1)
                change -= self.of.dt * float(m @ (np.linalg.norm(v - old_v, axis=1) * speeds))
            # Changes beyond the allowed ones add up over the steps.
            self._drift += max(0.0, change)
            share = self._drift / self._scale
            self.tally.see(at, share, not share <= self.settings.max_momentum_change)
        self._before = L, v


class EnergyCheck(FrameCheck):
    """The base class of checks that judge the energies of all frames together."""

    _numbers: list[int]
    _energies: list[tuple[float, float]]

    def begin(self) -> None:
        self._numbers, self._energies = [], []

    def see(self, at: Snapshot) -> None:
        self._numbers.append(at.number)
        elastic = at.elastic_energy
        if elastic is None:
            elastic = float(self.of.records.series("elastic_energy")[at.number])
        fallen = at.positions - (self.first or at).positions
        height = -float((self.of.masses @ fallen) @ self.of.gravity)
        self._energies.append((at.kinetic_energy + elastic + at.stitch_energy, height))

    def result(self) -> CheckResult:
        if self.why_not is None and self._numbers:
            stored, height = np.array(self._energies).T
            scale = float(stored.max() + np.ptp(height)) + self.of.floors.energy
            self.judge(np.array(self._numbers), stored + height, scale)
        return super().result()

    @abstractmethod
    def judge(self, rows: NDArray[np.int64], energy: Floats, scale: float) -> None:
        """Judge the energy (k,) of the frames in `rows`: the kinetic, elastic and stitch energy, and the potential one
        since the first [J]; scale : the energy in motion, never below what is not seen [J]."""

    def see_all(self, rows: NDArray[np.int64], values: Floats, most: float, where: str = "") -> None:
        """Add a number of each of these frames, which fails where it is not within a bound."""
        for number, value in zip(rows, values, strict=True):
            failed = not value <= most
            self.tally.see(self.at(number), float(value), failed, where if failed else "")


class Energy(EnergyCheck):
    """The sum of kinetic, elastic, stitch and potential energy does not grow by more than the recorded works.

    Of a recording without works, not judged where anything but gravity does work.
    """

    name = "energy"
    needs = frozenset({"masses", "times", "gravity", "material"})
    good = "never above the start and the works by more than {worst} of what is moved"
    bad = "grows by {worst}"

    def begin(self) -> None:
        super().begin()
        self._works = recorded_works(self.of)
        if self._works is None:
            self.why_not = self.of.driving

    def see(self, at: Snapshot) -> None:
        held, first = self.of.pinned_vertices, self.first or at
        if self._works is None and not np.array_equal(at.positions[held], first.positions[held]):
            self.why_not = "pinned vertices move, which does work"
        elif self._works is None and not np.array_equal(at.poses, first.poses):
            self.why_not = "obstacles move, which does work"
        else:
            super().see(at)

    def judge(self, rows: NDArray[np.int64], energy: Floats, scale: float) -> None:
        works = self._works or {}
        work, driving = (
            np.cumsum(sum(terms, np.zeros(len(self.of))))[rows]
            for terms in (works.values(), (one for name, one in works.items() if name not in _PASSIVE))
        )
        scale += float(np.abs(work).max())
        # A step whose energy falls gains nothing. Where a body turns far in one step while contact stops it, what the
        # forces at its end take exceeds what is lost.
        gained, risen = np.diff(energy - work), np.diff(energy - driving)
        gained = np.where(gained > 0.0, np.minimum(gained, np.maximum(risen, 0.0)), gained)
        gains = np.append(0.0, np.cumsum(gained)) / scale
        if "files" in self.of.knows:  # differences between frames show fast vibrations one time and not another
            gains = np.maximum(energy - energy[0], 0.0) / scale
        self.see_all(rows, gains, self.settings.max_energy_gain)


class Balance(EnergyCheck):
    """The energy of the positions and velocities changes by the sum of the recorded works, frame by frame."""

    name = "balance"
    needs = frozenset({"recording"})
    good = "works close the balance of energy within {worst}"
    bad = "works miss the change of energy by {worst}"

    def begin(self) -> None:
        super().begin()
        self._works = recorded_works(self.of, numerical=True) or {}
        if not self._works:
            self.why_not = "the recording does not contain works"
        self._breaking: list[float] = []

    def see(self, at: Snapshot) -> None:
        super().see(at)
        self._breaking.append(at.energy_of_latest)

    def judge(self, rows: NDArray[np.int64], energy: Floats, scale: float) -> None:
        residual = self.of.records.frame_values("details/energy_residual")
        terms = np.array([*self._works.values(), residual])
        sums, sizes = np.cumsum(terms.sum(axis=0))[rows], np.cumsum(np.abs(terms).sum(axis=0))[rows]
        scales = scale + sizes
        miss = np.abs(energy - energy[0] - (sums - sums[0]))
        self.see_all(rows, np.maximum(miss - self.of.floors.sums, 0.0) / scales, CLOSED)
        left = np.abs(np.cumsum(residual)[rows]) / scales
        beyond = ~(left <= self.settings.max_energy_gain)
        self.see_all(rows[beyond], left[beyond], self.settings.max_energy_gain, "forces that are not balanced")
        if "breaking" in self._works:
            apart = np.abs(self._works["breaking"][rows] + self._breaking) / scales
            self._see_worst(rows, apart, "breaking")
        for kind, names in (("cavities", "cavity_work"), ("cables", "cable_work")):
            if kind in self._works:
                apart = np.abs(self.of.records.frame_values(f"details/{names}").sum(axis=1) - self._works[kind])
                self._see_worst(np.arange(len(self.of)), apart / scales.max(), kind)

    def _see_worst(self, rows: NDArray[np.int64], values: Floats, work: str) -> None:
        worst = [int(np.argmax(values))]
        self.see_all(rows[worst], values[worst], CLOSED, f"work of {work}")


def recorded_works(of: Trajectory, numerical: bool = False) -> dict[str, Floats] | None:
    """By name, (frames,) [J], without what is numerical; None where the recording has none."""
    for field in of.records.details.fields if "recording" in of.knows else ():
        if field.name == "work" and field.keys:
            named = dict(zip(field.keys, of.records.frame_values("details/work").T, strict=True))
            return {name: work for name, work in named.items() if numerical or name != "numerical"}
    return None
