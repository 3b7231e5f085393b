"""Checks of the tetrahedra, at rest and in every frame; of the volumes of bodies; and of the shapes of rigid ones."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from supple.materials.elastic import ELASTIC_MATERIALS, StableNeoHookean
from supple.results.check.frame_check import FrameCheck
from supple.results.check.geometry import quadratic_tets
from supple.results.check.geometry.orientation import volume_signs
from supple.results.check.report import CheckResult
from supple.results.check.trajectory import Snapshot

NEARLY_INCOMPRESSIBLE = 0.45
GENEROUS_VOLUME_CHANGE = 0.5
SMALL_VOLUME_CHANGE = 0.005  # of a part whose material is not known
# The det F below which a tet is noted.
NEARLY_FLAT = 0.05


class RestShape(FrameCheck):
    """Tets, volumes and masses that no frame changes."""

    name = "rest shape"
    needs = frozenset({"recording"})
    needs_frames = False
    unit = "m^3"
    lowest = True
    good = "smallest tet at rest {worst}"
    bad = "not a rest shape: {worst}"

    def begin(self) -> None:
        of, volumes = self.of, self.of.rest_volumes
        if not len(volumes):
            self.why_not = "the scene has no tets"
            return
        flat = volume_signs(of.rest_positions, of.tets) <= 0
        flat[of.quadratic[0]] |= ~quadratic_tets.are_positive(of.quadratic_at_rest)
        bad = np.flatnonzero(flat)
        row = int(bad[0]) if len(bad) else int(np.argmin(volumes))
        self.tally.see(None, volumes[row], len(bad) > 0, of.name("tet", row))
        light = np.flatnonzero(~(of.masses > 0.0))
        if len(light):
            row = int(light[0])
            text = f"{of.name('vertex', row)} has a mass of {of.masses[row]:.6g} kg"
            self.tally.see(None, volumes.min(), True, text)


class Inversion(FrameCheck):
    """The sign of every tet's determinant, exact or everywhere in a quadratic one; the smallest det F is reported."""

    name = "inversion"
    needs = frozenset({"tets"})
    lowest = True
    good = "smallest det F {worst}"
    bad = "inverted or flat, det F {worst}"

    def begin(self) -> None:
        self._crushed: list[int] = []
        if not len(self.of.tets):
            self.why_not = "the scene has no tets"

    def see(self, at: Snapshot) -> None:
        bad = np.flatnonzero(at.signs <= 0)
        J = np.where(np.isfinite(at.least_J), at.least_J, np.inf)
        row = int(bad[np.argmin(J[bad])]) if len(bad) else int(np.argmin(J))
        self.tally.see(at, float(J[row]), len(bad) > 0, lambda: self.of.name("tet", row))
        if J[row] < NEARLY_FLAT:
            self._crushed.append(at.number)

    def result(self) -> CheckResult:
        """With a note on frames in which a tet is crushed: its material seldom asks for that."""
        result = super().result()
        if not self._crushed:
            return result
        frames = "1 frame" if len(self._crushed) == 1 else f"{len(self._crushed)} frames"
        note = f"; below {NEARLY_FLAT:g} in {frames}, first {self._crushed[0]}: crushed"
        return replace(result, message=result.message + note)


class Volume(FrameCheck):
    """The change of each body's volume from that of its stress-free shape."""

    name = "volume"
    good = "largest change {worst} of a body's volume"
    bad = "changes by {worst} of a body's volume"

    def begin(self) -> None:
        self._limits = [self._limit(k) for k in range(len(self.of.bodies))]
        with_tets = [body.tets.stop > body.tets.start for body in self.of.bodies]
        if not any(with_tets) and not any(self.of.surfaces.closed[: len(with_tets)]):
            self.why_not = "no part is closed or has tets"

    def _limit(self, number: int) -> float:
        if self.settings.max_volume_change is not None:
            return self.settings.max_volume_change
        if "material" not in self.of.knows:
            return SMALL_VOLUME_CHANGE
        material, tets = self.of.material, self.of.bodies[number].tets
        kinds, mu = material.kind[tets], material.mu[tets]
        if not ((kinds >= 0) & (kinds < len(ELASTIC_MATERIALS))).all():
            return np.inf
        laws = np.array([law is StableNeoHookean for law in ELASTIC_MATERIALS])[kinds]
        # The lam of the stable Neo-Hookean density is lam + mu of Hooke's law.
        hooke = material.lam[tets] - np.where(laws, mu, 0.0)
        poisson = hooke / (2.0 * (hooke + mu))
        return GENEROUS_VOLUME_CHANGE if (poisson >= NEARLY_INCOMPRESSIBLE - 1e-9).all() else np.inf

    def see(self, at: Snapshot) -> None:
        stress_free, first = self.of.rest_volumes * at.growth[1], self.first or at
        for k, body in enumerate(self.of.bodies):  # of surfaces, the volume of the first frame is that at rest
            change = abs(at.volumes[k] / (float(stress_free[body.tets].sum()) or first.volumes[k]) - 1.0)
            if not np.isnan(change):
                self.tally.see(at, change, not change <= self._limits[k], body.name)


class Rigidity(FrameCheck):
    """|F^T F - 1| of every rigid body, with F the least-squares fit x = F X + t of its surface's vertices."""

    name = "rigidity"
    needs = frozenset({"recording"})
    good = "largest error |F^T F - 1| {worst}"
    bad = "a rigid body is deformed by {worst}"

    def begin(self) -> None:
        rigid = [body for body in self.of.bodies if body.rigid]
        if not rigid:
            self.why_not = "the scene has no rigid body"
        self._rest = [(body, body.points(self.of.rest_positions)) for body in rigid]

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
