"""The state of all vertices at one time, and the report of a step with its contacts."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.errors import SceneError


class Status(StrEnum):
    """How a step ended. It equals its name as text: `report.status == "converged"`.

    Where several hold for one step, the report has the first of: inverted, intersecting, energy_gained, truncated,
    crushed, softened.

    Attributes
    ----------
    CONVERGED : the step is what the solver promises
    LINEARIZED : `Implicit(max_iterations=1)` to 3 did what it was asked to; forces remain that the message names
    ITERATION_LIMIT, LINE_SEARCH_FAILED, BLOCKED : how Newton's method ended (`Implicit`)
    NOT_FINITE : a position or velocity is lost
    INVERTED : a tet is inside out that was not at the start (`XPBD`, as the following)
    INTERSECTING : surfaces penetrate each other, or vertices an obstacle by more than a tolerance
    TRUNCATED : in too many substeps the motion of bodies was shortened to keep tets positive and surfaces apart, or
        works leave energy open for that
    ENERGY_GAINED : more energy than the scene and what drives it had (also `Implicit` with "newmark")
    TIME_STEP : a step loses energy that permanent flow would have taken: the shape that is left depends on dt
        (`Implicit`)
    TUNNELLED : things passed each other in the shortest substep that is allowed (`Implicit`)
    SOFTENED : a body is softer than its material by more than the tolerance
    CRUSHED : a tet has less than a twentieth of its volume, and its material does not ask for it: see
        `supple.model.crushed`
    """

    CONVERGED = "converged"
    ITERATION_LIMIT = "iteration_limit"
    LINE_SEARCH_FAILED = "line_search_failed"
    BLOCKED = "blocked"
    NOT_FINITE = "not_finite"
    INVERTED = "inverted"
    INTERSECTING = "intersecting"
    ENERGY_GAINED = "energy_gained"
    SOFTENED = "softened"
    # Recordings store the number of a status in this list: a new one comes last.
    TRUNCATED = "truncated"
    LINEARIZED = "linearized"
    TUNNELLED = "tunnelled"
    CRUSHED = "crushed"
    TIME_STEP = "time_step"

    @property
    def can_go_on(self) -> bool:
        """Whether the next step may start from the state that came with this status."""
        return self not in (Status.LINE_SEARCH_FAILED, Status.BLOCKED, Status.NOT_FINITE)


@dataclass(frozen=True, eq=False)
class ContactPoints:
    """All contacts of one frame.

    Attributes
    ----------
    points : (k, 3) midpoints between the two nearest points [m]
    normals : (k, 3) unit vectors from the second to the first
    forces, friction : (k, 3) on the first, along the normal and perpendicular to it [N]; those on the second are
        opposite. Of `XPBD` the means over the frame; of `Implicit` those at its end.
    distances : (k,) [m]
    first, second : (k,) the two bodies or obstacles: indices into `names`
    names : of all bodies, and after them of all obstacles
    rows, vertices, weights : (q,) the force of contact `rows[j]` acts with the factor `weights[j]` on the row
        `vertices[j]` of `System.points`: a vertex of a soft body, or of a rigid body's surface; obstacles have none
    """

    points: NDArray[np.float64]
    normals: NDArray[np.float64]
    forces: NDArray[np.float64]
    friction: NDArray[np.float64]
    distances: NDArray[np.float64]
    first: NDArray[np.int32]
    second: NDArray[np.int32]
    names: tuple[str, ...]
    rows: NDArray[np.int64]
    vertices: NDArray[np.int32]
    weights: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.points)

    def force_between(self, on: str, by: str) -> NDArray[np.float64]:
        """(3,) the total force on one body or obstacle by another, friction included [N].

        Raises
        ------
        SceneError : where no body or obstacle has a name.
        """
        a, b = self._number(on), self._number(by)
        forces = self.forces + self.friction
        forward = forces[(self.first == a) & (self.second == b)].sum(axis=0)
        backward = forces[(self.first == b) & (self.second == a)].sum(axis=0)
        return np.asarray(forward - backward)

    def of_pair(self, one: str, other: str) -> ContactPoints:
        """The same contacts; those that are not between the two have no force."""
        a, b = self._number(one), self._number(other)
        theirs = ((self.first == a) & (self.second == b)) | ((self.first == b) & (self.second == a))
        return replace(self, forces=self.forces * theirs[:, None], friction=self.friction * theirs[:, None])

    def by_pair(self) -> dict[tuple[str, str], NDArray[np.float64]]:
        """`force_between` of every two that touch, in both orders: by (on, by), (3,) [N]."""
        low, high = np.minimum(self.first, self.second), np.maximum(self.first, self.second)
        forces = {}
        for a, b in np.unique(np.column_stack([low, high])[low != high], axis=0):
            on, by = self.names[a], self.names[b]
            forces[on, by] = self.force_between(on, by)
            forces[by, on] = -forces[on, by]
        return forces

    def on_vertices(self, forces: NDArray[np.float64], count: int) -> NDArray[np.float64]:
        """(count, 3) the sums on the System's points of forces (k, 3) of the contacts, such as `forces` [N]."""
        shares = self.weights[:, None] * forces[self.rows]
        sums = [np.bincount(self.vertices, column, count) for column in shares.T]
        return np.stack(sums, axis=1).astype(np.float64, copy=False)

    def _number(self, name: str) -> int:
        if name not in self.names:
            raise SceneError(f"body or obstacle {name!r} does not exist; there are {', '.join(map(repr, self.names))}")
        return self.names.index(name)


@dataclass(frozen=True, eq=False)
class State:
    """Positions and velocities of every vertex of a `System` at one time.

    Parameters
    ----------
    time : [s]
    positions, velocities : (n_vertices, 3) float64 [m], [m/s]
    memory : what a solver must know of earlier steps (BDF2, contact of XPBD); None for a state that comes from outside.
    inputs : values of the scene's inputs at that time, by name, see `supple.scene.inputs`
    internal : (k, 11) internal variables of materials that flow, in the order of the bodies and of their laws: of each
        law and tet, or point of a quadratic tet, F_i^-1 of F = F_e F_i (nine numbers), a measure of all flow so far,
        and the energy dissipated per rest volume [J/m^3]. (0, 11) where nothing flows, or has flowed.
    hinge_angles : angles of hinges over all turns [rad], by name; those that are missing are as at a start, see
        `HingeJoint`
    broken_stitches : (b,) numbers of the pairs that have broken, ascending; see `Stitching`
    separated_stitches : (c,) those of them whose sides have been apart since, so that they collide
    """

    time: float
    positions: NDArray[np.float64]
    velocities: NDArray[np.float64]
    memory: Any = None
    inputs: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)
    internal: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 11)))
    hinge_angles: Mapping[str, float] = field(default_factory=dict)
    broken_stitches: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    separated_stitches: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))


@dataclass(frozen=True, eq=False)
class SolverDetails:
    """What one solver reports of a step beyond what all solvers do. Each solver has a subclass of its own.

    A field is an integer, a number, a number or None, or a mapping from names to numbers or to (3,) arrays; its keys
    are the same in every frame, or it is empty. A recording keeps these fields. Two details are equal if these fields
    are. Fields of any other kind have `compare=False`: a recording does not keep them.

    Attributes
    ----------
    contacts : number of pairs in contact
    cavity_pressure, cavity_volume, cavity_work : by name [Pa], [m^3], [J]; see `Report.cavities`
    cable_tension, cable_length, cable_work : by name, with ".k" for span k of the first one [N], [m], [J]; see
        `Report.cables`
    joint_forces, joint_torques : of the joints on their first bodies, limits and motors included, by name, (3,) [N],
        and (3,) about the joint's point [N m]
    joint_coordinates : angles of hinges [rad], travels of sliders [m], swings of balls with limits [rad], by name
    motor_forces : efforts of the motors [N], [N m], by name of their joint
    joint_violations : how far each joint is from holding, as a share of the diameter of gyration of its smaller body
    reaction_forces : of pins on what they hold, by label of the pin, (3,) [N]; of `XPBD` means over the step, without
        those that hold one piece with rigid edges or volumes together: their shares are not known
    work : on the bodies over the step, by what does it [J]; see `Report.work`
    energy_residual : what the forces of the step leave open [J]; see `Report.energy_residual`
    """

    contacts: int = 0
    cavity_pressure: Mapping[str, float] = field(default_factory=dict, kw_only=True)
    cavity_volume: Mapping[str, float] = field(default_factory=dict, kw_only=True)
    cavity_work: Mapping[str, float] = field(default_factory=dict, kw_only=True)
    cable_tension: Mapping[str, float] = field(default_factory=dict, kw_only=True)
    cable_length: Mapping[str, float] = field(default_factory=dict, kw_only=True)
    cable_work: Mapping[str, float] = field(default_factory=dict, kw_only=True)
    joint_forces: Mapping[str, NDArray[np.float64]] = field(default_factory=dict, kw_only=True)
    joint_torques: Mapping[str, NDArray[np.float64]] = field(default_factory=dict, kw_only=True)
    joint_coordinates: Mapping[str, float] = field(default_factory=dict, kw_only=True)
    motor_forces: Mapping[str, float] = field(default_factory=dict, kw_only=True)
    joint_violations: Mapping[str, float] = field(default_factory=dict, kw_only=True)
    reaction_forces: Mapping[str, NDArray[np.float64]] = field(default_factory=dict, kw_only=True)
    work: Mapping[str, float] = field(default_factory=dict, kw_only=True)
    energy_residual: float = field(default=0.0, kw_only=True)

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
    stitch_forces : (k, 3) elastic forces on the vertices of stitches at the end, where a solver knows them better than
        by their law from the positions, NaN for others [N]; or None
    broken_stitches : pairs that broke in the step, by the name of their stitch, or what messages call it: (k, 2) vertex
        of its first body, number of the partner in the second one
    """

    status: Status
    iterations: int
    message: str = ""
    min_distance: float | None = None
    details: SolverDetails = field(default_factory=SolverDetails)
    contacts: Callable[[], ContactPoints] | None = None
    stitch_forces: NDArray[np.float64] | None = None
    broken_stitches: Mapping[str, NDArray[np.int32]] = field(default_factory=dict)


# What helps against a status where its message does not say it.
_REMEDIES = {
    Status.ITERATION_LIMIT: "take a shorter dt, or more max_iterations",
    Status.LINE_SEARCH_FAILED: "take a shorter dt; a static load may have no equilibrium: follow the motion "
    "with integrator='backward_euler'",
    Status.BLOCKED: "let what is named move slower, or elsewhere",
}


class Problems:
    """The frames of a run that did not converge, and why it ended early.

    Parameters
    ----------
    last : index of the frame at which the run is to end

    Attributes
    ----------
    frames : number of frames; bad : how many of them did not converge although the solver could continue
    first : by status, the text of its first frame
    latest : text of the last frame; "" where it converged
    stopped : whether the solver could not continue from the last frame
    """

    def __init__(self, last: int) -> None:
        self.last = last
        self.frames = self.bad = 0
        self.first: dict[Status, str] = {}
        self.latest, self.stopped = "", False

    def note(self, index: int, time: float, status: Status, message: str) -> None:
        """Record a frame."""
        self.frames += 1
        self.stopped, self.latest = not status.can_go_on, ""
        if status is not Status.CONVERGED:
            words = [f"{status}: {message}" if message else str(status), *filter(None, [_REMEDIES.get(status)])]
            text = "; ".join(words)
            self.latest = f"frame {index} of {self.last}, t = {time:.6g} s: {text}"
            if status.can_go_on:
                self.bad += 1
                self.first.setdefault(status, text)

    def __str__(self) -> str:
        texts = [f"stopped at {self.latest}"] if self.stopped else []
        if self.bad:
            first = "; ".join(self.first.values())
            texts.append(f"{self.bad} of {self.frames} frames did not converge; first of each kind: {first}")
        return "; ".join(texts)
