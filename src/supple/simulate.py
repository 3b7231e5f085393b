"""The simulation loop. This file shows how the whole program works together."""

from __future__ import annotations

import logging
import math
import sys
import time
import warnings
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.contact.separated_sides import with_separated_sides
from supple.errors import SceneError, SolverError, SuppleError, SuppleWarning
from supple.materials.elastic_tets.laws import joined_materials, tet_material
from supple.materials.laws.internal import checked
from supple.model.breaking import after_breaks, are_of
from supple.model.crushed import too_soft
from supple.model.state import Problems, State, Status, StepReport
from supple.model.system import System, build_system, initial_state
from supple.results.frame import Frame, completed_report, start_frame
from supple.runtime.displayed import supplied
from supple.runtime.memory import require_memory
from supple.scene.inputs import checked_values, drive_inputs, hold_inputs
from supple.scene.scene import Scene
from supple.solvers.auto import Auto
from supple.solvers.solver import Solver

logger = logging.getLogger(__name__)

# Beyond these, dt^2 and 1 / dt^2 leave what float64 can hold.
DT_RANGE = (1e-30, 1e30)


class StartFrame(Protocol):
    """A frame to start from: a `Frame`, or a frame of a recording."""

    @property
    def index(self) -> int: ...
    @property
    def state(self) -> State: ...


class Sink(Protocol):
    """Something that receives frames: a recording, a progress bar, a page."""

    def begin(self, first: Frame, dt: float, steps: int) -> None:
        """Called once, with the frame at the start."""
        ...

    def write(self, frame: Frame) -> None:
        """Called with every frame that was simulated."""
        ...

    def end(self) -> None:
        """Called once, also when the simulation stops early."""
        ...


Control = Callable[[Frame], "Mapping[str, ArrayLike] | None"]
Frames = Generator[Frame, "Mapping[str, ArrayLike] | None", None]


class NullSink:
    """A sink that keeps nothing."""

    def begin(self, first: Frame, dt: float, steps: int) -> None: ...

    def write(self, frame: Frame) -> None: ...

    def end(self) -> None: ...


def simulate(
    scene: Scene,
    solver: Solver | Auto | None = None,
    dt: float | None = None,
    steps: int | None = None,
    *,
    initial_positions: Mapping[str, ArrayLike] | None = None,
    initial_velocities: Mapping[str, ArrayLike] | None = None,
    start: StartFrame | State | None = None,
    control: Control | None = None,
    sinks: Sequence[Sink] = (),
    progress: bool = False,
    strict: bool = False,
) -> Frames:
    """Advance a scene and yield a frame after each step.

    Where the solver cannot continue, ends early; the report of the last frame gives the reason. At the end, a
    `SuppleWarning`, which is in the log too, says why it ended early, which frames did not converge, and what to do.

    Parameters
    ----------
    scene : what to simulate.
    solver : `XPBD(...)` or `Implicit(...)`; without one, or with `Auto(...)`, the one that suits the scene:
        `frame.solver` is it, and `frame.solver.because` the reason.
    dt : time from frame to frame [s].
    steps : number of frames.
    initial_positions, initial_velocities : by body name, (n, 3) [m], [m/s], as in a frame; the others start as the
        scene describes.
    start : a frame or state of this scene to continue from, of any solver or from a recording; excludes the two above.
        From a `Frame` of the same scene object and an equal solver, the frames have the bits of an uninterrupted run.
    control : called before each step with the latest frame; returns values of the scene's inputs for the end of the
        step, by name, or None. Others stay as they are. `send` of the generator does the same.
    sinks : receive the start, every frame, and the end.
    progress : whether to show a bar, in a terminal or a notebook; see `ProgressBar`.
    strict : raise `SolverError` at the first frame whose status is not `converged`, instead of yielding it. Sinks have
        received it.

    Raises
    ------
    SceneError, SolverError : before the first step, where the input cannot be simulated; later, where an input is set
        to what it cannot have, and as `strict` says.
    """
    if not isinstance(scene, Scene):
        raise SceneError(f"simulate: the scene is a {type(scene).__name__}; give a Scene")
    solver = Auto() if solver is None else solver
    if not isinstance(solver, Solver | Auto):
        raise SolverError(f"simulate: the solver is {solver!r}; give XPBD(...) or Implicit(...)")
    dt, steps = check_timing("simulate", dt, steps)
    if start is not None and (initial_positions is not None or initial_velocities is not None):
        raise SceneError("simulate: give `start`, or initial positions and velocities, not both")
    if start is None:
        start = initial_state(scene, initial_positions, initial_velocities)
    if isinstance(solver, Solver):
        first, workspace = prepared(scene, start, solver)
    else:
        choices = solver.choices(first_frame(scene, start).system, dt)
        before = getattr(start, "solver", None)  # a run that resumes keeps its solver
        first, workspace = _first_able(scene, start, sorted(choices, key=lambda choice: choice != before))
    shown = [supplied("progress")()] if progress else []
    return frames_from(first, dt, steps, workspace, control, [*sinks, *shown], strict)


def prepared(scene: Scene, start: StartFrame | State, solver: Solver) -> tuple[Frame, Any]:
    """The frame at the start, and the solver's workspace; errors are those of `simulate`."""
    tets = sum(len(body.mesh.tets) for body in scene.bodies)
    what = f"simulate: the scene of {tets} tets"
    require_memory(solver.bytes_needed(scene), what, "make the meshes coarser, or use XPBD")
    first = first_frame(scene, start, solver)
    for text in filter(None, (too_soft(first.system, part) for part in first.system.bodies)):
        logger.warning("%s", text)
    workspace = solver.prepare(first.system)
    solver.check(first.system, first.state, workspace)
    details = solver.initial_details(first.system, workspace)
    return replace(first, report=replace(first.report, details=details)), workspace


def _first_able(scene: Scene, start: StartFrame | State, solvers: Sequence[Solver]) -> tuple[Frame, Any]:
    """As `prepared`, of the first solver that accepts the start; where none does, the error is that of the first."""
    try:
        return prepared(scene, start, solvers[0])
    except SuppleError as error:
        for other in solvers[1:]:
            with suppress(SuppleError):
                return prepared(scene, start, other.chosen(f"{solvers[0].label} cannot start: {error}"))
        raise


def check_timing(caller: str, dt: Any, steps: Any) -> tuple[float, int]:
    """A length of time [s] and a number of steps; raises `SolverError` where they are not, whose text begins so."""
    if isinstance(dt, bool) or not isinstance(dt, (int, float, np.number)) or not math.isfinite(dt) or dt <= 0.0:
        raise SolverError(f"{caller}: dt is {dt!r}; it must be finite and above zero [s]")
    if not DT_RANGE[0] <= dt <= DT_RANGE[1]:
        raise SolverError(f"{caller}: dt is {dt!r}; it must be between {DT_RANGE[0]:g} and {DT_RANGE[1]:g} s")
    if isinstance(steps, bool) or not isinstance(steps, (int, np.integer)) or steps < 0:
        raise SolverError(f"{caller}: steps is {steps!r}; give a whole number of zero or more")
    return float(dt), int(steps)


def first_frame(scene: Scene, start: StartFrame | State, solver: Solver | None = None) -> Frame:
    """The frame at the start: number 0 (or that of `start`), before any step by `solver`."""
    state = start if isinstance(start, State) else getattr(start, "state", None)
    if not isinstance(state, State):
        raise SceneError(f"simulate: start is a {type(start).__name__}; give a Frame, a recorded frame, or a State")
    index = 0 if isinstance(start, State) else start.index
    if not all(np.isfinite(values).all() for values in (state.time, state.positions, state.velocities)):
        raise SceneError("simulate: start holds a value that is not finite")
    count = sum(len(body.mesh.vertices) for body in scene.bodies)
    if state.positions.shape != (count, 3) or state.velocities.shape != (count, 3):
        raise SceneError(
            f"simulate: start has {len(state.positions)} vertices, the scene has {count}; give one of this scene"
        )
    if not are_of(state, scene):
        raise SceneError("simulate: start has broken stitches that the scene does not have; give one of this scene")
    state = _with_inputs(scene, _with_internal(scene, state))
    # A frame of this scene has the pins' anchors; computing them again would give them only up to round-off.
    if isinstance(start, Frame) and start.system.scene is scene:
        system = start.system
        # Solvers derive constants from the starts. The same solver keeps them; another one must accept this start.
        if solver is None or start.solver != solver:
            system = replace(system, start_states=(system.start_states[0], state))
    else:
        system = build_system(scene, state)
    return start_frame(system, state, index, solver)


def _with_internal(scene: Scene, state: State) -> State:
    """The state with the internal variables of the scene's materials, at rest where it has none."""
    material = joined_materials([tet_material(b.material, len(b.mesh.tets), b.mesh.order) for b in scene.bodies])
    return replace(state, internal=checked(material, state.internal)) if material.flowing_laws else state


def _with_inputs(scene: Scene, state: State) -> State:
    """The state with a value of every input, which the inputs have from now on."""
    if not scene.inputs:
        return state
    given = checked_values(scene.inputs, {name: state.inputs[name] for name in scene.inputs.keys() & state.inputs})
    values = {name: given.get(name, one.value) for name, one in scene.inputs.items()}
    hold_inputs(scene.inputs, values, state.time)
    return replace(state, inputs=values)


def advance(
    solver: Solver, system: System, state: State, dt: float, workspace: Any, wanted: Mapping[str, NDArray[np.float64]]
) -> tuple[State, StepReport]:
    """A step of the solver in which the scene's inputs go to the values that are `wanted` at its end, by name."""
    inputs = system.scene.inputs
    if not inputs:
        return solver.step(system, state, dt, workspace)
    drive_inputs(inputs, state.inputs, wanted, state.time, state.time + dt)
    after, step = solver.step(system, state, dt, workspace)
    # A solver may stop within the step; the inputs are then where they were at that time.
    return replace(after, inputs={name: given(after.time) for name, given in inputs.items()}), step


def prepared_after_breaks(
    solver: Solver, system: System, state: State, step: StepReport, workspace: Any
) -> tuple[System, State, StepReport, Any]:
    """What a step has led to, with the pairs broken that carry too much, and the workspace for what is left."""
    left, state, step = after_breaks(system, state, step)
    if step.status.can_go_on:
        left, state = with_separated_sides(left, state)
    if left is not system:
        try:
            workspace = solver.prepare(left)
        except SolverError as error:  # nothing holds a body, and its equilibrium is asked for
            step = replace(step, status=Status.LINE_SEARCH_FAILED, message=str(error))
    return left, state, step, workspace


def frames_from(
    first: Frame,
    dt: float,
    steps: int,
    workspace: Any,
    control: Control | None,
    sinks: Sequence[Sink],
    strict: bool,
) -> Frames:
    """The frames of a run from its first one, which has a solver; see `simulate`."""
    system, state, frame, solver = first.system, first.state, first, first.solver
    assert solver is not None
    inputs = system.scene.inputs
    wanted = dict(state.inputs)
    problems = Problems(first.index + steps)
    with ExitStack() as ends:  # ends every sink, also where another sink fails
        if not strict:
            ends.callback(_warn, problems)
        for sink in sinks:
            ends.callback(sink.end)
            sink.begin(first, dt, steps)
        for index in range(first.index + 1, first.index + steps + 1):
            if control is not None:
                wanted |= checked_values(inputs, control(frame))
            began = time.perf_counter()
            state, step = advance(solver, system, state, dt, workspace, wanted)
            system, state, step, workspace = prepared_after_breaks(solver, system, state, step, workspace)
            seconds = time.perf_counter() - began
            report = completed_report(system, state, step, seconds, frame.report.energy)
            frame = Frame(index, state, system, report, step.contacts, solver)
            problems.note(index, frame.time, frame.report.status, frame.report.message)
            for sink in sinks:
                sink.write(frame)
            if strict and problems.latest:
                raise SolverError(f"simulate: {problems.latest}")
            sent = yield frame
            wanted |= checked_values(inputs, sent)
            if not step.status.can_go_on:
                break


def _warn(problems: Problems) -> None:
    """Warn of the problems by the log and by Python's warnings, at the line that asked for the last frame."""
    text = str(problems)
    if not text:
        return
    if logger.hasHandlers():  # a log that nobody has set up would print the same text again
        logger.warning("%s", text)
    caller = sys._getframe()
    while caller.f_back and caller.f_globals.get("__name__", "").partition(".")[0] in ("supple", "contextlib"):
        caller = caller.f_back
    warnings.warn_explicit(text, SuppleWarning, caller.f_code.co_filename, caller.f_lineno)
