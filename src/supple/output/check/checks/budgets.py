"""Checks of conserved quantities: momentum, angular momentum and energy, as far as a recording determines them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.output.check.frame_check import FrameCheck
from supple.output.check.report import CheckResult
from supple.output.check.snapshot import Snapshot
from supple.output.recording.reader import Recording
from supple.state import ACTUATOR_WORKS

_UNKNOWN = "the recording does not contain what acts on its bodies: an older version wrote it"
# Motion slower than this share of a body's size per step, and energy of the same share, is round-off.
_FLOOR = 1e-9


def external_action(recording: Recording) -> str | None:
    """What may act on the scene from outside besides gravity, or None."""
    physics = recording.physics
    if physics is None:
        return _UNKNOWN
    if len(recording.pinned_vertices):
        return "pins hold bodies"
    if recording.obstacles:
        return "bodies may rest on obstacles"
    if physics.held_joints:
        return "joints hold bodies"
    if physics.forces or physics.soft_targets:
        return "forces or soft targets act on bodies"
    return None


class Momentum(FrameCheck):
    """P(t) - P(0) = M g t, where no other force acts."""

    name = "momentum"
    good = "changes by gravity alone, within {worst}"
    bad = "changes by {worst} of itself without a force"

    def begin(self) -> None:
        self.why_not = external_action(self.scene.recording)
        self._start: tuple[float, NDArray[np.float64]] | None = None
        self._scale = 0.0

    def see(self, at: Snapshot) -> None:
        recording = self.scene.recording
        m, v, g = recording.masses, at.velocities, recording.gravity
        P = m @ v
        if self._start is None:
            self._start = at.time, P
        t, total = at.time - self._start[0], float(m.sum())
        floor = total * _FLOOR * self.scene.size / recording.dt
        pushed = total * float(np.linalg.norm(g)) * t
        self._scale = max(self._scale, float(m @ np.linalg.norm(v, axis=1)) + pushed + floor)
        change = float(np.linalg.norm(P - self._start[1] - total * g * t)) / self._scale
        self.tally.see(at, change, not change <= self.settings.max_momentum_change)


class Spin(FrameCheck):
    """Angular momentum about the center of mass, from frame to frame, where no other force acts.

    Implicit integrators conserve it only up to an error that falls with the step. With r' = r + h v' and forces without
    a torque about r', backward Euler gives L' - L = h sum m (v' - v) x v, velocities relative to the center of mass.
    Others give terms of at most the same size. A recording of the implicit solver may change L by
    h sum m |v' - v| (|v| + |v'|) in a step.
    """

    name = "spin"
    bad = "angular momentum changes by {worst} of what turns, without a torque"

    def begin(self) -> None:
        recording = self.scene.recording
        self.why_not = external_action(recording)
        self._implicit = (recording.solver or "").startswith("Implicit")
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
        self._scale = max(self._scale, moving + total * self.scene.size**2 * _FLOOR / recording.dt)
        if self._last is not None:
            old_L, old_v = self._last
            change = float(np.linalg.norm(L - old_L))
            if self._implicit:
                speeds = np.linalg.norm(v, axis=1) + np.linalg.norm(old_v, axis=1)
                change -= recording.dt * float(m @ (np.linalg.norm(v - old_v, axis=1) * speeds))
            # Changes beyond the allowed ones add up over the steps.
            self._drift += max(0.0, change)
            share = self._drift / self._scale
            self.tally.see(at, share, not share <= self.settings.max_momentum_change)
        self._last = L, v


class Energy(FrameCheck):
    """The sum of kinetic, elastic, stitch and potential energy does not grow by more than the work of actuators.

    Not judged where anything else does work.
    """

    name = "energy"
    good = "never above the start by more than {worst} of what is moved"
    bad = "grows by {worst}"

    def begin(self) -> None:
        recording = self.scene.recording
        physics = recording.physics
        if physics is None:
            self.why_not = _UNKNOWN
        elif physics.forces or physics.soft_targets:
            self.why_not = "forces or soft targets do work"
        elif physics.scripted_pins:
            self.why_not = "scripted pins do work"
        elif physics.motors:
            self.why_not = "motors do work"
        elif physics.stitches and recording.stitches.laws is None:
            self.why_not = "the recording does not contain the laws of its stitches: an older version wrote it"
        self._first: Snapshot | None = None
        self._rows: list[tuple[int, float, float]] = []

    def see(self, at: Snapshot) -> None:
        recording = self.scene.recording
        self._first = self._first or at
        held = recording.pinned_vertices
        if not np.array_equal(at.positions[held], self._first.positions[held]):
            self.why_not = "pinned vertices move, which does work"
        elif not np.array_equal(at.poses, self._first.poses):
            self.why_not = "obstacles move, which does work"
        else:
            m, v = recording.masses, at.velocities
            elastic = at.elastic_energy
            if elastic is None:
                elastic = float(recording.series("elastic_energy")[at.number])
            moved = 0.5 * float(m @ np.einsum("ij,ij->i", v, v)) + elastic + (at.stitch_energy or 0.0)
            fallen = at.positions - self._first.positions
            self._rows.append((at.number, moved, -float((m @ fallen) @ recording.gravity)))

    def result(self) -> CheckResult:
        if self.why_not is not None:
            return super().result()
        recording = self.scene.recording
        _, stored, height = np.array(self._rows).T
        weight = float(recording.masses.sum() * np.linalg.norm(recording.gravity))
        scale = float(stored.max() + np.ptp(height)) + _FLOOR * weight * self.scene.size + 1e-300
        work = _work_of_actuators(recording)[[number for number, _, _ in self._rows]]
        scale += float(np.abs(work).max())
        gains = (stored + height - stored[0] - height[0] - (work - work[0])) / scale
        for (number, _, _), gain in zip(self._rows, gains, strict=True):
            self.tally.see(recording[number], float(gain), not gain <= self.settings.max_energy_gain)
        return super().result()


def _work_of_actuators(recording: Recording) -> NDArray[np.float64]:
    """(frames,) the work of all cavities since the start, as it was recorded [J]."""
    recorded = [field.name for field in recording.details.fields if field.name in ACTUATOR_WORKS]
    each = (recording.frame_values(f"details/{name}").sum(axis=1) for name in recorded)
    return np.cumsum(sum(each, np.zeros(len(recording))))
