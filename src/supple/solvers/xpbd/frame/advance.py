"""The substeps of a frame."""

from __future__ import annotations

from itertools import accumulate

import numpy as np
from numpy.typing import NDArray

from supple.model.energy_balance import add_works
from supple.model.state import State
from supple.model.system import System
from supple.solvers.xpbd.assessment.surfaces import Overlap
from supple.solvers.xpbd.damping.kelvin_voigt import Damping, cycle_lengths
from supple.solvers.xpbd.frame.substep_limits import (
    collide,
    hold_in_contact,
    keep_volumes,
    move_rigid,
    note_works,
    restore,
)
from supple.solvers.xpbd.integration import hold, origins_of_components, predict, to_world
from supple.solvers.xpbd.memory import XPBDMemory
from supple.solvers.xpbd.sleep import SleepMemory
from supple.solvers.xpbd.workspace import XPBDWorkspace


def load(ws: XPBDWorkspace, state: State) -> None:
    """Copy a state into the arrays of the workspace."""
    ws.time, old = state.time, ws.layout.old_from_new
    np.take(state.positions, old, axis=0, out=ws.world)
    np.take(state.velocities, old, axis=0, out=ws.velocities)
    ws.rigid.place(ws.world)
    origins_of_components(ws.world, ws.system.joined_components, ws.origins)
    np.subtract(ws.world, ws.origins, out=ws.points[:, :3])
    ws.anchors.place(ws.extended, ws.origins, state.time)
    ws.grow(state.time)


def cycles(substeps: int) -> dict[int, int]:
    """The first substep of each cycle of damping, and the cycle's length."""
    lengths = cycle_lengths(substeps)
    return dict(zip(accumulate(lengths, initial=0), lengths, strict=False))


def grow(ws: XPBDWorkspace, end: float) -> None:
    """Take the stress-free shapes of the end of a substep [s]."""
    work = ws.grow(end)
    if work:
        add_works(ws.works.by_name, {"growth": work})


def begin_substep(ws: XPBDWorkspace, targets: NDArray[np.float64], end: float, h: float) -> None:
    """Predict positions, with pinned vertices at `targets` (k, 3)."""
    ws.time = end
    predict(ws.points, ws.previous, ws.velocities, ws.system.gravity, h)
    ws.begun[:] = ws.previous
    if len(targets):
        hold(ws.points, ws.system.pinned_vertices, targets, ws.origins)
    ws.rigid.follow(ws.points, ws.velocities)
    ws.works.begin_substep(ws.extended)
    ws.anchors.place(ws.extended, ws.origins, end)


def push(ws: XPBDWorkspace, damping: Damping | None, h: float) -> None:
    """Apply viscous forces, and the contact forces of the substep before, to the prediction."""
    if damping is not None:
        damping.push(ws.points, h)
    welded = ws.rigid.welding.vertices
    internal = (ws.points[welded, :3] - ws.previous[welded]) / h - ws.velocities[welded]
    ws.rigid.gather(ws.points, ws.velocities, h)
    if ws.collisions and to_world(ws.points, ws.origins, ws.world):
        to_world(ws.previous, ws.origins, ws.world_previous)
        if ws.collisions.begin_substep(ws.world, ws.world_previous, h):
            ws.apply_changes(h)
    if len(welded):
        # Constraints see welded vertices where their bodies are to be. Momenta are restored to those without internal
        # forces, of which bodies have their part already.
        ws.rigid.advance(ws.points, ws.previous, ws.velocities, h)
        ws.velocities[welded] -= internal


def pin_targets(system: System, time: float, h: float, substeps: int) -> NDArray[np.float64]:
    """(substeps, k, 3) positions of the pinned vertices at the end of each substep [m]."""
    if all(pin.pin.motion is None for pin in system.pins):
        return np.repeat(system.pin_targets(time)[None], substeps, axis=0)
    return np.stack([system.pin_targets(time + (k + 1) * h) for k in range(substeps)])


def advance(
    ws: XPBDWorkspace,
    state: State,
    dt: float,
    substeps: int,
    memory: XPBDMemory,
    overlaps: list[Overlap],
    sleep: SleepMemory,
) -> int:
    """Simulate the substeps of a frame from a state; returns in how many the motion of a body was shortened."""
    h, held_back = dt / substeps, 0
    load(ws, state)
    ws.set_asleep(sleep.asleep)
    targets = pin_targets(ws.system, state.time, h, substeps)
    collides = bool(ws.collisions)
    if collides:
        crossing = [each.numbers for each in overlaps if each.pairs]
        ws.collisions.begin_step(ws.world, ws.velocities, state.time, dt, memory.contact, crossing, sleep.asleep)
        ws.collisions.forces.keep_standing((sleep.contacts, sleep.loads), sleep.asleep)
    ws.guard.measure(ws.points)
    ws.guard.guarded[:] = ws.assessment.begin(ws.moment(state.time), ws.guard.J, h, memory.ledger)
    ws.guard.accept()
    ws.begin_frame(state.time, h)
    ws.joints.begin_frame(state, sleep.asleep)
    damping, lengths = damping_in(ws, h), cycles(substeps)
    if damping is not None:
        damping.begin_step(memory.viscous, state.velocities)
    for k in ws.pace.tasks(0 if sleep.asleep.all() else substeps, ws.most_threads):
        end = state.time + (k + 1) * h
        if damping is not None and k in lengths:
            moving = ws.anchors.velocities(end - h, h)
            damping.begin_cycle(ws.extended, ws.velocities, moving, lengths[k], h)
        grow(ws, end)
        begin_substep(ws, targets[k], end, h)
        at = ws.substep(end, h)
        ws.loads.add_forces(at)
        push(ws, damping, h)
        if k == substeps - 1:
            ws.delivered.begin(ws.extended)
        for constraints in ws.sets:
            constraints.project(ws.extended, h)
        ws.actuators.project_within(at)
        restore(ws, h)
        ws.loads.pull_to_targets(at)
        ws.loads.pull_springs(at)
        ws.actuators.project_between(at)
        move_rigid(ws, end, h)
        if collides and not collide(ws, end, h):
            break
        hold_in_contact(ws, end, h)
        held_back += keep_volumes(ws, end, h)
        if collides:
            ws.collisions.end_substep()
        if len(ws.joints):
            add_works(ws.works.by_name, {"joints": ws.joints.end_substep(ws.points, ws.origins, end, h)})
        note_works(ws, at, damping)
    return held_back


def damping_in(ws: XPBDWorkspace, h: float) -> Damping | None:
    """Damping in substeps of h [s]; None where XPBD itself damps as much, which is like tau = h."""
    return ws.damping if ws.damping is not None and ws.damping.tau > h else None


def overlaps_of(ws: XPBDWorkspace, time: float, sleep: SleepMemory) -> list[Overlap]:
    """What is through what at the world positions of the workspace."""
    return ws.assessment.overlaps(ws.world, time, sleep.asleep) if ws.collisions else []


def disturbed_bodies(ws: XPBDWorkspace, time: float, sleep: SleepMemory) -> NDArray[np.bool_]:
    """(b,) the sleeping bodies that something awake pushed, or is through, at the end of a frame."""
    if not sleep.asleep.any() or sleep.asleep.all():
        return np.zeros(len(sleep.islands), dtype=np.bool_)
    to_world(ws.points, ws.origins, ws.world)
    crossing = np.array([overlap.numbers for overlap in overlaps_of(ws, time, sleep)], dtype=np.int64).reshape(-1, 2)
    return ws.sleep.disturbed(sleep, np.concatenate([ws.collisions.forces.pairs(), crossing]))
