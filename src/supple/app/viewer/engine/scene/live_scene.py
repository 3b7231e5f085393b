"""The scene of a live page: its setup, which commands change, its state, and the data of the solver."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.app.viewer.engine.scene.costs import without_long_repetitions
from supple.app.viewer.engine.scene.grab_spring import GrabSpring, grabbed, make_spring, workspace_for
from supple.app.viewer.engine.scene.solvers import kind_of
from supple.app.viewer.protocol.commands import Grab, MoveGrab
from supple.app.viewer.protocol.live_source import LiveSource
from supple.errors import CommandError, SolverError
from supple.model.state import State, Status, StepReport
from supple.model.system import BodyRange, System, initial_state
from supple.scene.forces import Force, SoftTarget
from supple.scene.pins import Pin
from supple.scene.scene import Scene
from supple.simulate import first_frame, prepared_after_breaks
from supple.solvers.solver import Solver
from supple.solvers.xpbd.workspace import XPBDWorkspace


@dataclass(frozen=True, eq=False)
class Setup:
    """Everything that commands change, apart from the state.

    Attributes
    ----------
    scene : without what the page adds to it:
    page_pins : pins made on the page, by body and vertex; grabs : by number
    """

    scene: Scene
    solver: Solver
    dt: float
    page_pins: Mapping[tuple[str, int], Pin] = field(default_factory=lambda: MappingProxyType({}))
    grabs: Mapping[int, GrabSpring] = field(default_factory=lambda: MappingProxyType({}))

    def whole_scene(self) -> Scene:
        """The scene with pins and grabs of the page."""
        if not self.page_pins and not self.grabs:
            return self.scene
        pulls = [spring.load for spring in self.grabs.values()]
        return replace(
            self.scene,
            pins=(*self.scene.pins, *self.page_pins.values()),
            forces=(*self.scene.forces, *(load for load in pulls if isinstance(load, Force))),
            soft_targets=(*self.scene.soft_targets, *(load for load in pulls if isinstance(load, SoftTarget))),
        )


@dataclass(frozen=True, eq=False)
class Start:
    """Where a setup starts, and what the solver computed for it once."""

    setup: Setup
    state: State
    system: System
    workspace: XPBDWorkspace

    def serves(self, setup: Setup) -> bool:
        """Whether a reset with this setup leads here. Grabs and pins of the page end with a reset."""
        same = self.setup
        return setup.scene is same.scene and setup.solver is same.solver


Anchors = Mapping[Pin | SoftTarget, NDArray[np.float64]]


class LiveScene:
    """A running simulation that can be changed between two steps. A change that fails has no effect.

    Attributes
    ----------
    setup, state : see `Setup` and `State`; frame : number of steps since the start
    system, workspace : of the current setup
    solvers : by kind, with the settings used last
    starts : by body name, (n, 3) of bodies with deformed initial positions; pins : those of the source
    report : of the last step
    revision : see `SceneDescription`

    Raises
    ------
    SuppleError : where the source cannot be simulated.
    """

    def __init__(self, source: LiveSource) -> None:
        self.source = source
        self.starts = dict(source.initial_positions)
        self.pins = tuple(source.scene.pins)
        self.solvers: dict[str, Solver] = {kind_of(source.solver): source.solver}
        self.revision = 0
        self.frame = 0
        self.report = StepReport(Status.CONVERGED, 0)
        self.workspace: Any = None
        self._anchors: Anchors = {}
        self._start: Start | None = None
        self._usual: tuple[int, int] | None = None  # a revision, and the iterations of its first step
        self.adopt(Setup(source.scene, source.solver, source.dt), initial_state(source.scene, self.starts), anchors={})
        self._keep_start()

    def adopt(self, setup: Setup, state: State | None = None, anchors: Anchors | None = None) -> None:
        """Continue with another setup. The memory of the current state is kept: a solver ignores that of another one.

        Parameters
        ----------
        state : to continue from, where it is not the current one.
        anchors : positions at which pins and soft targets hold, for those that are kept; None keeps all.

        Raises
        ------
        SuppleError : where the setup cannot be simulated from this state; then nothing is changed.
        """
        state = self.state if state is None else state
        kept = self._anchors if anchors is None else anchors
        scene = setup.whole_scene()
        frame = first_frame(scene, state)
        system = _anchored(frame.system, kept)
        workspace = setup.solver.prepare(system)
        # Later changes may put bodies into each other, which XPBD then pushes apart.
        if not hasattr(self, "setup") or kind_of(setup.solver) != "xpbd":
            setup.solver.check(system, state, workspace)
        self.revision += 1
        self.setup, self.state, self.system, self.workspace = setup, state, system, workspace
        self._anchors = _anchors_of(system)
        self.solvers[kind_of(setup.solver)] = setup.solver

    def grab(self, grabs: Mapping[int, GrabSpring]) -> None:
        """Continue with these grabs, by number. Does not compute again what does not depend on grabs, as `adopt` does.

        Raises
        ------
        SuppleError : where this is impossible; then nothing is changed.
        """
        setup = replace(self.setup, grabs=grabs)
        system = grabbed(self.system, setup.whole_scene(), grabs)
        workspace = workspace_for(setup.solver, system, self.workspace)
        self.setup, self.system, self.workspace = setup, system, workspace
        self._anchors = _anchors_of(system)

    def adopt_checked(self, setup: Setup, state: State | None = None, anchors: Anchors | None = None) -> None:
        """The same as `adopt`, after a trial step: a solver that allows no intersection may be unable to take a step.

        Raises
        ------
        SuppleError : where the first step would fail; then nothing is changed.
        """
        before = dict(vars(self))
        self.adopt(setup, state, anchors)
        if kind_of(setup.solver) == "xpbd":  # takes steps from any state
            return
        try:
            _, report = setup.solver.step(self.system, self.state, setup.dt, self.workspace)
            if not report.status.can_go_on:
                raise SolverError(
                    f"the solver {kind_of(setup.solver)} cannot start from there: {report.message or report.status}"
                )
        except BaseException:
            vars(self).update(before)
            raise
        self.prepare_workspace()  # the trial step has changed the workspace

    def prepare_workspace(self) -> None:
        """Prepare a new workspace, after a step that was not completed."""
        self.workspace = self.setup.solver.prepare(self.system)
        self._start = None  # its workspace shares arrays with the one that was left in the middle of a step

    def warm_up(self) -> None:
        """Pull for a step and discard it, so that compiled kernels are loaded before a person waits for them.

        Not far: contacts of a surface that is torn through others take many seconds.
        """
        setup, state = self.setup, self.state
        for body in self.system.bodies[:1]:
            x = self.body_positions(body.name)
            target = x[0] + 0.1 * (x.mean(axis=0) - x[0])
            command = Grab(0, body.name, (0,), (1.0,), (target[0], target[1], target[2]))
            self.grab({0: make_spring(command, setup.scene, body, self.system.masses, state.positions)})
        if self.step().status.can_go_on and self._start is not None:
            self._return(self._start)
        else:
            self.adopt(setup, state)
        self.frame = 0

    def step(self) -> StepReport:
        """Simulate one frame. Where this fails, the state does not change, and the report contains the reason."""
        setup = self.setup
        for spring in setup.grabs.values():
            self._aim(spring)
        state, report = self._stepped()
        self.report = report
        if report.status.can_go_on:
            self.state = state
            self.frame += 1
        return report

    @property
    def follows_within_steps(self) -> bool:
        """Whether a grab may move within a step: XPBD asks for loads in every substep, Newton's method only once."""
        return kind_of(self.setup.solver) == "xpbd"

    def move_grab(self, command: MoveGrab) -> None:
        """Let a grab pull to another place, in the middle of a step where `follows_within_steps`."""
        spring = self.setup.grabs.get(command.grab)
        if spring is not None:  # otherwise it was removed meanwhile, for example by a reset
            spring.target[:] = command.target
            self._aim(spring)

    def _aim(self, spring: GrabSpring) -> None:
        """Set what a grab does in the current step."""
        anchors = self._anchors[spring.load] if isinstance(spring.load, SoftTarget) else None
        spring.begin_step(self.system, self.state, self.setup.dt, anchors)

    def _stepped(self) -> tuple[State, StepReport]:
        solver = self._frame_solver()
        state, report = solver.step(self.system, self.state, self.setup.dt, self.workspace)
        stepped = prepared_after_breaks(solver, self.system, state, report, self.workspace)
        _, state, report, _ = stepped
        if report.status.can_go_on:
            self.system, _, _, self.workspace = stepped
        if self._usual is None or self._usual[0] != self.revision:
            self._usual = self.revision, report.iterations
        finite = np.isfinite(state.positions).all() and np.isfinite(state.velocities).all()
        if report.status.can_go_on and not finite:
            report = StepReport(Status.NOT_FINITE, report.iterations, "a position or velocity is not finite")
        return state, report

    def _frame_solver(self) -> Solver:
        """The solver of the next frame; the first frame of a setup tells what is usual."""
        setup = self.setup
        if not self.source.real_time or self._usual is None or self._usual[0] != self.revision:
            return setup.solver
        return without_long_repetitions(setup.solver, self.system, setup.dt, self._usual[1])

    def reset(self) -> None:
        """Return to the start, with the current parameters and solver."""
        if self._start is not None and self._start.serves(self.setup):
            self._return(self._start)
        else:
            self._restart()
            self._keep_start()
        self.frame = 0
        self.report = StepReport(Status.CONVERGED, 0)

    def _return(self, start: Start) -> None:
        """Return to a start without computing again what has not changed."""
        self.revision += 1
        self.setup = replace(start.setup, dt=self.setup.dt)
        self.state, self.system, self.workspace = start.state, start.system, start.workspace
        self._anchors = _anchors_of(start.system)

    def _keep_start(self) -> None:
        """Keep the current state for later resets. Only a workspace of XPBD does not depend on earlier steps."""
        if isinstance(self.workspace, XPBDWorkspace):
            self._start = Start(self.setup, self.state, self.system, self.workspace)

    def _restart(self) -> None:
        """Compute the start with the current parameters and solver."""
        scene = replace(self.setup.scene, pins=self.pins)
        start = initial_state(scene, self.starts)
        self.adopt_checked(Setup(scene, self.setup.solver, self.setup.dt), start, anchors={})

    def part(self, name: str) -> BodyRange:
        """The rows of one body; raises `CommandError` where none exists of that name."""
        parts = self.system.bodies
        for part in parts:
            if part.name == name:
                return part
        raise CommandError(f"body {name!r} does not exist; there are {', '.join(repr(item.name) for item in parts)}")

    def body_positions(self, name: str) -> NDArray[np.float64]:
        """(n, 3) of one body [m]."""
        return self.state.positions[self.part(name).vertices]

    @property
    def up(self) -> NDArray[np.float64]:
        """(3,) unit vector against the gravity of the source; along y where that is zero."""
        gravity = np.asarray(self.source.scene.gravity)
        size = np.linalg.norm(gravity)
        return -gravity / size if size > 0.0 else np.array([0.0, 1.0, 0.0])


def _anchors_of(system: System) -> Anchors:
    pins = {held.pin: held.anchors for held in system.pins}
    return pins | {soft.target: soft.anchors for soft in system.soft_targets}


def _anchored(system: System, kept: Anchors) -> System:
    """The system, in which pins and soft targets that existed before keep their exact anchors."""
    pins = tuple(replace(held, anchors=kept.get(held.pin, held.anchors)) for held in system.pins)
    softs = tuple(replace(soft, anchors=kept.get(soft.target, soft.anchors)) for soft in system.soft_targets)
    return replace(system, pins=pins, soft_targets=softs)
