"""Checks of conserved quantities: momentum, angular momentum and energy, as far as a recording determines them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.results.check.frame_check import FrameCheck
from supple.results.check.report import CheckResult
from supple.results.check.settings import CheckSettings
from supple.results.check.snapshot import Scene, Snapshot
from supple.results.check.trajectory import Trajectory

# Of energies and works, which are recorded and computed here in double precision.
_CLOSED = 1e-9
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
        self.why_not = self.scene.recording.acting
        self._start: tuple[float, NDArray[np.float64]] | None = None
        self._scale = 0.0

    def see(self, at: Snapshot) -> None:
        recording = self.scene.recording
        m, v, g = recording.masses, at.velocities, recording.gravity
        P = m @ v
        if self._start is None:
            self._start = at.time, P
        t, total = at.time - self._start[0], float(m.sum())
        pushed = total * float(np.linalg.norm(g)) * t
        self._scale = max(self._scale, float(m @ np.linalg.norm(v, axis=1)) + pushed)
        change = max(float(np.linalg.norm(P - self._start[1] - total * g * t)) - self.scene.floors.momentum, 0.0)
        change /= self._scale + total * self.scene.floors.speed
        most = self.settings.max_momentum_change
        if "files" in recording.knows and most == CheckSettings.max_momentum_change:
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
        recording = self.scene.recording
        self.why_not = recording.acting
        self._implicit = (recording.records.solver or "").startswith("Implicit")
        self.good = "constant within {worst}" + (", beyond the error of the integrator" if self._implicit else "")
        if self.why_not is None and self._implicit and self.settings.every > 1:
            self.why_not = "the error of an implicit integrator is known from one frame to the next only"
        self._last: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None
        self._drift, self._scale = 0.0, 0.0

    def see(self, at: Snapshot) -> None:
        recording = self.scene.recording
        m, x = recording.masses, at.positions
        total = float(m.sum())
        r, v = x - m @ x / total, at.velocities - m @ at.velocities / total
        L = m @ np.cross(r, v)
        moving = float(m @ (np.linalg.norm(r, axis=1) * np.linalg.norm(v, axis=1)))
        floors, size = self.scene.floors, self.scene.size
        self._scale = max(self._scale, moving + total * size * floors.speed)
        if self._last is not None:
            old_L, old_v = self._last
            speeds = np.linalg.norm(at.velocities, axis=1)
            change = float(np.linalg.norm(L - old_L)) - size * floors.momentum - floors.roundoff * float(m @ speeds)
            if self._implicit:
                speeds = np.linalg.norm(v, axis=1) + np.linalg.norm(old_v, axis=1)
                change -= recording.dt * float(m @ (np.linalg.norm(v - old_v, axis=1) * speeds))
            # Changes beyond the allowed ones add up over the steps.
            self._drift += max(0.0, change)
            share = self._drift / self._scale
            self.tally.see(at, share, not share <= self.settings.max_momentum_change)
        self._last = L, v


class Energy(FrameCheck):
    """The sum of kinetic, elastic, stitch and potential energy does not grow by more than the recorded works.

    Of a recording without works, not judged where anything but gravity does work.
    """

    name = "energy"
    needs = frozenset({"masses", "times", "gravity", "material"})
    good = "never above the start and the works by more than {worst} of what is moved"
    bad = "grows by {worst}"

    def begin(self) -> None:
        recording = self.scene.recording
        self._works = recorded_works(recording)
        if self._works is None:
            self.why_not = recording.driving
        self._first: Snapshot | None = None
        self._rows: list[tuple[int, float, float]] = []

    def see(self, at: Snapshot) -> None:
        self._first = self._first or at
        held = self.scene.recording.pinned_vertices
        if self._works is None and not np.array_equal(at.positions[held], self._first.positions[held]):
            self.why_not = "pinned vertices move, which does work"
        elif self._works is None and not np.array_equal(at.poses, self._first.poses):
            self.why_not = "obstacles move, which does work"
        else:
            self._rows.append((at.number, *moved_and_height(at, self._first)))

    def result(self) -> CheckResult:
        if self.why_not is not None:
            return super().result()
        recording = self.scene.recording
        numbers, stored, height = np.array(self._rows).T
        rows, works = numbers.astype(int), self._works or {}
        work, driving = (
            np.cumsum(sum(each, np.zeros(len(recording))))[rows]
            for each in (works.values(), (one for name, one in works.items() if name not in _PASSIVE))
        )
        scale = energy_scale(self.scene, stored, height) + float(np.abs(work).max())
        # A step whose energy falls gains nothing. Where a body turns far in one step while contact stops it, what the
        # forces at its end take exceeds what is lost.
        energy = stored + height
        gained, risen = np.diff(energy - work), np.diff(energy - driving)
        gained = np.where(gained > 0.0, np.minimum(gained, np.maximum(risen, 0.0)), gained)
        gains = np.append(0.0, np.cumsum(gained)) / scale
        if "files" in recording.knows:  # differences between frames show fast vibrations one time and not another
            gains = np.maximum(energy - energy[0], 0.0) / scale
        for (number, _, _), gain in zip(self._rows, gains, strict=True):
            self.tally.see(self.at(number), float(gain), not gain <= self.settings.max_energy_gain)
        return super().result()


class Balance(FrameCheck):
    """The energy of the positions and velocities changes by the sum of the recorded works, frame by frame."""

    name = "balance"
    needs = frozenset({"recording"})
    good = "works close the balance of energy within {worst}"
    bad = "works miss the change of energy by {worst}"

    def begin(self) -> None:
        recording = self.scene.recording
        self._works = recorded_works(recording, numerical=True)
        if self._works is None:
            self.why_not = "the recording does not contain works"
        self._first: Snapshot | None = None
        self._rows: list[tuple[int, float, float]] = []
        self._breaking: list[float] = []

    def see(self, at: Snapshot) -> None:
        self._first = self._first or at
        self._rows.append((at.number, *moved_and_height(at, self._first)))
        self._breaking.append(at.energy_of_latest)

    def result(self) -> CheckResult:
        if self.why_not is not None or self._works is None:
            return super().result()
        recording = self.scene.recording
        numbers, stored, height = np.array(self._rows).T
        rows = numbers.astype(int)
        residual = recording.records.frame_values("details/energy_residual")
        each = np.array([*self._works.values(), residual])
        sums, sizes = np.cumsum(each.sum(axis=0))[rows], np.cumsum(np.abs(each).sum(axis=0))[rows]
        scale = energy_scale(self.scene, stored, height) + sizes
        miss = np.abs(stored + height - stored[0] - height[0] - (sums - sums[0]))
        open_ = np.maximum(miss - self.scene.floors.sums, 0.0) / scale
        left = np.abs(np.cumsum(residual)[rows]) / scale
        for number, miss, rest in zip(rows, open_, left, strict=True):
            at = self.at(number)
            self.tally.see(at, float(miss), not miss <= _CLOSED)
            if not rest <= self.settings.max_energy_gain:
                self.tally.see(at, float(rest), True, "forces that are not balanced")
        if "breaking" in self._works:
            apart = np.abs(self._works["breaking"][rows] + self._breaking) / scale
            worst = int(np.argmax(apart))
            failed = not apart[worst] <= _CLOSED
            self.tally.see(self.at(rows[worst]), float(apart[worst]), failed, "work of breaking")
        for kind, names in (("cavities", "cavity_work"), ("cables", "cable_work")):
            if kind in self._works:
                apart = np.abs(recording.records.frame_values(f"details/{names}").sum(axis=1) - self._works[kind])
                worst = int(np.argmax(apart))
                share = float(apart[worst] / scale.max())
                self.tally.see(self.at(worst), share, not share <= _CLOSED, f"work of {kind}")
        return super().result()


def recorded_works(recording: Trajectory, numerical: bool = False) -> dict[str, NDArray[np.float64]] | None:
    """By name, (frames,) [J], without what is numerical; None where the recording has none."""
    if "recording" not in recording.knows:
        return None
    for field in recording.records.details.fields:
        if field.name == "work" and field.keys:
            values = recording.records.frame_values("details/work").T
            named = dict(zip(field.keys, values, strict=True))
            return {name: work for name, work in named.items() if numerical or name != "numerical"}
    return None


def moved_and_height(at: Snapshot, first: Snapshot) -> tuple[float, float]:
    """The kinetic, elastic and stitch energy of a frame, and the potential one since the first [J]."""
    recording = at.scene.recording
    m, v = recording.masses, at.velocities
    elastic = at.elastic_energy
    if elastic is None:
        elastic = float(recording.records.series("elastic_energy")[at.number])
    stitches = at.stitch_energy
    if stitches is None:
        stitches = float(recording.records.series("stitch_energy")[at.number])
    moved = 0.5 * float(m @ np.einsum("ij,ij->i", v, v)) + elastic + stitches
    return moved, -float((m @ (at.positions - first.positions)) @ recording.gravity)


def energy_scale(scene: Scene, stored: NDArray[np.float64], height: NDArray[np.float64]) -> float:
    """The energy in motion [J], never below what is not seen."""
    return float(stored.max() + np.ptp(height)) + scene.floors.energy
