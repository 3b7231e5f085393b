"""XPBD with small steps: n substeps of one Gauss-Seidel sweep each, multipliers starting at 0.

Source: Macklin, Müller, Chentanez, "XPBD" (2016); Macklin et al., "Small Steps in Physics Simulation" (2019).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from time import perf_counter

import numba
import numpy as np
from numba.core import config
from numpy.typing import NDArray

from supple.errors import SolverError
from supple.numerics.interruption import interruption_point
from supple.numerics.thread_tuning import ThreadTuner
from supple.numerics.threads import numba_threads
from supple.state import State, Status, StepReport
from supple.system import Solver, System
from supple.xpbd.constraints.registry import ConstraintSet, build_constraint_sets
from supple.xpbd.constraints.stitch_anchors import StitchAnchors
from supple.xpbd.constraints.stitches import stitch_constraints
from supple.xpbd.contact.collisions import Collisions
from supple.xpbd.contact.memory import ContactMemory
from supple.xpbd.contact.settings import XPBDContact
from supple.xpbd.details import XPBDDetails
from supple.xpbd.external_forces import add_forces, pull_to_targets
from supple.xpbd.integration import (
    accelerate,
    apply_changes,
    first_lost,
    hold,
    origins_of_components,
    predict,
    to_world,
    update_velocities,
)
from supple.xpbd.momentum import MomentumRestore
from supple.xpbd.sweeps.ordering import Layout, make_layout, reordered

# Below this much work, in edges or volumes, a sweep ends before a second thread has started.
PARALLEL_FROM = 20_000
_MOST_THREADS: int = config.NUMBA_NUM_THREADS  # pyright: ignore[reportAttributeAccessIssue]


@dataclass(eq=False)
class XPBDWorkspace:
    """What is computed once for a system, and scratch arrays, in the solver's own numbering of vertices.

    It caches and never remembers: a step reads nothing of an earlier step but the state.

    Attributes
    ----------
    extended : (n + a, 4) positions about the component's origin [m] and inverse masses [1/kg], of the vertices and then
        of the anchors (inverse mass 0); extended_previous : (n + a, 3) positions at the beginning of the substep
    points, previous : the rows of the vertices
    velocities, origins : (n, 3); world, world_previous : (n, 3) positions in world coordinates, for contacts
    threads : that Numba may use; None for all
    """

    system: System
    layout: Layout
    sets: list[ConstraintSet]
    momentum: MomentumRestore | None
    collisions: Collisions
    threads: int | None
    pace: ThreadTuner
    anchors: StitchAnchors
    extended: NDArray[np.float64]
    extended_previous: NDArray[np.float64] = field(init=False)
    points: NDArray[np.float64] = field(init=False)
    previous: NDArray[np.float64] = field(init=False)
    velocities: NDArray[np.float64] = field(init=False)
    origins: NDArray[np.float64] = field(init=False)
    world: NDArray[np.float64] = field(init=False)
    world_previous: NDArray[np.float64] = field(init=False)

    def __post_init__(self) -> None:
        n = len(self.system.masses)
        self.extended_previous = np.zeros((len(self.extended), 3))
        self.points, self.previous = self.extended[:n], self.extended_previous[:n]
        for name in ("velocities", "origins", "world", "world_previous"):
            setattr(self, name, np.zeros((n, 3)))


@dataclass(frozen=True)
class XPBD(Solver):
    """Extended position-based dynamics: fast, robust and approximate. The error decreases with more substeps.

    Parameters
    ----------
    substeps : number of substeps of a frame, each with one sweep over all constraints.
    momentum_restore : restore the momentum that constraint projection takes from free bodies (see
        `supple.xpbd.momentum`). False shows the behaviour of plain XPBD.
    contact : contact of bodies with each other and with themselves; None turns it off. Obstacles always act.
    threads : number of threads. None: one, or all of Numba's where the scene is large enough and several threads are
        measured to be faster. The result has the same bits for any number.

    Raises
    ------
    SolverError : where a value is of the wrong kind or out of range.
    """

    substeps: int = 20
    momentum_restore: bool = True
    contact: XPBDContact | None = field(default_factory=XPBDContact)
    threads: int | None = None

    def __post_init__(self) -> None:
        _check_count("substeps", self.substeps)
        if not isinstance(self.momentum_restore, bool):
            raise SolverError(f"XPBD: momentum_restore is {self.momentum_restore!r}; give True or False")
        if self.contact is not None and not isinstance(self.contact, XPBDContact):
            raise SolverError(f"XPBD: contact is {self.contact!r}; give XPBDContact(...), or None to turn it off")
        if self.threads is not None:
            _check_count("threads", self.threads)
            if self.threads > _MOST_THREADS:
                raise SolverError(
                    f"XPBD: threads is {self.threads}; this process has {_MOST_THREADS}"
                    " (set NUMBA_NUM_THREADS before it starts for more)"
                )

    def prepare(self, system: System) -> XPBDWorkspace:
        """Number the vertices, sort the constraints into chunks, and compute their constants.

        Raises
        ------
        SolverError : where a body's material has no XPBD constraints; the text names the body.
        """
        layout = make_layout(system)
        inner = reordered(system, layout)
        extended = np.zeros((len(system.masses) + len(inner.stitching.anchors), 4))
        extended[: len(system.masses), 3] = inner.inverse_masses
        sets = [*build_constraint_sets(inner, layout), *stitch_constraints(inner, extended[:, 3])]
        threads = self.threads or numba.get_num_threads()
        large = sum(made.work for made in sets) >= PARALLEL_FROM
        parallel = threads > 1 and (large or self.threads is not None)
        return XPBDWorkspace(
            system=inner,
            layout=layout,
            sets=sets,
            momentum=MomentumRestore(inner) if self.momentum_restore else None,
            collisions=Collisions(inner, self.contact),
            threads=self.threads or (None if large else 1),
            pace=ThreadTuner(choice=parallel and self.threads is None, parallel=parallel),
            anchors=StitchAnchors(inner),
            extended=extended,
        )

    def step(self, system: System, state: State, dt: float, workspace: XPBDWorkspace) -> tuple[State, StepReport]:
        """Advance by `dt` [s] in `substeps` substeps. The returned state has its own arrays."""
        with numba_threads(workspace.threads):
            return self._step(state, dt, workspace)

    def _step(self, state: State, dt: float, ws: XPBDWorkspace) -> tuple[State, StepReport]:
        h = dt / self.substeps
        _load(ws, state)
        targets = _pin_targets(ws.system, state.time, h, self.substeps)
        if ws.collisions:
            memory = state.memory if isinstance(state.memory, ContactMemory) else None
            ws.collisions.begin_step(ws.world, ws.velocities, state.time, dt, memory)
        for k in range(self.substeps):
            interruption_point()
            started = perf_counter()
            parallel = ws.pace.choose()
            end = state.time + (k + 1) * h
            _begin_substep(ws, targets[k], end, h, parallel)
            add_forces(ws.system, ws.points, ws.velocities, end, h)
            for constraints in ws.sets:
                constraints.project(ws.extended, h, parallel)
            if ws.momentum is not None:
                ws.momentum.apply(ws.points, ws.previous, ws.velocities, h, parallel)
            else:
                update_velocities(ws.points, ws.previous, ws.velocities, h)
            ws.pace.note(parallel, perf_counter() - started)
            pull_to_targets(ws.system, ws.points, ws.velocities, ws.origins, end, h)
            if ws.collisions and not _collide(ws, end, h):
                break
        lost = first_lost(ws.points, ws.velocities)
        if lost >= 0:
            message = _lost_position_message(ws, lost, state.time + dt)
            return state, StepReport(Status.NOT_FINITE, self.substeps, message, details=XPBDDetails())
        details = XPBDDetails(ws.collisions.contacts, ws.collisions.smallest_gap)
        return _unload(ws, state.time + dt), StepReport(Status.CONVERGED, self.substeps, details=details)

    def initial_details(self, system: System, workspace: XPBDWorkspace) -> XPBDDetails:
        """No contacts; see `Solver.initial_details`."""
        return XPBDDetails()


def _check_count(name: str, value: object) -> None:
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < 1:
        raise SolverError(f"XPBD: {name} is {value!r}; give a whole number of one or more")


def _load(ws: XPBDWorkspace, state: State) -> None:
    old = ws.layout.old_from_new
    np.take(state.positions, old, axis=0, out=ws.world)
    np.take(state.velocities, old, axis=0, out=ws.velocities)
    origins_of_components(ws.world, ws.system.joined_components, ws.origins)
    np.subtract(ws.world, ws.origins, out=ws.points[:, :3])
    ws.anchors.place(ws.extended, ws.origins, state.time)


def _begin_substep(ws: XPBDWorkspace, targets: NDArray[np.float64], end: float, h: float, parallel: bool) -> None:
    """Predict positions, with pinned vertices at `targets` (k, 3), and apply damping.

    Damping acts before gravity, forces and constraints, on the velocities at the beginning of the substep only. Later
    in the substep it would reduce the load of a resting body, or undo corrections of neighbouring constraints.
    """
    damped = [constraints for constraints in ws.sets if constraints.damped]
    gravity = ws.system.gravity
    predict[parallel](ws.points, ws.previous, ws.velocities, np.zeros(3) if damped else gravity, h)
    if len(targets):
        hold(ws.points, ws.system.pinned_vertices, targets, ws.origins)
    ws.extended_previous[len(ws.points) :] = ws.extended[len(ws.points) :, :3]
    ws.anchors.place(ws.extended, ws.origins, end)
    for constraints in damped:
        constraints.damp(ws.extended, ws.extended_previous, h, parallel)
    if damped:
        accelerate(ws.points, ws.velocities, gravity, h)


def _collide(ws: XPBDWorkspace, time: float, h: float) -> bool:
    """Project the contacts of a substep, in the world. Returns False, without effect, where a position is lost."""
    if not to_world(ws.points, ws.origins, ws.world):
        return False
    to_world(ws.previous, ws.origins, ws.world_previous)
    ws.collisions.project(ws.world, ws.world_previous, time, h)
    apply_changes(ws.points, ws.velocities, h, ws.origins, ws.previous, ws.world, ws.world_previous)
    return True


def _unload(ws: XPBDWorkspace, time: float) -> State:
    to_world(ws.points, ws.origins, ws.world)
    new = ws.layout.new_from_old
    return State(time, ws.world[new], ws.velocities[new], ws.collisions.memory(ws.world))


def _pin_targets(system: System, time: float, h: float, substeps: int) -> NDArray[np.float64]:
    """(substeps, k, 3) positions of the pinned vertices at the end of each substep [m]."""
    if all(pin.pin.motion is None for pin in system.pins):
        return np.repeat(system.pin_targets(time)[None], substeps, axis=0)
    return np.stack([system.pin_targets(time + (k + 1) * h) for k in range(substeps)])


def _lost_position_message(ws: XPBDWorkspace, vertex: int, time: float) -> str:
    part = next(p for p in ws.system.bodies if p.vertices.start <= vertex < p.vertices.stop)
    number = int(ws.layout.old_from_new[vertex]) - part.vertices.start
    return (
        f"XPBD: body {part.name!r}, vertex {number}: its position is lost (not finite, or beyond 1e12 m) "
        f"at t = {time:g} s; take more substeps or a shorter dt"
    )
