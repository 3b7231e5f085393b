"""Checks of the order of frames, of what they are made of, and of their unit of length."""

from __future__ import annotations

import numpy as np

from supple.results.check.frame_check import FrameCheck
from supple.results.check.trajectory import Snapshot

# A time step differs from the others by more than this share of them.
_SAME_STEP = 0.01
# A step is twice as long as those before and after it, within this share of it; they agree with each other as well.
_TWICE, _ALIKE = 0.05, 0.2
# Motion that is slower than this share of the size per frame is round-off.
_MOVING = 1e-6
# Between two frames, sides become longer or shorter by no larger factor.
_LARGEST_FACTOR = 2.0


class Cells(FrameCheck):
    """Every frame has the points and cells of the first one."""

    name = "cells"
    needs = frozenset({"files"})
    sees_all = True
    needs_frames = False
    unit = "cells"
    good = "every frame has the cells of the first"
    bad = "a frame has other cells than the first"

    def see(self, at: Snapshot) -> None:
        if at.other is not None:
            self.tally.see(at, 0.0, True, at.other)


class Gaps(FrameCheck):
    """No frame is missing or is there twice: by numbers in names of files, by times, and by the motion itself.

    Where one frame of a smooth motion is missing, all points move by the sum of the steps before and after.
    """

    name = "sequence"
    needs = frozenset({"files"})
    good = "no frame is missing or repeated"
    bad = "a frame is missing or repeated"

    def begin(self) -> None:
        self._frames: list[Snapshot] = []
        for what, values in (("file", self.of.numbers), ("time", self.of.times)):
            if values is None or len(values) < 2:
                continue
            steps = np.diff(values)
            usual = float(np.median(steps))
            wrong = np.flatnonzero(~(np.abs(steps - usual) <= _SAME_STEP * abs(usual)) | ~(steps > 0))
            if len(wrong) and self.settings.every == 1:
                k = int(wrong[0])
                a, b = values[k], values[k + 1]
                self.tally.see(self.at(k + 1), 1.0, True, f"{what} {b:.9g} comes after {what} {a:.9g}")

    def see(self, at: Snapshot) -> None:
        if self.last is not None and at.number != self.last.number + 1:
            self._frames = []
        self._frames = [*self._frames[-3:], at]
        if len(self._frames) < 4:
            return
        one, two, three = np.diff([frame.positions for frame in self._frames], axis=0)
        length, neighbours = float(np.linalg.norm(two)), one + three
        mean = 0.5 * float(np.linalg.norm(neighbours))
        if mean <= _MOVING * self.of.size * np.sqrt(len(two)) or float(np.linalg.norm(one - three)) > _ALIKE * mean:
            return
        if float(np.linalg.norm(two - neighbours)) <= _TWICE * length:
            where = f"between frames {at.number - 2} and {at.number - 1}"
            self.tally.see(self._frames[2], 1.0, True, f"{where} everything moves twice as far as before and after")
        if length == 0.0:
            self.tally.see(self._frames[2], 1.0, True, f"repeats frame {at.number - 2} although everything moves")


class Scale(FrameCheck):
    """The unit of length does not change: not all sides become twice as long, or half as long, from frame to frame."""

    name = "scale"
    good = "largest factor {worst} by which every side changes from frame to frame"
    bad = "every side changes by a factor of {worst} or more: is the unit another one?"
    nothing = "there is one frame only"

    def see(self, at: Snapshot) -> None:
        if self.last is None:
            return
        triangles = self.of.surfaces.triangles
        # A thousand sides are enough to find a change of the unit.
        sides = triangles[:: max(1, len(triangles) // 1000), :2]
        before, lengths = (np.linalg.norm(np.diff(of.points[sides], axis=1)[:, 0], axis=1) for of in (self.last, at))
        known = (before > 0.0) & (lengths > 0.0)
        ratios = lengths[known] / before[known] if known.any() else np.ones(1)
        factor = max(1.0, float(ratios.min()), 1.0 / float(ratios.max()))
        self.tally.see(at, factor, not factor < _LARGEST_FACTOR)
