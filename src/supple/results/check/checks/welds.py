"""The check of welds: welded vertices stay where they are on their rigid bodies."""

from __future__ import annotations

import numpy as np

from supple.results.check.frame_check import FrameCheck
from supple.results.check.snapshot import Snapshot


class Welds(FrameCheck):
    """How far welded vertices are from where the affine motion of the rigid body since the first frame puts them."""

    name = "welds"
    good = "welded vertices stay in place within {worst} of the rigid body's size"
    bad = "a welded vertex is off by {worst} of the rigid body's size"

    def begin(self) -> None:
        if not self.scene.recording.welds:
            self.why_not = "the scene has no weld"
        self._first: Snapshot | None = None

    def see(self, at: Snapshot) -> None:
        self._first = self._first or at
        recording = self.scene.recording
        for weld in recording.welds:
            control = recording.bodies[weld.rigid].vertices
            before, now = self._first.positions, at.positions
            fit = np.column_stack([before[control], np.ones(4)])
            motion = np.linalg.solve(fit, now[control])
            there = np.column_stack([before[weld.vertices], np.ones(len(weld.vertices))]) @ motion
            size = float(np.linalg.norm(np.ptp(before[control], axis=0)))
            off = np.linalg.norm(now[weld.vertices] - there, axis=1) / size
            worst = int(off.argmax())
            failed = not off[worst] <= self.settings.max_weld_error
            self.tally.see(at, float(off[worst]), failed, self.scene.name("vertex", int(weld.vertices[worst])))
