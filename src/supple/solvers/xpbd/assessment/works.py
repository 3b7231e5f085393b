"""The works of a frame: of each force over the displacements of its substep."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from supple.model.energy_balance import add_works, no_works
from supple.model.system import System
from supple.runtime.kernel_cache import njit
from supple.solvers.xpbd.assessment.acting import Acting
from supple.solvers.xpbd.assessment.held_forces import HeldForces
from supple.solvers.xpbd.contact.contact import Contact
from supple.solvers.xpbd.moment import Substep
from supple.solvers.xpbd.record import CONTACT_WORK, FRICTION_WORK, UNNAMED_WORK

Floats = NDArray[np.float64]


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
        self._of_contact = np.zeros((len(system.masses), 3))

    def begin_frame(self, velocities: Floats) -> None:
        """Begin a frame with velocities (n, 3) [m/s]."""
        self.by_name, self.residual = no_works(self.system), 0.0
        self.held.begin_frame(velocities)

    def end_substep(
        self,
        at: Substep,
        acting: Sequence[tuple[Acting, bool]],
        contact: Contact,
        logged: tuple[int, int],
        extended: Floats,
        more: Iterable[Callable[[Substep, Floats], None]],
    ) -> None:
        """Add the works of a substep.

        Parameters
        ----------
        acting : of loads and damping, and whether they are what elements exert on each other
        contact : with a log of rows, of which those from `logged[0]` to `logged[1]` are of the substep
        extended : (n + a, 4) with the anchors
        more : add the forces (n + a, 3) of actuators and joints, whose works are known [N]
        """
        held, nodes = self.held, contact.nodes
        begun = nodes.begin[: len(extended)]
        held.outside[:], held.inside[:] = 0.0, 0.0
        for forces, are_inside in acting:
            forces.end_substep(extended, begun, held.inside if are_inside else held.outside)
        if held.is_needed:
            self._of_contact[:] = 0.0
            if logged[1] > logged[0]:
                contact.forces.add_to(self._of_contact, self.system.points, *logged)
            arrays = nodes.impulses, at.points, at.begun, self.system.masses, at.h
            self.residual += _add_contact(self._of_contact, *arrays, held.outside)
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
