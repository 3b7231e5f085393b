"""The state of all vertices at one time, and the report of a step with its contacts."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray


class Status(StrEnum):
    """How a step ended. It equals its name as text: `report.status == "converged"`."""

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
class ContactPoints:
    """All contacts of one frame.

    Attributes
    ----------
    points : (k, 3) midpoints between the two nearest points [m]
    normals : (k, 3) unit vectors from the second to the first
    forces : (k, 3) on the first, along the normal [N]; the force on the second is opposite
    distances : (k,) [m]
    first, second : (k,) the two bodies or obstacles: indices into `names`
    names : of all bodies, and after them of all obstacles
    """

    points: NDArray[np.float64]
    normals: NDArray[np.float64]
    forces: NDArray[np.float64]
    distances: NDArray[np.float64]
    first: NDArray[np.int32]
    second: NDArray[np.int32]
    names: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.points)

    def force_between(self, on: str, by: str) -> NDArray[np.float64]:
        """(3,) the total normal force on one body or obstacle by another [N]."""
        a, b = self.names.index(on), self.names.index(by)
        forward = self.forces[(self.first == a) & (self.second == b)].sum(axis=0)
        backward = self.forces[(self.first == b) & (self.second == a)].sum(axis=0)
        return np.asarray(forward - backward)


@dataclass(frozen=True, eq=False)
class State:
    """Positions and velocities of every vertex of a `System` at one time.

    Parameters
    ----------
    time : [s]
    positions, velocities : (n_vertices, 3) float64 [m], [m/s]
    memory : what a solver must know of earlier steps (BDF2, contact of XPBD); None for a state that comes from outside.
    inputs : values of the scene's inputs at that time, by name, see `supple.scene.inputs`
    """

    time: float
    positions: NDArray[np.float64]
    velocities: NDArray[np.float64]
    memory: Any = None
    inputs: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class SolverDetails:
    """What one solver reports of a step beyond what all solvers do. Each solver has a subclass of its own.

    A field is an integer, a number, a number or None, or a mapping from names to numbers or to (3,) arrays; its keys
    are the same in every frame, or it is empty. A recording keeps these fields. Two details are equal if these fields
    are. Fields of any other kind have `compare=False`: a recording does not keep them.

    Attributes
    ----------
    contacts : number of pairs in contact
    """

    contacts: int = 0

    def __eq__(self, other: object) -> bool:
        if type(self) is not type(other):
            return NotImplemented
        return all(
            _are_equal(getattr(self, field.name), getattr(other, field.name)) for field in fields(self) if field.compare
        )


def _are_equal(one: Any, other: Any) -> bool:
    if isinstance(one, Mapping):
        return one.keys() == other.keys() and all(np.array_equal(one[name], other[name]) for name in one)
    return one == other


@dataclass(frozen=True, eq=False)
class StepReport:
    """What a solver reports of one step; `simulate` completes it to a `Report`.

    Parameters
    ----------
    status : how the step ended.
    iterations : substeps (XPBD) or Newton iterations (implicit).
    message : where the status is not `converged`: what stopped the step, and where.
    min_distance : smallest distance at the end of the step between two surfaces that may touch, edges and faces
        included [m]; None where the solver does not compute it (`XPBD`), or found nothing in the range of its contact.
    details : what only this solver reports.
    contacts : makes the list of all contacts, for solvers that know them one by one.
    """

    status: Status
    iterations: int
    message: str = ""
    min_distance: float | None = None
    details: SolverDetails = field(default_factory=SolverDetails)
    contacts: Callable[[], ContactPoints] | None = None
