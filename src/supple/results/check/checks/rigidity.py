"""The check of rigid bodies: all distances on their surfaces stay those at rest."""

from __future__ import annotations

import numpy as np

from supple.results.check.frame_check import FrameCheck
from supple.results.check.snapshot import Snapshot


class Rigidity(FrameCheck):
    """|F^T F - 1| of every rigid body, with F the least-squares fit x = F X + t of its surface's vertices."""

    name = "rigidity"
    good = "largest error |F^T F - 1| {worst}"
    bad = "a rigid body is deformed by {worst}"

    def begin(self) -> None:
        rigid = [body for body in self.scene.recording.bodies if body.rigid]
        if not rigid:
            self.why_not = "the scene has no rigid body"
        self._rest = [(body, body.points(self.scene.recording.rest_positions)) for body in rigid]

    def see(self, at: Snapshot) -> None:
        for body, rest in self._rest:
            X = rest - rest.mean(axis=0)
            x = body.points(at.positions)
            x = x - x.mean(axis=0)
            F = np.linalg.lstsq(X, x, rcond=None)[0].T
            mirrored = bool(np.linalg.det(F) <= 0.0)
            error = float(np.linalg.norm(F.T @ F - np.eye(3)))
            failed = mirrored or not error <= self.settings.max_orthogonality_error
            self.tally.see(at, error, failed, f"{body.name}, mirrored" if mirrored else body.name)
