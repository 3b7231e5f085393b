"""Compares recorded measures with those of the recorded positions and velocities."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from supple.results.check.frame_check import FrameCheck
from supple.results.check.geometry.vectors import edge_vectors
from supple.results.check.trajectory import Snapshot

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
        self._inverse_sizes = np.linalg.norm(self.of.rest_inverse, axis=(1, 2))

    def see(self, at: Snapshot) -> None:
        # Another check finds numbers that are not finite.
        differences = [(value, where) for value, where in self._differences(at) if np.isfinite(value)]
        value, where = max(differences, default=(0.0, ""))
        failed = value > _SAME
        self.tally.see(at, value, failed, where if failed else "")

    def _differences(self, at: Snapshot) -> Iterator[tuple[float, str]]:
        of, m, x, v = self.of, self.of.masses, at.positions, at.velocities
        sizes = np.linalg.norm(edge_vectors(x, of.tets), axis=(1, 2)) * self._inverse_sizes
        sizes = np.maximum(1.0, sizes) ** 3
        apart = np.abs(of.records[at.number].det_F - at.J) / sizes
        apart[~np.isfinite(apart)] = 0.0
        if len(apart):
            row = int(np.argmax(apart))
            yield float(apart[row]), f"det F of {of.name('tet', row)}"
        thin = [stored.least_ratio(x[body.vertices]) for body, stored in of.thin]
        J, largest = np.append(at.least_J, thin), np.append(sizes, np.ones(len(thin)))
        g, speeds = float(np.linalg.norm(of.gravity)), np.linalg.norm(v, axis=1)
        momentum, r = m @ v, x - m @ x / m.sum()
        turning = float(m @ (np.linalg.norm(r, axis=1) * speeds))
        measured = {
            "min_det_F": (J.min(), largest[int(np.argmin(J))]),
            "kinetic_energy": (at.kinetic_energy, at.kinetic_energy + _NOTHING),
            "potential_energy": (-float((m @ x) @ of.gravity), float(m @ np.linalg.norm(x, axis=1)) * g + _NOTHING),
            "linear_momentum": (momentum, float(m @ speeds) + _NOTHING),
            "angular_momentum": (m @ np.cross(r, v - momentum / m.sum()), turning + _NOTHING),
        }
        for name, energy in (("elastic_energy", at.elastic_energy), ("stitch_energy", at.stitch_energy)):
            if energy is not None:
                measured[name] = energy, abs(energy) + of.floors.sums / _SAME
        for name, (value, size) in measured.items():
            text = "smallest det F" if name == "min_det_F" else name.replace("_", " ")
            yield float(np.linalg.norm(of.records.series(name)[at.number] - value) / size), text
