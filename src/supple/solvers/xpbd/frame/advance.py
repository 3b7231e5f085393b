"""The substeps of a frame."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.model.energy_balance import add_works
from supple.model.state import State
from supple.solvers.xpbd.assessment.surfaces import Overlap
from supple.solvers.xpbd.damping.kelvin_voigt import Damping
from supple.solvers.xpbd.frame.substep_limits import (
    collide,
    hold_in_contact,
    keep_volumes,
    move_rigid,
    note_works,
    restore,
)
from supple.solvers.xpbd.frame.substep_start import begin_substep, cycles, grow, load, pin_targets, push
from supple.solvers.xpbd.integration import to_world
from supple.solvers.xpbd.memory import XPBDMemory
from supple.solvers.xpbd.sleep import SleepMemory
from supple.solvers.xpbd.workspace import XPBDWorkspace


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
