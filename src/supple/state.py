"""What moves: the state of all vertices at one time. What a step says of itself."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.contact_points import ContactPoints


class Status(StrEnum):
    """How a step ended. Compares equal to its name as text: `report.status == "converged"`."""

    CONVERGED = "converged"
    ITERATION_LIMIT = "iteration_limit"
    LINE_SEARCH_FAILED = "line_search_failed"
    BLOCKED = "blocked"
    NOT_FINITE = "not_finite"

    @property
    def can_go_on(self) -> bool:
        """Whether the next step may start from the state that came with this status."""
        return self in (Status.CONVERGED, Status.ITERATION_LIMIT)


@dataclass(frozen=True, eq=False)
class State:
    """Positions and velocities of every vertex of a `System` at one time.

    Parameters
    ----------
    time : [s]
    positions, velocities : (n_vertices, 3) float64 [m], [m/s]
    memory : what a solver must know of earlier steps (BDF2, contact of XPBD); None for a state that comes from outside.
    """

    time: float
    positions: NDArray[np.float64]
    velocities: NDArray[np.float64]
    memory: Any = None


@dataclass(frozen=True, eq=False)
class StepReport:
    """What a solver says of one step; `simulate` completes it to a `Report`.

    Parameters
    ----------
    status : how the step ended.
    iterations : substeps (XPBD) or Newton iterations (implicit).
    message : for the person, where the status is not `converged`: what stopped the step, and where.
    min_distance : smallest distance between surfaces in contact [m], or None where it is not known.
    details : named numbers of this solver for traces and plots.
    contacts : makes the list of all contacts, for solvers that know them one by one.
    """

    status: Status
    iterations: int
    message: str = ""
    min_distance: float | None = None
    details: dict[str, Any] = field(default_factory=dict)
    contacts: Callable[[], ContactPoints] | None = None
