"""XPBD with small steps: n substeps of one Gauss-Seidel sweep each, multipliers starting at 0.

Source: Macklin, Müller, Chentanez, "XPBD" (2016); Macklin et al., "Small Steps in Physics Simulation" (2019).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Annotated, ClassVar, Literal

import numba
import numpy as np
from numba.core import config

from supple.errors import SolverError
from supple.kinds.validators import COUNT, POSITIVE, SHARE, Boolean, Choice, OneOf, Union
from supple.model.actuator_readings import actuator_fields, start_of
from supple.model.energy_balance import no_works
from supple.model.joints.at_state import refuse_moved_welds
from supple.model.state import State, Status, StepReport
from supple.model.system import System
from supple.runtime.thread_tuning import ThreadTuner
from supple.runtime.threads import numba_threads
from supple.solvers.solver import Solver
from supple.solvers.xpbd.assessment.assessment import Assessment
from supple.solvers.xpbd.assessment.softening import enough
from supple.solvers.xpbd.assessment.works import Works
from supple.solvers.xpbd.constraints.actuators import ActuatorProjection
from supple.solvers.xpbd.constraints.delivered_work import DeliveredWork
from supple.solvers.xpbd.constraints.registry import build_constraint_sets, refuse_materials
from supple.solvers.xpbd.constraints.stitches import StitchAnchors, StitchForces, stitch_constraints
from supple.solvers.xpbd.contact.contact import Contact
from supple.solvers.xpbd.contact.settings import XPBDContact
from supple.solvers.xpbd.damping.kelvin_voigt import make_damping
from supple.solvers.xpbd.details import XPBDDetails
from supple.solvers.xpbd.external_forces import ExternalForces
from supple.solvers.xpbd.frame.advance import advance, disturbed_bodies, load, overlaps_of
from supple.solvers.xpbd.frame.end import end_frame
from supple.solvers.xpbd.integration import first_lost
from supple.solvers.xpbd.memory import XPBDMemory
from supple.solvers.xpbd.momentum import MomentumRestore
from supple.solvers.xpbd.rigid.bodies import RigidBodies
from supple.solvers.xpbd.rigid.joints import JointProjection
from supple.solvers.xpbd.sleep import Sleep
from supple.solvers.xpbd.start import raise_if_inside, raise_if_within_thickness
from supple.solvers.xpbd.substeps import SubstepChoice, Substeps
from supple.solvers.xpbd.sweeps.ordering import Layout, make_layout, reordered
from supple.solvers.xpbd.welded_masses import WeldedMasses
from supple.solvers.xpbd.workspace import XPBDWorkspace


def refuse_unsupported(system: System) -> None:
    """Check that XPBD can simulate the bodies of a system.

    Raises
    ------
    SolverError : where it cannot.
    """
    for part in system.bodies:
        if part.body.touches_with_skin and not part.rigid:
            raise SolverError(f"XPBD: body {part.name!r} touches with its skin; simulate it with Implicit")
    quadratic = [part.name for part in system.bodies if part.body.mesh.order == 2]
    if quadratic:
        raise SolverError(
            f"XPBD: body {quadratic[0]!r} has quadratic tets; simulate it with Implicit, or give linear tets: "
            "mesh.to_order(1)"
        )


def lost_position_message(system: System, layout: Layout, vertex: int, time: float) -> str:
    """The message of a frame that ended because the position of a vertex (in the solver's numbering) is lost."""
    part = next(p for p in system.bodies if p.vertices.start <= vertex < p.vertices.stop)
    number = int(layout.old_from_new[vertex]) - part.vertices.start
    return (
        f"XPBD: body {part.name!r}, vertex {number}: its position is lost (not finite, or beyond 1e12 m) "
        f"at t = {time:g} s; take more substeps or a shorter dt"
    )


# How often a bad frame is repeated with twice as many substeps. Surfaces that cross with twice as many also cross with
# more.
MOST_REPEATS, MOST_FOR_CROSSINGS = 2, 1
# Below this much work, in edges or volumes, a sweep ends before a second thread has started.
PARALLEL_FROM = 20_000
# What a point of a rigid body costs in contact, in the same units: such a scene may have no elastic constraints.
RIGID_POINT = 15
_MOST_THREADS: int = config.NUMBA_NUM_THREADS  # pyright: ignore[reportAttributeAccessIssue]


@dataclass(frozen=True)
class XPBD(Solver):
    """Extended position-based dynamics: fast, robust and approximate. The error decreases with more substeps.

    Parameters
    ----------
    substeps : number of substeps of a frame, each with one sweep over all constraints. "auto": what the frame needs
        (see `supple.solvers.xpbd.substeps`); a frame that turns out bad is repeated with more. `report.details`
        tells how many, and why.
    momentum_restore : restore the momentum that constraint projection takes from free bodies (see
        `supple.solvers.xpbd.momentum`). False shows the behaviour of plain XPBD.
    contact : contact of bodies with each other and with themselves; None turns it off. Obstacles always act.
    accuracy : the share of its stiffness that a body may lack; beyond it, the status of a frame is `softened`.
    max_substeps : the largest automatic number.
    sleep_after : how long a body stays at its place before it sleeps [s], see `supple.solvers.xpbd.sleep`; None:
        nothing sleeps
    start : how bodies are treated that begin inside of something: an error, or they are slowly pushed out.
    threads : number of threads. None: one, or all of Numba's where the scene is large enough and several threads are
        measured to be faster. The result has the same bits for any number.

    Raises
    ------
    SolverError : where a value is of the wrong kind or out of range.
    """

    kind: ClassVar[str] = "xpbd"

    substeps: Annotated[int | Literal["auto"], Union(COUNT, "auto")] = "auto"
    momentum_restore: Annotated[bool, Boolean()] = True
    contact: Annotated[XPBDContact | None, OneOf((XPBDContact,), "XPBDContact(...), or None to turn it off")] = field(
        default_factory=XPBDContact
    )
    threads: Annotated[int | None, COUNT] = None
    accuracy: Annotated[float, SHARE] = 0.02
    max_substeps: Annotated[int, COUNT] = 1000
    start: Annotated[Literal["refuse", "push_out"], Choice(("refuse", "push_out"))] = "refuse"
    sleep_after: Annotated[float | None, POSITIVE] = 0.5

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.threads is not None and self.threads > _MOST_THREADS:
            raise SolverError(
                f"XPBD: threads is {self.threads}; this process has {_MOST_THREADS}"
                " (set NUMBA_NUM_THREADS before it starts for more)"
            )

    def refuse(self, system: System) -> None:
        """Raise where a body touches with its skin, has quadratic tets, or a material without constraints of XPBD.

        Raises
        ------
        SolverError : the text names the body.
        """
        refuse_unsupported(system)
        refuse_materials(system)

    def prepare(self, system: System) -> XPBDWorkspace:
        """Number the vertices, sort the constraints into chunks, and compute their constants.

        Raises
        ------
        SolverError : where a body touches with its skin, has quadratic tets, or its material has no XPBD constraints;
            the text names it.
        """
        self.refuse(system)
        welded = WeldedMasses(system)
        system = welded.system
        layout = make_layout(system)
        inner = reordered(system, layout)
        inverse_masses = np.concatenate([inner.inverse_masses, np.zeros(len(inner.stitching.anchors))])
        sets = [*build_constraint_sets(inner, layout), *stitch_constraints(inner, inverse_masses)]
        threads = self.threads or numba.get_num_threads()
        work = sum(made.work for made in sets)
        rigid = RigidBodies(inner)
        with numba_threads(self.threads or (None if work >= PARALLEL_FROM else 1)):
            contact = Contact(inner, rigid, inverse_masses, self.contact)
        large = work + RIGID_POINT * contact.rigid_points >= PARALLEL_FROM
        parallel = threads > 1 and (large or self.threads is not None)
        with numba_threads(self.threads or (None if large else 1)):
            assessment = Assessment(inner, self.contact, contact.edge_length)
        return XPBDWorkspace(
            system=inner,
            layout=layout,
            welded=welded,
            rigid=rigid,
            joints=JointProjection(system, layout, rigid),
            sets=sets,
            damping=make_damping(inner, layout, inverse_masses),
            momentum=MomentumRestore(inner),
            restores=self.momentum_restore,
            contact=contact,
            loads=ExternalForces(inner),
            actuators=ActuatorProjection(inner),
            assessment=assessment,
            delivered=DeliveredWork(inner, sets),
            works=Works(inner),
            choice=SubstepChoice(inner, assessment.softening, bool(contact), rigid),
            sleep=Sleep(inner, layout, self.sleep_after, self.accuracy),
            threads=self.threads or (None if large else 1),
            pace=ThreadTuner(choice=parallel and self.threads is None, parallel=parallel),
            anchors=StitchAnchors(inner),
            stitch_forces=StitchForces(inner, sets),
        )

    def check(self, system: System, state: State, workspace: XPBDWorkspace) -> None:
        """Raise where a body begins inside of something, or a joint does not hold; a state of XPBD may be continued.

        Raises
        ------
        SceneError : names the things, the depth and the remedy.
        """
        if isinstance(state.memory, XPBDMemory):
            return
        refuse_moved_welds(system, state)
        workspace.joints.check(workspace.welded.inner(state))
        if self.start == "refuse":
            edge_length = workspace.contact.edge_length
            with numba_threads(workspace.threads):
                raise_if_inside(system, state.positions, state.time, self.contact, edge_length)
                if system.shells is not None:
                    raise_if_within_thickness(system, state.positions, state.time, self.contact)

    def step(self, system: System, state: State, dt: float, workspace: XPBDWorkspace) -> tuple[State, StepReport]:
        """Advance by `dt` [s]. The returned state has its own arrays.

        With automatic substeps, a frame that turns out bad is undone and repeated with twice as many.
        """
        with workspace.own_threads():
            new, report = self._step(system, workspace.welded.inner(state), dt, workspace)
            return workspace.welded.outer(new), replace(report, stitch_forces=workspace.stitch_forces.latest)

    def _step(self, system: System, state: State, dt: float, ws: XPBDWorkspace) -> tuple[State, StepReport]:
        time = state.time + dt
        setting = "max_substeps" if self.substeps == "auto" else "substeps"
        memory = state.memory if isinstance(state.memory, XPBDMemory) else XPBDMemory()
        load(ws, state)
        used, repeats = self._first_choice(ws, state, dt, memory), 0
        sleep = ws.sleep.begin(state.positions, state.velocities, state.time, dt, memory.sleep)
        overlaps = overlaps_of(ws, state.time, sleep)
        while True:
            advance(ws, state, dt, used.count, memory, overlaps, sleep)
            lost = first_lost(ws.points, ws.velocities, len(ws.points))
            if lost < 0:
                disturbed = disturbed_bodies(ws, time, sleep)
                if disturbed.any():
                    sleep = ws.sleep.woken(sleep, disturbed)
                    load(ws, state)
                    overlaps = overlaps_of(ws, state.time, sleep)
                    continue
                frame = (time, dt, used, repeats, memory, overlaps, sleep)
                new, report, problem = end_frame(ws, *frame, self.accuracy, setting)
            else:
                problem = Status.NOT_FINITE
            most = MOST_FOR_CROSSINGS if problem is Status.INTERSECTING else MOST_REPEATS
            last = self.substeps != "auto" or used.count >= self.max_substeps or repeats >= most
            if last or problem is None or problem in memory.futile:
                break
            repeats += 1
            most = min(2 * used.count, self.max_substeps)
            if problem is Status.SOFTENED:
                shares = ws.assessment.softening.by_body(dt / used.count, new.memory.measured)
                needed = enough(used.count, shares, self.accuracy)
                most = min(most, needed) if needed > used.count else most
            used = Substeps(most, f"a repetition: {problem}")
        if lost >= 0:
            message = lost_position_message(ws.system, ws.layout, lost, time)
            details = self.initial_details(system, ws)
            return state, StepReport(Status.NOT_FINITE, used.count, message, details=details)
        return new, report

    def _first_choice(self, ws: XPBDWorkspace, state: State, dt: float, memory: XPBDMemory) -> Substeps:
        """How many substeps the frame is simulated with at first."""
        if self.substeps != "auto":
            return Substeps(self.substeps, "the user")
        known = ws.assessment.softening.own(memory.measured)
        wanted = ws.choice.choose(ws.moment(state.time), dt, self.accuracy, memory.substeps, known)
        if wanted.count > self.max_substeps:
            return Substeps(self.max_substeps, f"max_substeps; {wanted.reason} needs {wanted.count}")
        return wanted

    def initial_details(self, system: System, workspace: XPBDWorkspace) -> XPBDDetails:
        """No contacts; see `Solver.initial_details`."""
        pushes, friction = workspace.contact.forces.by_name()
        return XPBDDetails(
            softening=dict.fromkeys((part.name for part in system.bodies), 0.0),
            asleep=dict.fromkeys((part.name for part in system.bodies), False),
            contact_forces=pushes,
            friction_forces=friction,
            **actuator_fields(system, *start_of(system)),
            weld_forces={name: np.zeros(3) for name in workspace.welded.names},
            **workspace.joints.initial_fields(workspace.welded.inner(system.start_states[-1])),
            reaction_forces={label: np.zeros(3) for label in workspace.works.held.reactions},
            work=no_works(system),
        )
