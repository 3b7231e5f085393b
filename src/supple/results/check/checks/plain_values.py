"""Checks of plain recorded values: finite numbers, the order of frames, the status of steps."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from supple.model.state import Status
from supple.results.check.frame_check import FrameCheck
from supple.results.check.trajectory import Snapshot
from supple.results.recording.recorder import REPORT_NUMBERS, REPORT_VECTORS

# Arrays that all frames share.
CONSTANTS = ("rest_positions", "rest_volumes", "masses", "gravity")
# These series use NaN for "not known".
_MAY_BE_UNKNOWN = ("min_distance", "largest_stitch_stretch")
_SAME_TIME = 1e-9

# How far the displacement of a body in a step may differ from that of its velocities, as a share of its speed times the
# step. In unchanged recordings it was less than 0.1.
_LARGEST_DEVIATION = 0.75


class Finite(FrameCheck):
    """Every number of the file, those of the reports included."""

    name = "finite"
    sees_all = True
    needs_frames = False
    unit = "numbers"
    good = "all numbers are finite"
    bad = "not finite: {worst}"

    def begin(self) -> None:
        for what in CONSTANTS:
            count = _bad_count(getattr(self.of, what))
            if count:
                self.tally.see(None, count, True, what.replace("_", " "))

    def see(self, at: Snapshot) -> None:
        found = [(count, where) for count, where in self._bad(at) if count] if at.other is None else []
        self.tally.see(at, sum(count for count, _ in found), bool(found), found[0][1] if found else "")

    def _bad(self, at: Snapshot) -> Iterator[tuple[int, str]]:
        yield self._bad_rows(at.positions, "position", "vertex")
        yield _bad_count(at.poses), "pose of an obstacle"
        if at.recorded is not None:
            yield self._bad_rows(at.velocities, "velocity", "vertex")
            yield self._bad_rows(at.recorded.det_F[:, None], "det F", "tet")
            for name in (*REPORT_NUMBERS, *REPORT_VECTORS):
                if name not in _MAY_BE_UNKNOWN:
                    yield _bad_count(self.of.records.series(name)[at.number]), f"recorded {name}"

    def _bad_rows(self, values: NDArray[np.float64], what: str, kind: Literal["vertex", "tet"]) -> tuple[int, str]:
        count = _bad_count(values)
        if not count:
            return 0, ""
        row = int(np.argmin(np.isfinite(values).all(axis=1)))
        return count, f"{what} of {self.of.name(kind, row)}"


def _bad_count(values: NDArray[np.float64]) -> int:
    return int(np.count_nonzero(~np.isfinite(values)))


class Sequence(FrameCheck):
    """Times and numbers of all frames; repetitions among the checked frames."""

    name = "sequence"
    needs = frozenset({"recording"})
    needs_frames = False
    good = "frames follow each other"
    bad = "frames do not follow each other"

    def begin(self) -> None:
        times, dt, records = self.of.times, self.of.dt, self.of.records
        indices = records.frame_values("index").astype(np.int64)
        for k in range(1, len(self.of)):
            time, step = float(times[k]), float(times[k] - times[k - 1])
            rounding = 4.0 * np.finfo(np.float64).eps * abs(time)
            # A step that failed ends where the solver got to, at the latest with its length; `Converged` names it.
            failed = not records.statuses[k].can_go_on
            if failed and 0.0 <= step <= dt * (1.0 + _SAME_TIME) + rounding:
                step = dt
            if not step > 0.0:
                self.tally.see(self.at(k), step, True, f"time {time:.9g} s does not come after the one before")
            elif indices[k] - indices[k - 1] != 1:
                self.tally.see(self.at(k), step, True, f"number {indices[k]} does not follow {indices[k - 1]}")
            elif abs(step - dt) > _SAME_TIME * dt + rounding:
                self.tally.see(self.at(k), step, True, f"a step of {step:.9g} s, not of {dt:.9g} s")

    def see(self, at: Snapshot) -> None:
        before, status = self.last, self.of.records.statuses[at.number]
        if before is None:
            return
        if not np.array_equal(before.positions, at.positions):
            # XPBD may push a body out of another one and stop it within the same frame.
            if self.of.implicit and status is Status.CONVERGED and at.number == before.number + 1:
                self._follow(before, at)
            return
        slowest = min(float(np.abs(frame.velocities).max(initial=0.0)) for frame in (before, at))
        if slowest > self.of.floors.speed and status.can_go_on:
            self.tally.see(at, slowest, True, f"repeats frame {before.number} although it moves")

    def _follow(self, before: Snapshot, at: Snapshot) -> None:
        """Whether the displacements of bodies agree with their velocities before and after the step."""
        step = at.time - before.time
        fall = float(np.linalg.norm(self.of.gravity)) * abs(step)
        masses = [self.of.masses[body.vertices] / self.of.masses[body.vertices].sum() for body in self.of.bodies]
        speeds = np.array(
            [
                [np.sqrt(share @ (frame.velocities[body.vertices] ** 2).sum(axis=1)) for frame in (before, at)]
                for body, share in zip(self.of.bodies, masses, strict=True)
            ]
        )
        # What is light takes the velocity of what hits it, and may lose it, within the step.
        largest = _LARGEST_DEVIATION * (float(speeds.max(initial=0.0)) + fall)
        for body, share, speed in zip(self.of.bodies, masses, speeds, strict=True):
            rows = body.vertices
            first, last = (share @ frame.velocities[rows] for frame in (before, at))
            mean = share @ (at.positions[rows] - before.positions[rows]) / step
            # The mean velocity of a step is between those before and after it; a static solver leaves none after it.
            change = last - first
            along = np.clip((mean - first) @ change / max(float(change @ change), 1e-300), 0.0, 1.0)
            off = float(np.linalg.norm(mean - first - along * change))
            rounding = self.of.floors.speed * self.of.dt / abs(step)
            if speed[1] > 0.0 and off > largest + rounding:
                where = f"{body.name} is {off * abs(step):.3g} m from where its velocities lead"
                self.tally.see(at, off, True, where)


class Converged(FrameCheck):
    """The recorded status of every step."""

    name = "status"
    needs = frozenset({"recording"})
    needs_frames = False
    good = "every step converged"
    bad = "a step did not converge"

    def begin(self) -> None:
        for number, status in enumerate(self.of.records.statuses):
            if status is not Status.CONVERGED:
                self.tally.see(self.at(number), 1.0, True, str(status))
