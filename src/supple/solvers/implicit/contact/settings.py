"""The user's settings for contact in the implicit solver."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from supple.errors import SolverError
from supple.kinds.forms import COUNT, POSITIVE, Or
from supple.kinds.kind import Kind


@dataclass(frozen=True)
class IPCContact(Kind):
    """Incremental potential contact. All defaults scale with the scene.

    Parameters
    ----------
    dhat : distance below which surfaces repel each other [m]. None: a thousandth of the smallest body's diagonal, or
        less where surface edges or the gaps at the start are shorter than that.
    stiffness : pressure scale of the barrier [Pa]: surfaces half of `dhat` apart press on each other with several
        times as much. "adaptive": from the bodies' moduli, and raised within a step where surfaces come very close.
    friction_velocity : relative velocity below which friction is static [m/s]: a sticking contact creeps with a part of
        it. None: a thousandth of the smallest body's diagonal per second.
    friction_iterations : how often in a step the normal forces of friction are computed. 1: only at the beginning of
        the step. None: until they change by less than a tenth, at most five times.

    Raises
    ------
    SolverError : where a value is of the wrong kind or out of range.

    Source: Li et al., "Incremental Potential Contact: Intersection- and Inversion-free, Large-Deformation Dynamics"
    (2020), sections 3 to 5.
    """

    kind: ClassVar[str] = "ipc_contact"
    title: ClassVar[str] = "IPCContact"
    error = SolverError

    dhat: Annotated[float | None, POSITIVE] = None
    stiffness: Annotated[float | str, Or(POSITIVE, "adaptive")] = "adaptive"
    friction_velocity: Annotated[float | None, POSITIVE] = None
    friction_iterations: Annotated[int | None, COUNT] = None
