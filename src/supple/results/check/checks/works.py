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

from supple.results.check.checks.budgets import CLOSED, EnergyCheck, recorded_works
from supple.results.check.energies import knows_all_laws
from supple.results.check.trajectory import Snapshot

Floats = NDArray[np.float64]
# Of a difference quotient of the energy, as a share of the motion between two frames.
_STEP = 1e-6
# J below which a barrier against inversion may act, where the recording does not say it.
_BARRIER_ONSET = 0.1
# What else may act on pinned vertices, up to a bound that is known.
_BESIDE_PINS = {"contact", "friction", "damping", "flow", "growth", "breaking"}
# Contact forces are recorded in single precision.
_SINGLE = 1e-6
_NEVER_RECORDED = {
    "soft_targets": "places of targets are not recorded",
    "joints": "their forces do not bound them within a frame",
}


class Works(EnergyCheck):
    """The recorded works of pins, loads and contact are those of the frames.

    Attributes
    ----------
    frames : of each frame, for each part that is judged, the work [J] and how far it may be off [J]
    """

    name = "works"
    needs = frozenset({"recording"})
    bad = "differ by {worst} from those of the frames"
    in_order = "works are computed"

    def begin(self) -> None:
        super().begin()
        of, self._works = self.of, recorded_works(self.of) or {}
        left_out = {work: why for work, why in of.loads if isinstance(why, str)} | _NEVER_RECORDED
        left_out = {name: why for name, why in left_out.items() if name in self._works}
        self._actuators = {name for name in ("cavities", "cables") if getattr(of, name) and name in self._works}
        known = {work for work, forces in of.loads if work in self._works and not isinstance(forces, str)}
        self._loads = (known | self._actuators) - set(left_out)
        self._open = {"pins": self._pins_are_open(), "contact": self._contact_is_open()}
        self._parts = [name for name, why in self._open.items() if why is None] + sorted(self._loads)
        named = " and ".join([", ".join(self._parts[:-1])] * (len(self._parts) > 1) + self._parts[-1:])
        self.good = f"those of {named} agree within {{worst}}, beyond what frames leave open"
        self.good += "".join(f"; without {name}: {why}" for name, why in left_out.items())
        if not self._works:
            self.why_not = "the recording does not contain works"
        elif not self._parts and self.why_not is None:
            self.why_not = "; ".join(f"{name}: {why}" for name, why in [*self._open.items(), *left_out.items()])
        onset = re.search(r"barrier_onset=([-+.\de]+)", of.records.solver or "")
        self._onset = float(onset[1]) if onset else _BARRIER_ONSET
        self._forces = np.zeros_like(of.rest_positions)
        self.frames: list[list[tuple[float, float]]] = []

    def _pins_are_open(self) -> str | None:
        others = sorted(set(self._works) - _BESIDE_PINS - self._loads - {"pins"})
        rigid = [np.arange(body.vertices.start, body.vertices.stop) for body in self.of.bodies if body.rigid]
        if "pins" not in self._works:
            return "nothing is pinned"
        if not knows_all_laws(self.of):
            return "the recording does not contain the law of a body"
        if np.isin(self.of.pinned_vertices, rigid).any():
            return "a pinned body is rigid"
        if others:
            return f"the forces of {', '.join(others)} on pinned vertices are not recorded"
        return "welds may act on pinned vertices" if self.of.welds else None

    def _contact_is_open(self) -> str | None:
        if not any(field.name == "contact_force" for field in self.of.records.fields):
            return "forces on vertices were not recorded (fields=['contact_force'])"
        if any(body.rigid or body.skin is not None for body in self.of.bodies):
            return "forces on rigid bodies and skins are not recorded"
        return None

    def see(self, at: Snapshot) -> None:
        super().see(at)
        last, forces, found = self.last, self._forces, [(0.0, 0.0)] * len(self._parts)
        if self._open["contact"] is None:
            forces = self.of.records[at.number].contact_force.values_of_all
        if last is not None:
            moved = at.positions - last.positions
            by_name = {"contact": self._of_contact(last, at, forces, moved)}
            by_name |= {name: self._of_load(last, at, name, moved) for name in self._loads}
            of = {name: (float(work.sum()), float(left.sum())) for name, (work, left) in by_name.items()}
            of |= {name: self._of_actuators(last, at, name) for name in self._actuators}
            if "pins" in self._parts:
                of["pins"] = self._of_pins(last, at, moved, by_name)
            found = [of[name] for name in self._parts]
        self.frames.append(found)
        self._forces = forces

    def _of_contact(self, last: Snapshot, at: Snapshot, forces: Floats, moved: Floats) -> tuple[Floats, Floats]:
        """(n,) the works of contact [J], and how far they may be off."""
        rounding = _SINGLE * np.linalg.norm(moved, axis=1)
        sizes, after = np.linalg.norm(forces, axis=1), np.einsum("ij,ij->i", forces, moved)
        if not self.of.implicit:
            # Each force is a mean over the frame: it may have acted only while the velocity differed from its mean.
            return after, sizes * (self._way(last, at) + rounding)
        before = np.einsum("ij,ij->i", self._forces, moved)
        return 0.5 * (before + after), 0.5 * np.abs(after - before) + sizes * rounding

    def _of_load(self, last: Snapshot, at: Snapshot, name: str, moved: Floats) -> tuple[Floats, Floats]:
        """(n,) the works of the loads of a name [J], and how far they may be off."""
        before, after = (np.einsum("ij,ij->i", of.load_forces[name], moved) for of in (last, at))
        left_open = 0.5 * np.abs(after - before)
        if not self.of.implicit:
            # Within a frame, its change acts on what the path is longer than the straight one, too.
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
                if not self.of.implicit:
                    # Within a frame, the change of the force acts on what the path is longer than the straight one.
                    rates = [np.vdot(state.gradient, of.velocities) for state, of in ((before, last), (after, at))]
                    left_open += 0.25 * self.of.dt * change * abs(float(rates[1] - rates[0]))
                    # In a collision the coordinate goes and comes back; both frames may be at rest in it.
                    sizes = np.linalg.norm(after.gradient, axis=1)
                    left_open += 0.5 * change * float(sizes @ self._way_in_contact(last, at))
        return work, left_open

    def _way_in_contact(self, last: Snapshot, at: Snapshot) -> Floats:
        """(n,) `_way` of the bodies that something touched between the frames, zero for the others [m]."""
        forces = getattr(at.details, "contact_forces", {})
        way = self._way(last, at)
        for body in self.of.bodies:
            way[body.vertices] *= bool(np.any(forces.get(body.name, 0.0)))
        return way

    def _way(self, last: Snapshot, at: Snapshot) -> Floats:
        """(n,) how far a vertex would go in a frame with the largest difference of its velocity from the mean [m].

        Within a frame, velocities are taken to be between those of its ends. A vertex that hits something late stops
        with almost all of the change; one that is slowed down evenly differs from the mean by half of it.
        """
        dt, moved = self.of.dt, at.positions - last.positions
        return np.maximum(*(np.linalg.norm(dt * of.velocities - moved, axis=1) for of in (last, at)))

    def _of_pins(
        self,
        last: Snapshot,
        at: Snapshot,
        moved: Floats,
        by_name: dict[str, tuple[Floats, Floats]],
    ) -> tuple[float, float]:
        """The work of pins from a frame to the next [J], and how far it may be off."""
        rows = np.unique(self.of.pinned_vertices)
        if not moved[rows].any():
            return 0.0, 0.0
        if not min(last.bounded_J.min(initial=np.inf), at.bounded_J.min(initial=np.inf)) > self._onset:
            return 0.0, np.inf
        along = np.zeros_like(moved)
        along[rows] = moved[rows]
        m = self.of.masses[rows]
        speeds = [np.einsum("ij,ij->i", of.velocities[rows], of.velocities[rows]) for of in (last, at)]
        kinetic = 0.5 * float(m @ (speeds[1] - speeds[0]))
        # Until its end, the step had the stitches that broke then.
        whole = replace(at, broken=last.broken) if len(at.latest) else at
        before, after = (_slope(item, along) for item in (last, whole))
        work = 0.5 * (before + after) + kinetic - float(m @ moved[rows] @ self.of.gravity)
        # An implicit step takes m (v' - v) v', which differs from the change of kinetic energy by the second term.
        change = at.velocities[rows] - last.velocities[rows]
        left_open = 0.5 * abs(after - before) + 0.5 * float(m @ np.einsum("ij,ij->i", change, change))
        left_open += self._of_viscous_forces(last, at, moved, after - before)
        for name, (on_vertices, left) in by_name.items():
            if name != "contact" or self._open["contact"] is None:
                work -= float(on_vertices[rows].sum())
                left_open += float(left[rows].sum())
        if self._open["contact"] is not None:
            for sums in (getattr(at.details, f"{kind}_forces", {}) for kind in ("contact", "friction")):
                for body in self.of.bodies:
                    farthest = np.linalg.norm(along[body.vertices], axis=1).max()
                    left_open += float(np.linalg.norm(sums.get(body.name, 0.0)) * farthest)
        return work, left_open if np.isfinite(work) else np.inf

    def _of_viscous_forces(self, last: Snapshot, at: Snapshot, moved: Floats, on_pins: float) -> float:
        """At most what viscous forces on pinned vertices do [J]; on_pins : the change of the slope along their motion.

        Viscous forces are proportional to K d, with the stiffness K of the tets and all motions d. Their share that
        pins work against is a^T K d / d^T K d, with the motions a of pins alone. Both are changes of slopes.
        """
        dissipated = abs(self._works["damping"][at.number]) if "damping" in self._works else 0.0
        if dissipated == 0.0:
            return 0.0
        before, after = (_slope(item, moved) for item in (last, at))
        return dissipated * max(1.0, abs(on_pins / (after - before)) if after != before else 1.0)

    def judge(self, rows: NDArray[np.int64], energy: Floats, scale: float) -> None:
        for k, name in enumerate(self._parts):
            names = ("contact", "friction") if name == "contact" else (name,)
            recorded = sum((self._works[item] for item in names if item in self._works), np.zeros(len(self.of)))
            work, left_open = np.array([found[k] for found in self.frames]).T
            known = np.isfinite(left_open)
            work, left_open = np.where(known, work, 0.0), np.where(known, left_open, 0.0)
            apart = np.abs(np.cumsum(np.where(known, recorded[rows] - work, 0.0)))
            excess = np.maximum(apart - np.cumsum(left_open), 0.0)
            sizes = np.maximum(np.cumsum(np.abs(recorded))[rows], np.cumsum(np.abs(work)))
            # Forces of loads are known: their works are compared with themselves. Those of pins and of contact balance
            # all other forces, and are found as well as these.
            shares = excess / (sizes + (CLOSED if name in self._loads else 1.0) * scale + self.of.floors.sums)
            self.see_all(rows, shares, self.settings.max_energy_gain, f"work of {name}")


def _slope(at: Snapshot, along: Floats) -> float:
    """The derivative of the elastic and stitch energy along a motion (n, 3) of the vertices [J]."""
    there = replace(at, positions=at.positions + _STEP * along)
    energies = [(item.elastic_energy or 0.0) + item.stitch_energy for item in (at, there)]
    return (energies[1] - energies[0]) / _STEP
