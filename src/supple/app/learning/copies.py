"""The copies of a batch: a scene with its System and workspace, its State, and the report of its last step."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.errors import SceneError
from supple.model.diagnostics import measure
from supple.model.state import State, Status, StepReport
from supple.model.system import System, initial_state
from supple.results.frame import Frame, completed_report
from supple.scene.scene import Scene
from supple.simulate import advance, first_frame
from supple.solvers.solver import Solver


@dataclass(frozen=True, eq=False)
class Moment:
    """Where one copy is.

    Attributes
    ----------
    index : number of steps since the start
    step : how the last one ended; before : the state where it began, None at the start
    """

    index: int
    state: State
    step: StepReport
    before: State | None = None


@dataclass(eq=False)
class Copy:
    """One copy. `now` is all that changes; the workspace only caches."""

    solver: Solver
    system: System
    workspace: Any
    now: Moment

    @staticmethod
    def of(scene: Scene, solver: Solver) -> Copy:
        """A copy at the start of the scene."""
        first = first_frame(scene, initial_state(scene), solver)
        workspace = solver.prepare(first.system)
        solver.check(first.system, first.state, workspace)
        step = StepReport(Status.CONVERGED, 0, details=solver.initial_details(first.system, workspace))
        return Copy(solver, first.system, workspace, Moment(0, first.state, step))

    def after(self, dt: float, wanted: Mapping[str, NDArray[np.float64]]) -> Moment:
        """Where the copy is after a step; `now` stays. A copy that cannot go on stays where it is."""
        now = self.now
        if not now.step.status.can_go_on:
            return now
        state, step = advance(self.solver, self.system, now.state, dt, self.workspace, {**now.state.inputs, **wanted})
        return Moment(now.index + 1, state, step, now.state)

    def frame(self) -> Frame:
        """The frame of `now`, measured."""
        now = self.now
        before = None if now.before is None else measure(self.system, now.before).energy
        report = completed_report(self.system, now.state, now.step, 0.0, before)
        return Frame(now.index, now.state, self.system, report, now.step.contacts, self.solver)


def scenes_of(
    source: Scene | Callable[..., Scene], n: int, parameters: Mapping[str, Sequence[Any] | NDArray[Any]] | None
) -> list[Scene]:
    """The scenes of n copies; see `Batch`."""
    if isinstance(source, Scene):
        if parameters:
            raise SceneError("Batch: parameters are for a function that returns a Scene; give one instead of a Scene")
        return [source.with_own_inputs() for _ in range(n)]
    if not callable(source):
        raise SceneError(f"Batch: the scene is {source!r}; give a Scene, or a function that returns one")
    values = dict(parameters or {})
    for name, given in values.items():
        if isinstance(given, str) or not isinstance(given, Sequence | np.ndarray) or len(given) != n:
            raise SceneError(f"Batch: parameter {name!r} is {given!r}; give {n} values, one for each copy")
    scenes = []
    for k in range(n):
        scene = source(**{name: given[k] for name, given in values.items()})
        if not isinstance(scene, Scene):
            raise SceneError(f"Batch: the function returned a {type(scene).__name__}; it must return a Scene")
        scenes.append(scene.with_own_inputs())  # a function may return the same scene again
    return scenes


def same_bodies(copies: Sequence[Copy]) -> None:
    """Raise where copies have other bodies than the first, so that their arrays cannot be put together."""
    first = [(part.name, part.vertices, part.points) for part in copies[0].system.bodies]
    for k, copy in enumerate(copies):
        if [(part.name, part.vertices, part.points) for part in copy.system.bodies] != first:
            raise SceneError(
                f"Batch: copy {k} has other bodies, or other numbers of vertices, than copy 0; use `frame` of each copy"
            )
        if {name: one.value.shape for name, one in copy.system.scene.inputs.items()} != {
            name: one.value.shape for name, one in copies[0].system.scene.inputs.items()
        }:
            raise SceneError(f"Batch: copy {k} has other inputs than copy 0; give all copies the same ones")
