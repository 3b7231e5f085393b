"""Compares recorded measures with those of the recorded positions and velocities."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from supple.results.check.frame_check import FrameCheck
from supple.results.check.snapshot import Snapshot, edge_vectors

# Allowed difference, as a share of the natural size of each quantity; both sides are computed in double precision.
_SAME = 1e-9
_NOTHING = 1e-300


class Records(FrameCheck):
    """Determinants tet by tet, the smallest of them, energies and momenta."""

    name = "records"
    needs = frozenset({"recording"})
    good = "agree within {worst}"
    bad = "differ by {worst} from what the positions give"

    def begin(self) -> None:
        self._inverse_sizes = np.linalg.norm(self.scene.rest_inverse, axis=(1, 2))

    def see(self, at: Snapshot) -> None:
        # Another check finds numbers that are not finite.
        differences = [(value, where) for value, where in self._differences(at) if np.isfinite(value)]
        value, where = max(differences, default=(0.0, ""))
        failed = value > _SAME
        self.tally.see(at, value, failed, where if failed else "")

    def _differences(self, at: Snapshot) -> Iterator[tuple[float, str]]:
        recording, k = self.scene.recording, at.number
        m, x, v = recording.masses, at.positions, at.velocities
        sizes = np.linalg.norm(edge_vectors(x, recording.tets), axis=(1, 2)) * self._inverse_sizes
        sizes = np.maximum(1.0, sizes) ** 3
        apart = np.abs(at.det_F - at.J) / sizes
        apart[~np.isfinite(apart)] = 0.0
        row = int(np.argmax(apart))
        yield float(apart[row]), f"det F of {self.scene.name('tet', row)}"
        recorded = recording.records.series("min_det_F")[k]
        yield abs(recorded - at.least_J.min()) / sizes[int(np.argmin(at.least_J))], "smallest det F"
        kinetic = 0.5 * float(m @ np.einsum("ij,ij->i", v, v))
        recorded = recording.records.series("kinetic_energy")[k]
        yield abs(recorded - kinetic) / (kinetic + _NOTHING), "kinetic energy"
        potential = -float((m @ x) @ recording.gravity)
        heights = float(m @ np.linalg.norm(x, axis=1)) * float(np.linalg.norm(recording.gravity))
        recorded = recording.records.series("potential_energy")[k]
        yield abs(recorded - potential) / (heights + _NOTHING), "potential energy"
        for name, energy in (
            ("elastic energy", at.elastic_energy),
            ("stitch energy", at.stitch_energy),
        ):
            if energy is not None:
                recorded = recording.records.series(name.replace(" ", "_"))[k]
                yield abs(recorded - energy) / (abs(energy) + self.scene.floors.sums / _SAME), name
        momentum = m @ v
        recorded = recording.records.series("linear_momentum")[k]
        speeds = np.linalg.norm(v, axis=1)
        yield float(np.linalg.norm(recorded - momentum)) / (float(m @ speeds) + _NOTHING), "linear momentum"
        r = x - m @ x / m.sum()
        spin = m @ np.cross(r, v - momentum / m.sum())
        recorded = recording.records.series("angular_momentum")[k]
        turning = float(m @ (np.linalg.norm(r, axis=1) * speeds))
        yield float(np.linalg.norm(recorded - spin)) / (turning + _NOTHING), "angular momentum"
