"""A frame: the scene at one time, with the report of the step that led to it and what is read from it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from supple.model.actuator_readings import CableReading, CavityReading, cable_readings, cavity_readings
from supple.model.crushed import HELD, crushed_message, crushed_tets
from supple.model.diagnostics import Diagnostics, measure
from supple.model.energy_balance import completed_works
from supple.model.state import ContactPoints, SolverDetails, State, Status, StepReport
from supple.model.system import System
from supple.results.readings.frame_readings import FrameReadings, JointReading, joint_readings
from supple.runtime.displayed import DisplayedReport

if TYPE_CHECKING:
    from supple.solvers.solver import Solver


@dataclass(frozen=True, eq=False, repr=False)
class Report(DisplayedReport, Diagnostics):
    """How the step of one frame ended, and what was measured on its state.

    Attributes
    ----------
    status, iterations, message, min_distance, details : see `StepReport`
    wall_seconds : time the step took [s]
    broken_stitches : pairs that broke in this frame, see `StepReport`
    """

    status: Status
    iterations: int
    wall_seconds: float
    message: str = ""
    min_distance: float | None = None
    details: SolverDetails = field(default_factory=SolverDetails)
    broken_stitches: Mapping[str, NDArray[np.int32]] = field(default_factory=dict)

    @property
    def softening(self) -> Mapping[str, float]:
        """By body, the share of its stiffness that it lacks, estimated; empty where the solver does not soften."""
        return getattr(self.details, "softening", {})

    @property
    def work(self) -> Mapping[str, float]:
        """The works on the bodies over the frame by what does them, see `supple.model.energy_balance` [J]."""
        return self.details.work

    @property
    def energy_residual(self) -> float:
        """The change of `energy` over the frame that the sum of `work` leaves open [J]."""
        return self.details.energy_residual

    @property
    def joints(self) -> Mapping[str, JointReading]:
        """The state and the forces of every joint, by name."""
        return joint_readings(self.details)

    @property
    def cavities(self) -> Mapping[str, CavityReading]:
        """By name, the pressure [Pa] and volume [m^3] of each cavity, and its work over the frame [J]."""
        return cavity_readings(self.details)

    @property
    def cables(self) -> Mapping[str, CableReading]:
        """By name, the tensions [N] and the length [m] of each cable, and its work over the frame [J]."""
        return cable_readings(self.details)


@dataclass(frozen=True, eq=False, repr=False)
class Frame(FrameReadings):
    """The scene at one time. For stresses and forces, see `FrameReadings`.

    Attributes
    ----------
    index : number of steps since the start; time : [s]
    report : see `Report`; state : flat arrays of all bodies; system : what they belong to
    find_contacts : finds the contacts of `contacts`; solver : which made it; each None where it is not known
    """

    index: int
    state: State
    system: System
    report: Report
    find_contacts: Callable[[], ContactPoints] | None = None
    solver: Solver | None = None

    @property
    def time(self) -> float:
        """[s]"""
        return self.state.time

    @cached_property
    def contacts(self) -> ContactPoints | None:
        """All contacts, one by one; None where no step led to the frame, or `Implicit` has contact=None."""
        return None if self.find_contacts is None else self.find_contacts()


def completed_report(
    system: System, state: State, step: StepReport, seconds: float, energy_before: float | None = None
) -> Report:
    """The report of a step that took this many seconds, with what is measured on its state.

    energy_before : `energy` where the step began [J]; None where there was no step. Works of a solver that reports
        some get the numerical one.
    """
    measured = measure(system, state)
    if measured.min_det_F < HELD and step.status in (Status.CONVERGED, Status.LINEARIZED, Status.SOFTENED):
        tets = crushed_tets(system, state)
        if len(tets):
            message = "; ".join(filter(None, (crushed_message(system, state, tets), step.message)))
            step = replace(step, status=Status.CRUSHED, message=message)
    values = vars(measured) | vars(step)
    del values["contacts"], values["stitch_forces"]  # the first are made when they are asked for: `Frame.contacts`
    details = step.details
    if energy_before is not None and details.work:
        works = completed_works(details.work, details.energy_residual, measured.energy - energy_before)
        details = replace(details, work=works)
    values["details"] = details
    return Report(**values, wall_seconds=seconds)


def start_frame(system: System, state: State, index: int, solver: Solver | None) -> Frame:
    """A frame without a step that led to it."""
    report = completed_report(system, state, StepReport(Status.CONVERGED, 0), 0.0)
    return Frame(index, state, system, report, solver=solver)
