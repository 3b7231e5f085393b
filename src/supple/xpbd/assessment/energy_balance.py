"""The balance of energy of a frame: what the bodies gained, less the work that was done on them.

Kinetic, elastic and potential energy, and that of stitches and soft targets, of all vertices that are not pinned. Work
is done by forces, by motors, by soft targets that move, and by pins that move. That of pins is the elastic energy which
their motion adds in the prediction of a substep; the true work is never more. The work of obstacles and of rigid bodies
that are moved is not known: a frame in which they touch something, or in which stitches or joints hold to them, is not
judged.

What violated hard constraints can give out counts where it falls, and not where it rises: it is an upper bound.

Gains are added up over the frames, and losses pay them back, so that a periodic error does not grow and a lasting one
does. The sum is kept in `XPBDMemory.excess`.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from supple.loads.springs import PointSpring
from supple.scene.stitches.measures import stitch_energy
from supple.system import System
from supple.xpbd.assessment.elastic_energy import ElasticEnergy
from supple.xpbd.assessment.moment import Moment

# Of the shear modulus times the volume: energies below the square of this strain are round-off.
LEAST_STRAIN = 1e-6
# Of the mean surface edge: energies below that of a fall by this height are not judged. Contact lifts what begins on a
# floor by its skin.
LEAST_FALL = 0.05
# Of the work of pins in a substep: how much it may be off, since it is taken at the prediction.
PIN_TOLERANCE = 0.2


class EnergyBalance:
    """Energies and work over the substeps of one frame, in the solver's numbering.

    Attributes
    ----------
    is_judged : whether the work of everything that moved in the frame is known
    """

    def __init__(self, system: System, edge_length: float) -> None:
        self.system = system
        self.free = system.inverse_masses > 0.0
        self._springs = [load for load in system.loads if isinstance(load, PointSpring)]
        self._pushes = [load for load in system.loads if not isinstance(load, PointSpring)]
        self._masses = np.where(self.free, system.masses, 0.0)
        self._elastic = ElasticEnergy(system)
        self._moving_pins = [pin for pin in system.pins if pin.motion is not None]
        held = np.zeros(len(system.masses), dtype=np.bool_)
        for pin in self._moving_pins:
            held[pin.vertices] = True
        self._held = np.flatnonzero(held)
        self._at_pins = ElasticEnergy(system, held) if self._moving_pins else None
        driven = {part.name for part in system.rigid_bodies if held[part.vertices].any()}
        moving = {str(obstacle.name) for obstacle in system.obstacles if obstacle.motion is not None}
        self._obstacles_move = bool(moving or driven)
        joined = {name for joint in system.scene.joints for name in (joint.first, joint.second)}
        self._anchors_move = bool(joined & (moving | driven)) or (bool(moving) and len(system.stitching.anchors) > 0)
        fall = LEAST_FALL * edge_length * math.hypot(*system.gravity)
        self._least = LEAST_STRAIN**2 * _stiffness(system) + fall * float(self._masses.sum())
        self._begun = np.zeros(len(system.bodies))
        self._total = self._work = self._hard = self._h = 0.0
        self.is_judged = True

    def begin(self, moment: Moment, h: float) -> None:
        """Begin a frame with substeps of h [s]."""
        self._work, self._h = 0.0, h
        self.is_judged = not self._anchors_move
        self._begun, self._total = self._measure(moment)
        self._hard = self._in_hard_constraints(moment)

    def note_pins(self, points: NDArray[np.float64], previous: NDArray[np.float64], parallel: bool) -> None:
        """Add the work of pins that have just moved from their places in `previous` to those in `points`."""
        if self._at_pins is None:
            return
        before = points.copy()
        before[self._held, :3] = previous[self._held]
        energies = [self._at_pins.of(x, parallel, self._h).sum() for x in (before, points)]
        work = float(energies[1] - energies[0])
        self._work += max(work, 0.0) + PIN_TOLERANCE * abs(work)

    def note_loads(
        self,
        points: NDArray[np.float64],
        previous: NDArray[np.float64],
        origins: NDArray[np.float64],
        end: float,
        h: float,
    ) -> None:
        """Add the work of loads, of springs whose rest length changed, and of soft targets that moved.

        Over a substep of h [s] that ends at `end` [s].
        """
        for spring in self._springs:
            before = previous + origins
            self._work += spring.energy(before, end) - spring.energy(before, end - h)
        if self._pushes:
            x, pushes = points[:, :3] + origins, np.zeros_like(previous)
            for load in self._pushes:
                load.add_forces(x, end, pushes)
            moved = np.where(self.free[:, None], points[:, :3] - previous, 0.0)
            self._work += float(np.einsum("ij,ij->", pushes, moved))
        for soft in self.system.soft_targets:
            x = previous[soft.vertices] + origins[soft.vertices]
            longer, shorter = soft.targets(end) - x, soft.targets(end - h) - x
            self._work += 0.5 * soft.target.stiffness * float((longer**2).sum() - (shorter**2).sum())

    def note_work(self, work: float) -> None:
        """Add work that is known [J]."""
        self._work += work

    def note_contacts(self, count: int) -> None:
        """Take notice of the number of contacts in a substep."""
        if count and self._obstacles_move:
            self.is_judged = False

    def end(self, moment: Moment) -> tuple[float, float, int]:
        """What was gained in the frame [J], the energy to compare it with [J], and the body whose energy rose most."""
        ended, total = self._measure(moment)
        given_out = max(self._hard - self._in_hard_constraints(moment), 0.0)
        gain = total - self._total - self._work - given_out if self.is_judged else 0.0
        scale = max(float(self._begun.sum()), float(ended.sum()), self._work, given_out, self._least)
        return gain, scale, int((ended - self._begun).argmax())

    def _in_hard_constraints(self, moment: Moment) -> float:
        """The most that violated hard constraints can give out [J]."""
        if not self._elastic.has_hard:
            return 0.0
        soft, both = (self._elastic.of(moment.points, False, h).sum() for h in (math.inf, self._h))
        return float(both - soft)

    def _measure(self, moment: Moment) -> tuple[NDArray[np.float64], float]:
        """Kinetic and elastic energy of each body (b,), and all energy [J]."""
        points, velocities, origins = moment.points, moment.velocities, moment.origins
        squares = self._masses * np.einsum("ij,ij->i", velocities, velocities)
        starts = [part.vertices.start for part in self.system.bodies]
        bodies = self._elastic.of(points, False) + 0.5 * np.add.reduceat(squares, starts)
        total = float(bodies.sum()) - float((self._masses @ points[:, :3]) @ self.system.gravity)
        for soft in self.system.soft_targets:
            x = points[soft.vertices, :3] + origins[soft.vertices]
            total += 0.5 * soft.target.stiffness * float(((soft.targets(moment.time) - x) ** 2).sum())
        for spring in self._springs:
            total += spring.energy(points[:, :3] + origins, moment.time)
        if len(self.system.stitching):
            total += stitch_energy(self.system.stitching, np.ascontiguousarray(moment.extended[:, :3]))
        return bodies, total


def _stiffness(system: System) -> float:
    """The sum of shear modulus times volume, or of edge stiffness times squared length [J]."""
    total = 0.0
    for part in system.bodies:
        if part.rigid:
            continue
        material, volumes = part.body.material, system.rest_volumes[part.tets]
        compliance = getattr(material, "edge_compliance", None)
        if compliance is None:
            total += float(np.broadcast_to(material.per_tet(len(volumes)).mu, len(volumes)) @ volumes)
        elif compliance > 0.0:
            total += float((system.rest_lengths[part.edges] ** 2).sum()) / compliance
    return total
