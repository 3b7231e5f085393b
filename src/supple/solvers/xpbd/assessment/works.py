"""The works of a frame: of each force over the displacements of its substep.

Loads, actuators, damping and contact have forces. The work of pins has two parts: the energy that their motion adds to
tets and stitches, as the mean of that before and after the other vertices follow, and the work of the forces that
balance all other forces on the pinned vertices. The work of moving obstacles by stitches is found in the same way.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from supple.model.energy_balance import add_works, no_works
from supple.model.system import System
from supple.runtime.kernel_cache import njit
from supple.scene.stitches.measures import stitch_energy
from supple.solvers.xpbd.assessment.elastic_energy import ElasticEnergy
from supple.solvers.xpbd.assessment.moment import Substep
from supple.solvers.xpbd.contact.contact import Contact

Floats = NDArray[np.float64]
Forces = tuple[str, NDArray[np.integer] | slice, Floats]


class Works:
    """The works over the substeps of one frame, in the solver's numbering.

    Attributes
    ----------
    by_name : so far in the frame [J]; residual : see `Report.energy_residual`
    at_pins : elastic energy of the tets at pins that move, or None
    """

    def __init__(self, system: System) -> None:
        self.system = system
        self.by_name = no_works(system)
        self.residual = 0.0
        held = np.zeros(len(system.masses), dtype=np.bool_)
        for pin in system.pins:
            if pin.motion is not None:
                held[pin.vertices] = True
        welding = system.welding
        held[welding.vertices[held[welding.control[:, 0]]]] = True
        self._held = np.flatnonzero(held)
        self.at_pins = ElasticEnergy(system, held) if len(self._held) else None
        self._pins_are_stitched = bool(np.isin(system.stitching.nodes(), self._held).any())
        self._all = np.arange(len(system.masses))
        self._on_pins = np.zeros((len(system.masses), 3))
        moving = any(obstacle.motion is not None for obstacle in system.obstacles)
        self._anchors = len(system.stitching.anchors) if moving else 0
        self._anchored = np.zeros((self._anchors, 3))

    def begin_frame(self, velocities: Floats) -> None:
        """Begin a frame with velocities (n, 3) [m/s]."""
        self.by_name, self.residual = no_works(self.system), 0.0
        self._add_inertia(velocities, -1.0)

    def begin_substep(self, extended: Floats) -> None:
        """Begin a substep, before anchors of stitches move; extended : (n + a, 4)."""
        if self._anchors:
            self._anchored[:] = extended[-self._anchors :, :3]

    def end_substep(
        self,
        at: Substep,
        forces: Iterable[Forces],
        contact: Contact,
        extended: Floats,
        of_actuators: Callable[[Substep], Floats],
    ) -> None:
        """Add the works of a substep.

        Parameters
        ----------
        forces : of all but contact and actuators: the name of their work, their vertices, and (k, 3) [N]
        contact : of the substep; extended : (n + a, 4) with the anchors
        of_actuators : gives their forces (n, 3) [N]
        """
        if self.at_pins is not None:
            self._on_pins[:] = 0.0
        for name, rows, acting in forces:
            numbers = self._all if isinstance(rows, slice) else rows.astype(np.int64, copy=False)
            add_works(self.by_name, {name: _work(acting, numbers, at.points, at.begun)})
            if self.at_pins is not None:
                self._on_pins[rows] += acting
        if len(contact.forces.latest.keys):
            works = contact.forces.works(self.system.points, at.points, at.begun)
            add_works(self.by_name, works)
            if self.at_pins is not None:
                self._on_pins += contact.forces.on_vertices(self.system.points, len(at.points))
            self.residual -= sum(works.values())
        self.residual += _work_of_impulses(at.points, self.system.masses, contact.nodes.impulses, at.begun, at.h)
        if self.at_pins is not None:
            self._on_pins += of_actuators(at)
            self._add_pins(self.at_pins, at, extended[len(at.points) :, :3])
        if self._anchors:
            self._add_anchors(at, extended)

    def end_frame(self, velocities: Floats, more: Mapping[str, float]) -> None:
        """End a frame with velocities (n, 3) [m/s], and works that were found elsewhere."""
        self._add_inertia(velocities, 1.0)
        add_works(self.by_name, more)

    def _add_pins(self, energy: ElasticEnergy, at: Substep, anchors: Floats) -> None:
        before, after = at.begun.copy(), at.points[:, :3].copy()
        moved = after[self._held] - before[self._held]
        before[self._held] += moved
        after[self._held] -= moved
        places = before, at.begun, at.points, after
        E = [float(energy.of(x, at.h).sum()) for x in places]
        if self._pins_are_stitched:
            E = [e + self._in_stitches(x, anchors) for e, x in zip(E, places, strict=True)]
        weight = self.system.masses[self._held, None] * self.system.gravity
        others = self._on_pins[self._held] + weight
        held = float(np.einsum("ij,ij->", others, moved))
        add_works(self.by_name, {"pins": 0.5 * (E[0] - E[1] + E[2] - E[3]) - held})

    def _add_anchors(self, at: Substep, extended: Floats) -> None:
        new = extended[len(at.points) :, :3]
        E = [self._in_stitches(x, anchors) for x in (at.begun, at.points) for anchors in (new, self._anchored)]
        add_works(self.by_name, {"anchors": 0.5 * (E[0] - E[1] + E[2] - E[3])})

    def _in_stitches(self, x: Floats, anchors: Floats) -> float:
        return stitch_energy(self.system.stitching, np.concatenate([x[:, :3], anchors]))

    def _add_inertia(self, velocities: Floats, sign: float) -> None:
        if len(self._held):
            v = velocities[self._held]
            kinetic = 0.5 * float(self.system.masses[self._held] @ np.einsum("ij,ij->i", v, v))
            add_works(self.by_name, {"pins": sign * kinetic})


@njit(cache=True)
def _work(forces, rows, points, begun):
    """Of forces (k, 3) on the vertices `rows` (k,), over their displacements since `begun` (n, 3)."""
    total = 0.0
    for k in range(len(rows)):
        i = rows[k]
        for j in range(3):
            total += forces[k, j] * (points[i, j] - begun[i, j])
    return total


@njit(cache=True)
def _work_of_impulses(points, masses, impulses, begun, h):
    """Of changes of velocities (n, 3) of vertices that can move, over their displacements since `begun` in h."""
    total = 0.0
    for i in range(len(masses)):
        if points[i, 3] > 0.0:
            for j in range(3):
                total += masses[i] * impulses[i, j] * (points[i, j] - begun[i, j])
    return total / h
