"""Energy without a source in a frame: what the bodies gained, less the work that was done on them.

Kinetic, elastic and potential energy, and that of stitches, of all vertices; `Works` has the works of loads, actuators,
motors and pins. Contact does work where obstacles move: what it adds is theirs, as far as it exceeds what it takes.

The energy that violated hard constraints can release is an upper bound: it counts where it falls, not where it rises.

Gains are added up over the frames, and losses pay them back, so that a periodic error does not grow and a lasting one
does. The sum is kept in `XPBDMemory.excess`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from supple.model.energy_balance import NUMERICAL
from supple.model.system import System
from supple.scene.rod import Rod
from supple.scene.shell import Shell
from supple.scene.stitches.measures import stitch_energy
from supple.solvers.xpbd.assessment.elastic_energy import ElasticEnergy
from supple.solvers.xpbd.moment import Moment

# Of the shear modulus times the volume: energies below the square of this strain are round-off.
LEAST_STRAIN = 1e-6
# Of the mean surface edge: energies below that of a fall by this height are not judged. Contact lifts what begins on a
# floor by its skin.
LEAST_FALL = 0.05
# Of the mean surface edge: motion by less in a substep is round-off.
LEAST_STEP = 1e-9
# Of the works of pins and anchors in a frame: how much they may be off.
PIN_TOLERANCE = 0.2
# Works that take energy, and those that are not those of forces.
_NOT_DRIVING = ("contact", "friction", "damping", NUMERICAL)


class EnergyBalance:
    """Energies and work over the substeps of one frame, in the solver's numbering.

    Attributes
    ----------
    elastic : energy of the bodies
    """

    def __init__(self, system: System, edge_length: float) -> None:
        self.system = system
        self._masses = system.masses
        self.elastic = ElasticEnergy(system)
        self._obstacles_move = any(obstacle.motion is not None for obstacle in system.obstacles)
        fall = LEAST_FALL * edge_length * math.hypot(*system.gravity)
        self._least = LEAST_STRAIN**2 * _stiffness(system) + fall * float(self._masses.sum())
        self._shortest = LEAST_STEP * edge_length
        self._begun = np.zeros(len(system.bodies))
        self._total = self._hard = self._h = 0.0

    def begin(self, moment: Moment, h: float) -> None:
        """Begin a frame with substeps of h [s]."""
        self._h = h
        self._begun, self._total = self._measure(moment)
        self._hard = self._in_hard_constraints(moment)

    def end(self, moment: Moment, works: Mapping[str, float]) -> tuple[float, float, int]:
        """What was gained in the frame [J], the energy to compare it with [J], and the body whose energy rose most."""
        work = sum(value for name, value in works.items() if name not in _NOT_DRIVING)
        work += PIN_TOLERANCE * sum(abs(works.get(name, 0.0)) for name in ("pins", "anchors"))
        work += max(0.0, works["contact"] + works["friction"]) if self._obstacles_move else 0.0
        ended, total = self._measure(moment)
        given_out = max(self._hard - self._in_hard_constraints(moment), 0.0)
        gain = total - self._total - work - given_out
        slow = 0.5 * float(self._masses.sum()) * (self._shortest / self._h) ** 2
        scale = max(float(self._begun.sum()), float(ended.sum()), work, given_out, self._least + slow)
        return gain, scale, int((ended - self._begun).argmax())

    def _in_hard_constraints(self, moment: Moment) -> float:
        """The most that violated hard constraints can give out [J]."""
        if not self.elastic.has_hard:
            return 0.0
        soft, both = (self.elastic.of(moment.points, h).sum() for h in (math.inf, self._h))
        return float(both - soft)

    def _measure(self, moment: Moment) -> tuple[NDArray[np.float64], float]:
        """Kinetic and elastic energy of each body (b,), and all energy [J]."""
        points, velocities = moment.points, moment.velocities
        squares = self._masses * np.einsum("ij,ij->i", velocities, velocities)
        starts = [part.vertices.start for part in self.system.bodies]
        bodies = self.elastic.of(points) + 0.5 * np.add.reduceat(squares, starts)
        total = float(bodies.sum()) - float((self._masses @ points[:, :3]) @ self.system.gravity)
        if len(self.system.stitching):
            total += stitch_energy(self.system.stitching, np.ascontiguousarray(moment.extended[:, :3]))
        return bodies, total


def _stiffness(system: System) -> float:
    """The sum of shear modulus times volume, or of edge stiffness times squared length [J]."""
    total = 0.0
    for part in system.bodies:
        if part.rigid or isinstance(part.body, (Shell, Rod)):
            continue
        material, volumes = part.body.material, system.rest_volumes[part.tets]
        compliance = getattr(material, "edge_compliance", None)
        if compliance is None:
            total += float(np.broadcast_to(material.per_tet(len(volumes)).mu, len(volumes)) @ volumes)
        elif compliance > 0.0:
            total += float((system.rest_lengths[part.edges] ** 2).sum()) / compliance
    if system.shells is not None:
        shells = system.shells
        total += float((shells.areas * shells.thickness) @ shells.mu)
    if system.rods is not None:
        total += float(system.rods.stretching @ system.rods.lengths)
    return total
