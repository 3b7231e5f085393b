"""The works of pins, loads, actuators and contact, computed again from positions and recorded values and forces.

Between two frames a force f moves its vertex by d. The trapezoid (f + f') d / 2 is of second order in the time between
frames; half of |f' d - f d| is how far it may be off, while a force changes in one direction. What the frames leave
open adds up, and a recorded work may differ by it.

A cavity or a span of a cable has one force Q on its volume or length s, so that its work is Q ds, with the Q of the
frame, which is the mean over its substeps. Before the first step no Q is known, and that step is left out: a given
volume may begin with a jump.

The force of pins is what balances the elastic and stitch forces, weight and inertia on pinned vertices. With E(x) the
sum of both energies, the elastic part is the derivative of E along the motion of the pinned vertices alone. Barriers
against inversion, which are in no energy of a frame, act on pins as well: the steps in which they may are left out.
"""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from supple.materials.elastic_tets.active import MUSCLE
from supple.results.check.checks.budgets import energy_scale, moved_and_height, recorded_works
from supple.results.check.frame_check import FrameCheck
from supple.results.check.report import CheckResult
from supple.results.check.snapshot import Snapshot

# Of a difference quotient of the energy, as a share of the motion between two frames.
_STEP = 1e-6
# J below which a barrier against inversion may act, where the recording does not say it.
_BARRIER_ONSET = 0.1
# What else may act on pinned vertices, up to a bound that is known.
_BESIDE_PINS = {"contact", "friction", "damping", "flow", "growth", "breaking"}
# Round-off, as a share of the energies.
_CLOSED = 1e-9
# Contact forces are recorded in single precision.
_SINGLE = 1e-6


# Works of loads whose forces recordings may not contain, and of what they never contain.
_NOT_RECORDED = {
    "body_forces": "a force per mass that depends on the place is not recorded",
    "forces": "forces that differ from vertex to vertex are not recorded",
}
_NEVER_RECORDED = {
    "soft_targets": "places of targets are not recorded",
    "joints": "their forces do not bound them within a frame",
}


class Works(FrameCheck):
    """The recorded works of pins, loads and contact are those of the frames.

    Attributes
    ----------
    frames : of each frame, for each part that is judged, the work [J] and how far it may be off [J]
    """

    name = "works"
    needs = frozenset({"recording"})
    bad = "differ by {worst} from those of the frames"

    def begin(self) -> None:
        recording = self.scene.recording
        self._works = recorded_works(recording) or {}
        self._left_out = self._not_recorded()
        self._actuators = {"cavities"} & set(self._works) if recording.cavities else set()
        self._actuators |= {"cables"} & set(self._works) if recording.cables else set()
        self._loads = set(self._works) & ({load.work for load in recording.loads.values()} | {"muscles"})
        self._loads = (self._loads | self._actuators) - set(self._left_out)
        self._open = {"pins": self._pins_are_open(), "contact": self._contact_is_open()}
        self._parts = [name for name, why in self._open.items() if why is None] + sorted(self._loads)
        named = " and ".join([", ".join(self._parts[:-1])] * (len(self._parts) > 1) + self._parts[-1:])
        self.good = f"those of {named} agree within {{worst}}, beyond what frames leave open"
        self.good += "".join(f"; without {name}: {why}" for name, why in self._left_out.items())
        if not self._works:
            self.why_not = "the recording does not contain works"
        elif self.settings.every > 1:
            self.why_not = "works are computed from one frame to the next only"
        elif not self._parts:
            self.why_not = "; ".join(f"{name}: {why}" for name, why in [*self._open.items(), *self._left_out.items()])
        self._implicit = (recording.records.solver or "").startswith("Implicit")
        onset = re.search(r"barrier_onset=([-+.\de]+)", recording.records.solver or "")
        self._onset = float(onset[1]) if onset else _BARRIER_ONSET
        self._last: Snapshot | None = None
        self._forces = np.zeros_like(recording.rest_positions)
        self._first: Snapshot | None = None
        self._rows: list[tuple[int, float, float]] = []
        self.frames: list[list[tuple[float, float]]] = []

    def _not_recorded(self) -> dict[str, str]:
        """The works that are not judged, and why: what recordings do not contain."""
        recording = self.scene.recording
        reasons = {name: why for name, why in _NOT_RECORDED.items() if name in recording.other_loads}
        reasons |= _NEVER_RECORDED
        if recording.quadratic is not None:
            fibres = [each.rows for each in recording.frame(0).active if each.kind == MUSCLE]
            if fibres and np.isin(np.concatenate(fibres), recording.quadratic[0]).any():
                reasons["muscles"] = "they act in quadratic tets"
        return {name: why for name, why in reasons.items() if name in self._works}

    def _pins_are_open(self) -> str | None:
        recording = self.scene.recording
        others = sorted(set(self._works) - _BESIDE_PINS - self._loads - {"pins"})
        rigid = np.zeros(len(recording.rest_positions), dtype=bool)
        for body in recording.bodies:
            rigid[body.vertices] = body.rigid
        if "pins" not in self._works:
            return "nothing is pinned"
        if not all(map(recording.knows_law, range(len(recording.bodies)))):
            return "the recording does not contain the law of a body"
        if rigid[recording.pinned_vertices].any():
            return "a pinned body is rigid"
        if others:
            return f"the forces of {', '.join(others)} on pinned vertices are not recorded"
        return "welds may act on pinned vertices" if recording.welds else None

    def _contact_is_open(self) -> str | None:
        if not any(field.name == "contact_force" for field in self.scene.recording.records.fields):
            return "forces on vertices were not recorded (fields=['contact_force'])"
        if any(body.rigid or body.skin is not None for body in self.scene.recording.bodies):
            return "forces on rigid bodies and skins are not recorded"
        return None

    def see(self, at: Snapshot) -> None:
        last, forces = self._last, self._forces
        if self._open["contact"] is None:
            forces = self.scene.recording.records[at.number].contact_force.values_of_all
        found = [(0.0, 0.0)] * len(self._parts)
        if last is not None:
            moved = at.positions - last.positions
            by_name = {"contact": self._of_contact(last, at, forces, moved)}
            by_name |= {name: self._of_load(last, at, name, moved) for name in self._loads}
            of = {name: (float(work.sum()), float(left.sum())) for name, (work, left) in by_name.items()}
            of |= {name: self._of_actuators(last, at, name) for name in self._actuators}
            if "pins" in self._parts:
                of["pins"] = self._of_pins(last, at, moved, by_name)
            found = [of[name] for name in self._parts]
        self._first = self._first or at
        self._rows.append((at.number, *moved_and_height(at, self._first)))
        self.frames.append(found)
        self._last, self._forces = at, forces

    def _of_contact(
        self, last: Snapshot, at: Snapshot, forces: NDArray[np.float64], moved: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """(n,) the works of contact [J], and how far they may be off."""
        rounding = _SINGLE * np.linalg.norm(moved, axis=1)
        sizes, after = np.linalg.norm(forces, axis=1), np.einsum("ij,ij->i", forces, moved)
        if not self._implicit:
            # Each force is a mean over the frame: it may have acted only while the velocity differed from its mean.
            return after, sizes * (self._way(last, at) + rounding)
        before = np.einsum("ij,ij->i", self._forces, moved)
        return 0.5 * (before + after), 0.5 * np.abs(after - before) + sizes * rounding

    def _of_load(
        self, last: Snapshot, at: Snapshot, name: str, moved: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """(n,) the works of the loads of a name [J], and how far they may be off."""
        before, after = (np.einsum("ij,ij->i", of.load_forces[name], moved) for of in (last, at))
        left_open = 0.5 * np.abs(after - before)
        if not self._implicit:
            # Within a frame, its change acts on what the way is longer than the straight one, too.
            change = np.linalg.norm(at.load_forces[name] - last.load_forces[name], axis=1)
            left_open += 0.5 * change * self._way(last, at)
        return 0.5 * (before + after), left_open

    def _of_actuators(self, last: Snapshot, at: Snapshot, name: str) -> tuple[float, float]:
        """The work of cavities or cables [J], and how far it may be off."""
        work = left_open = 0.0
        if last.number == 0:
            return work, np.inf
        for before, after in zip(last.actuators, at.actuators, strict=True):
            if after.work == name:
                change, ds = abs(after.force - before.force), after.coordinate - before.coordinate
                work += after.force * ds
                left_open += 0.5 * change * abs(ds)
                if not self._implicit:
                    # Within a frame, the change of the force acts on what the way is longer than the straight one.
                    rates = [state.rate(of.velocities) for state, of in ((before, last), (after, at))]
                    left_open += 0.25 * self.scene.recording.dt * change * abs(rates[1] - rates[0])
                    # In a collision the coordinate goes and comes back; both frames may be at rest in it.
                    sizes = np.linalg.norm(after.gradient, axis=1)
                    left_open += 0.5 * change * float(sizes @ self._way_in_contact(last, at)[after.vertices])
        return work, left_open

    def _way_in_contact(self, last: Snapshot, at: Snapshot) -> NDArray[np.float64]:
        """(n,) `_way` of the bodies that something touched between the frames, zero for the others [m]."""
        forces = getattr(self.scene.recording.records[at.number].report.details, "contact_forces", {})
        way = self._way(last, at)
        for body in self.scene.recording.bodies:
            way[body.vertices] *= bool(np.any(forces.get(body.name, 0.0)))
        return way

    def _way(self, last: Snapshot, at: Snapshot) -> NDArray[np.float64]:
        """(n,) how far a vertex would go in a frame with the largest difference of its velocity from the mean [m].

        Within a frame, velocities are taken to be between those of its ends. A vertex that hits something late stops
        with almost all of the change; one that is slowed down evenly differs from the mean by half of it.
        """
        dt, moved = self.scene.recording.dt, at.positions - last.positions
        return np.maximum(*(np.linalg.norm(dt * of.velocities - moved, axis=1) for of in (last, at)))

    def _of_pins(
        self,
        last: Snapshot,
        at: Snapshot,
        moved: NDArray[np.float64],
        by_name: dict[str, tuple[NDArray[np.float64], NDArray[np.float64]]],
    ) -> tuple[float, float]:
        """The work of pins from a frame to the next [J], and how far it may be off."""
        recording = self.scene.recording
        rows = np.unique(recording.pinned_vertices)
        if not moved[rows].any():
            return 0.0, 0.0
        if not min(last.bounded_J.min(), at.bounded_J.min()) > self._onset:
            return 0.0, np.inf
        along = np.zeros_like(moved)
        along[rows] = moved[rows]
        m = recording.masses[rows]
        speeds = [np.einsum("ij,ij->i", of.velocities[rows], of.velocities[rows]) for of in (last, at)]
        kinetic = 0.5 * float(m @ (speeds[1] - speeds[0]))
        # Until its end, the step had the stitches that broke then.
        whole = replace(at, broken=last.broken) if len(at.latest) else at
        before, after = (_slope(each, along) for each in (last, whole))
        work = 0.5 * (before + after) + kinetic - float(m @ moved[rows] @ recording.gravity)
        # An implicit step takes m (v' - v) v', which differs from the change of kinetic energy by the second term.
        change = at.velocities[rows] - last.velocities[rows]
        left_open = 0.5 * abs(after - before) + 0.5 * float(m @ np.einsum("ij,ij->i", change, change))
        left_open += self._of_viscous_forces(last, at, moved, after - before)
        for name, (on_vertices, left) in by_name.items():
            if name != "contact" or self._open["contact"] is None:
                work -= float(on_vertices[rows].sum())
                left_open += float(left[rows].sum())
        if self._open["contact"] is not None:
            details = recording.records[at.number].report.details
            for sums in (getattr(details, f"{kind}_forces", {}) for kind in ("contact", "friction")):
                for body in recording.bodies:
                    farthest = np.linalg.norm(along[body.vertices], axis=1).max()
                    left_open += float(np.linalg.norm(sums.get(body.name, 0.0)) * farthest)
        return work, left_open if np.isfinite(work) else np.inf

    def _of_viscous_forces(self, last: Snapshot, at: Snapshot, moved: NDArray[np.float64], on_pins: float) -> float:
        """At most what viscous forces on pinned vertices do [J]; on_pins : the change of the slope along their motion.

        Viscous forces are proportional to K d, with the stiffness K of the tets and all motions d. Their share that
        pins work against is a^T K d / d^T K d, with the motions a of pins alone. Both are changes of slopes.
        """
        dissipated = abs(self._works["damping"][at.number]) if "damping" in self._works else 0.0
        if dissipated == 0.0:
            return 0.0
        before, after = (_slope(each, moved) for each in (last, at))
        return dissipated * max(1.0, abs(on_pins / (after - before)) if after != before else 1.0)

    def result(self) -> CheckResult:
        if self.why_not is not None or not self._rows:
            return super().result()
        recording = self.scene.recording
        numbers, stored, height = np.array(self._rows).T
        rows = numbers.astype(int)
        for k, name in enumerate(self._parts):
            names = ("contact", "friction") if name == "contact" else (name,)
            recorded = sum((self._works[each] for each in names if each in self._works), np.zeros(len(recording)))
            work, left_open = np.array([found[k] for found in self.frames]).T
            known = np.isfinite(left_open)
            work, left_open = np.where(known, work, 0.0), np.where(known, left_open, 0.0)
            apart = np.abs(np.cumsum(np.where(known, recorded[rows] - work, 0.0)))
            excess = np.maximum(apart - np.cumsum(left_open), 0.0)
            sizes = np.maximum(np.cumsum(np.abs(recorded))[rows], np.cumsum(np.abs(work)))
            # Forces of loads are known: their works are compared with themselves. Those of pins and of contact balance
            # all other forces, and are found as well as these.
            energies = energy_scale(self.scene, stored, height)
            shares = excess / (sizes + (_CLOSED if name in self._loads else 1.0) * energies + self.scene.floors.sums)
            for number, share in zip(rows, shares, strict=True):
                failed = not share <= self.settings.max_energy_gain
                self.tally.see(self.at(number), float(share), failed, f"work of {name}" if failed else "")
        return super().result()


def _slope(at: Snapshot, along: NDArray[np.float64]) -> float:
    """The derivative of the elastic and stitch energy along a motion (n, 3) of the vertices [J]."""
    there = replace(at, positions=at.positions + _STEP * along)
    energies = [(each.elastic_energy or 0.0) + (each.stitch_energy or 0.0) for each in (at, there)]
    return (energies[1] - energies[0]) / _STEP
