"""The works of a frame: of each force over the displacements of its substep."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from supple.model.energy_balance import add_works, no_works
from supple.model.system import System
from supple.runtime.kernel_cache import njit
from supple.solvers.xpbd.assessment.held_forces import HeldForces
from supple.solvers.xpbd.contact.contact import Contact
from supple.solvers.xpbd.moment import Substep
from supple.solvers.xpbd.record import CONTACT_WORK, FRICTION_WORK, UNNAMED_WORK

Floats = NDArray[np.float64]
Forces = tuple[str, NDArray[np.integer] | slice, Floats]


class Works:
    """The works over the substeps of one frame, in the solver's numbering.

    Attributes
    ----------
    by_name : so far in the frame [J]; residual : see `Report.energy_residual`
    held : the forces on what pins and obstacles hold
    """

    def __init__(self, system: System) -> None:
        self.system = system
        self.by_name, self.residual = no_works(system), 0.0
        self.held = HeldForces(system)
        self._all, self._nothing = np.arange(len(system.masses)), np.zeros((len(system.masses), 3))

    def begin_frame(self, velocities: Floats) -> None:
        """Begin a frame with velocities (n, 3) [m/s]."""
        self.by_name, self.residual = no_works(self.system), 0.0
        self.held.begin_frame(velocities)

    def end_substep(
        self,
        at: Substep,
        forces: Iterable[Forces],
        contact: Contact,
        extended: Floats,
        more: Iterable[Callable[[Substep, Floats], None]],
    ) -> None:
        """Add the works of a substep.

        Parameters
        ----------
        forces : of loads and damping: the name of their work, their rows of `extended`, and (k, 3) [N]
        contact : of the substep; extended : (n + a, 4) with the anchors
        more : add the forces (n + a, 3) of actuators and joints, whose works are known [N]
        """
        held, n, nodes = self.held, len(at.points), contact.nodes
        begun = nodes.begin[: len(extended)]
        if held.is_needed:
            held.outside[:], held.inside[:] = 0.0, 0.0
        for name, rows, acting in forces:
            numbers = self._all if isinstance(rows, slice) else rows.astype(np.int64, copy=False)
            add_works(self.by_name, {name: _work(acting, numbers, extended, begun)})
            if held.is_needed:
                (held.inside if name == "damping" else held.outside)[numbers] += acting
        if held.is_needed:
            of_contact = contact.forces.on_vertices(self.system.points, n)
            arrays = nodes.impulses, at.points, at.begun, self.system.masses, at.h
            self.residual += _add_contact(of_contact, *arrays, held.outside)
            for add_forces in more:
                add_forces(at, held.outside)
            add_works(self.by_name, held.end_substep(extended, begun, at.velocities, at.h))

    def add_contact(self, values: Floats) -> None:
        """Add the works of contacts in the substeps of a frame, from the values of its record."""
        works = {"contact": float(values[CONTACT_WORK]), "friction": float(values[FRICTION_WORK])}
        add_works(self.by_name, works)
        self.residual += float(values[UNNAMED_WORK])

    def end_frame(self, velocities: Floats, more: Mapping[str, float], dt: float) -> None:
        """End a frame of dt [s] with velocities (n, 3) [m/s], and works that were found elsewhere."""
        add_works(self.by_name, more)
        add_works(self.by_name, self.held.end_frame(velocities, dt))


@njit(cache=True)
def _add_contact(of_contact, impulses, points, begun, masses, h, out):
    """Add the forces of contact to `out`; returns their work on what is held [J].

    On vertices that move they are what has changed their velocities; on others, and on welded ones, whose masses their
    bodies have, those (n, 3) of the rows.
    """
    work = 0.0
    for i in range(len(masses)):
        held = points[i, 3] == 0.0
        for j in range(3):
            force = of_contact[i, j] if held or masses[i] == 0.0 else masses[i] * impulses[i, j] / h
            out[i, j] += force
            if held:
                work += force * (points[i, j] - begun[i, j])
    return work


@njit(cache=True)
def _work(forces, rows, points, begun):
    """Of forces (k, 3) on the vertices `rows` (k,), over their displacements since `begun` (n, 3)."""
    total = 0.0
    for k in range(len(rows)):
        i = rows[k]
        for j in range(3):
            total += forces[k, j] * (points[i, j] - begun[i, j])
    return total
