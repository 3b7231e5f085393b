"""The scene behind a page while it runs: what a person may change, the state, and what solvers made of both."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.errors import SolverError
from supple.scene.forces import SoftTarget
from supple.scene.pins import Pin
from supple.scene.scene import Scene
from supple.simulate import first_frame
from supple.solver import Solver
from supple.state import State, Status, StepReport
from supple.system import System, initial_state
from supple.viewer.engine.scene.grab_spring import GrabSpring
from supple.viewer.engine.scene.new_bodies import moved_apart
from supple.viewer.engine.scene.pusher import Pusher
from supple.viewer.engine.scene.solvers import kind_of
from supple.viewer.protocol.live_source import LiveSource

Anchors = Mapping[Pin | SoftTarget, NDArray[np.float64]]


@dataclass(frozen=True, eq=False)
class Setup:
    """Everything that commands change, apart from the state.

    Attributes
    ----------
    scene : without hands, pusher and pins by hand; those are
    hand_pins : by body and vertex; grabs : by number; pusher : or None
    added : names of bodies that a page added
    """

    scene: Scene
    solver: Solver
    dt: float
    page_pins: Mapping[tuple[str, int], Pin] = field(default_factory=lambda: MappingProxyType({}))
    grabs: Mapping[int, GrabSpring] = field(default_factory=lambda: MappingProxyType({}))
    pusher: Pusher | None = None
    added: frozenset[str] = frozenset()

    def whole_scene(self) -> Scene:
        """The scene with everything that the page has put into it."""
        if not self.page_pins and not self.grabs and self.pusher is None:
            return self.scene
        return replace(
            self.scene,
            pins=(*self.scene.pins, *self.page_pins.values()),
            soft_targets=(*self.scene.soft_targets, *(spring.soft_target for spring in self.grabs.values())),
            obstacles=(*self.scene.obstacles, *([self.pusher.obstacle] if self.pusher else [])),
        )


class LiveScene:
    """A running simulation that can be changed between two steps. A change that cannot be made changes nothing.

    Attributes
    ----------
    setup, state : see `Setup` and `State`; frame : steps since the start
    system, workspace : of the present setup
    solvers : by kind, as they were last used
    starts : by body name, (n, 3) of bodies that start deformed; pins : those of the scene itself
    report : of the last step
    generation, revision : see `SceneDescription`

    Raises
    ------
    SuppleError : where the source cannot be simulated.
    """

    def __init__(self, source: LiveSource) -> None:
        self.source = source
        self.starts = dict(source.initial_positions)
        self.pins = tuple(source.scene.pins)
        self.solvers: dict[str, Solver] = {kind_of(source.solver): source.solver}
        self.generation = self.revision = 0
        self.frame = 0
        self.report = StepReport(Status.CONVERGED, 0)
        self.workspace: Any = None
        self._anchors: Anchors = {}
        self.adopt(Setup(source.scene, source.solver, source.dt), initial_state(source.scene, self.starts), anchors={})

    def adopt(self, setup: Setup, state: State | None = None, anchors: Anchors | None = None) -> None:
        """Go on with another setup. The memory of the present state stays: solvers ignore what is not theirs.

        Parameters
        ----------
        state : to go on from, where it is not the present one.
        anchors : where pins and soft targets hold, of those that are kept; None keeps all.

        Raises
        ------
        SuppleError : where the setup cannot be simulated from that state; nothing is changed then.
        """
        state = self.state if state is None else state
        kept = self._anchors if anchors is None else anchors
        scene = setup.whole_scene()
        frame = first_frame(scene, state)
        system = _anchored(frame.system, kept)
        workspace = setup.solver.prepare(system)
        if not hasattr(self, "setup") or not _looks_same(self.system.scene, scene):
            self.generation += 1
        self.revision += 1
        self.setup, self.state, self.system, self.workspace = setup, state, system, workspace
        self._anchors = {held.pin: held.anchors for held in system.pins} | {
            soft.target: soft.anchors for soft in system.soft_targets
        }
        self.solvers[kind_of(setup.solver)] = setup.solver

    def adopt_checked(self, setup: Setup, state: State | None = None, anchors: Anchors | None = None) -> None:
        """The same, for changes after which a solver that never lets surfaces meet might not be able to take a step.

        Raises
        ------
        SuppleError : where the first step would fail; nothing is changed then.
        """
        before = dict(vars(self))
        self.adopt(setup, state, anchors)
        if kind_of(setup.solver) == "xpbd":  # goes on from anywhere
            return
        try:
            _, report = setup.solver.step(self.system, self.state, setup.dt, self.workspace)
            if not report.status.can_go_on:
                raise SolverError(
                    f"the solver {kind_of(setup.solver)} cannot go on from there: {report.message or report.status}"
                )
        except BaseException:
            vars(self).update(before)
            raise
        self.prepare_workspace()  # the step that was tried has left its traces

    def prepare_workspace(self) -> None:
        """Prepare the workspace anew, after a step that was tried, or given up."""
        self.workspace = self.setup.solver.prepare(self.system)

    def step(self) -> StepReport:
        """Simulate one frame. Where that fails, the state stays as it was, and the report says why."""
        setup = self.setup
        if setup.pusher is not None:
            setup.pusher.begin_step(self.state.time, setup.dt)
        for spring in setup.grabs.values():
            spring.pull(self.body_positions(spring.command.body), self._anchors[spring.soft_target])
        state, report = self._stepped()
        if not report.status.can_go_on and setup.pusher is not None and setup.pusher.moves:
            setup.pusher.stay()  # where it cannot press any further
            state, report = self._stepped()
        self.report = report
        if report.status.can_go_on:
            self.state = state
            self.frame += 1
            if setup.pusher is not None:
                setup.pusher.end_step()
        return report

    def _stepped(self) -> tuple[State, StepReport]:
        state, report = self.setup.solver.step(self.system, self.state, self.setup.dt, self.workspace)
        if report.status.can_go_on and not _is_finite(state):
            report = StepReport(Status.NOT_FINITE, report.iterations, "a position or velocity is not finite")
        return state, report

    def reset(self) -> None:
        """Back to the start, with the bodies that are there now, and the parameters and solver as they are.

        Bodies that were added stay where they were added; where another one has its start there, they move above all.
        """
        names = {body.name for body in self.setup.scene.bodies}
        scene = replace(self.setup.scene, pins=tuple(pin for pin in self.pins if pin.body in names))
        starts = {name: start for name, start in self.starts.items() if name in names}
        scene = moved_apart(scene, self.setup.added, starts, self.up)
        self.adopt_checked(
            Setup(scene, self.setup.solver, self.setup.dt, added=self.setup.added),
            initial_state(scene, starts),
            anchors={},
        )
        self.frame = 0
        self.report = StepReport(Status.CONVERGED, 0)

    def body_positions(self, name: str) -> NDArray[np.float64]:
        """(n, 3) of one body [m]."""
        part = next(part for part in self.system.bodies if part.name == name)
        return self.state.positions[part.vertices]

    @property
    def up(self) -> NDArray[np.float64]:
        """(3,) unit vector against gravity; where there was never any, along y."""
        gravity = np.asarray(self.source.scene.gravity)
        size = np.linalg.norm(gravity)
        return -gravity / size if size > 0.0 else np.array([0.0, 1.0, 0.0])


def _anchored(system: System, kept: Anchors) -> System:
    """The system, with pins and soft targets that were there before holding exactly where they held then."""
    pins = tuple(replace(held, anchors=kept.get(held.pin, held.anchors)) for held in system.pins)
    softs = tuple(replace(soft, anchors=kept.get(soft.target, soft.anchors)) for soft in system.soft_targets)
    return replace(system, pins=pins, soft_targets=softs)


def _looks_same(old: Scene, new: Scene) -> bool:
    """Whether what is drawn of two scenes has the same shapes."""
    bodies = [(body.name, body.mesh, body.skin) for body in old.bodies]
    obstacles = [(type(obstacle), obstacle.name, obstacle.motion) for obstacle in old.obstacles]
    return bodies == [(body.name, body.mesh, body.skin) for body in new.bodies] and obstacles == [
        (type(obstacle), obstacle.name, obstacle.motion) for obstacle in new.obstacles
    ]


def _is_finite(state: State) -> bool:
    return bool(np.isfinite(state.positions).all() and np.isfinite(state.velocities).all())
