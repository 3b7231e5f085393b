"""The substeps of a frame."""

from __future__ import annotations

from itertools import accumulate

import numpy as np
from numpy.typing import NDArray

from supple.model.energy_balance import add_works
from supple.model.state import State
from supple.solvers.xpbd.assessment.surfaces import Overlap
from supple.solvers.xpbd.damping.kelvin_voigt import Damping, cycle_lengths
from supple.solvers.xpbd.frame.substep import SubstepRunner
from supple.solvers.xpbd.integration import to_world
from supple.solvers.xpbd.memory import ElementMemory, XPBDMemory
from supple.solvers.xpbd.sleep import SleepMemory
from supple.solvers.xpbd.workspace import XPBDWorkspace

# Of the mean surface edge: how far vertices may be from where they were, so that the forces of the frame before count.
KNOWN = 0.1


def load(ws: XPBDWorkspace, state: State) -> None:
    """Copy a state into the arrays of the workspace."""
    ws.time, old = state.time, ws.layout.old_from_new
    np.take(state.positions, old, axis=0, out=ws.world)
    np.take(state.velocities, old, axis=0, out=ws.velocities)
    ws.rigid.place(ws.world)
    # Whole multiples of 1/1024 m: differences with positions within 8,000 km of it are exact.
    ws.origins[:] = np.round(ws.world.mean(axis=0) * 1024.0) / 1024.0
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


def advance(
    ws: XPBDWorkspace,
    state: State,
    dt: float,
    substeps: int,
    memory: XPBDMemory,
    overlaps: list[Overlap],
    sleep: SleepMemory,
) -> None:
    """Simulate the substeps of a frame from a state."""
    h = dt / substeps
    load(ws, state)
    ws.set_asleep(sleep.asleep)
    crossing = [each.numbers for each in overlaps if each.pairs]
    known = memory.contact
    if known is not None and not known.belongs_to(state.positions, KNOWN * ws.contact.edge_length):
        known = None
    ws.contact.begin_frame(state.time, h, ws.origins[0].copy(), known, crossing, sleep.asleep)
    ws.contact.forces.keep_standing(sleep.contacts, sleep.asleep)
    ws.sound[:] = ws.assessment.begin(ws.moment(state.time), ws.contact.tets.now, h, memory.ledger)
    ws.begin_frame(state.time, h)
    times = state.time + h * np.arange(substeps + 1, dtype=np.float64)
    ws.joints.begin_frame(state, sleep.asleep, ws.origins[0], times)
    stages = ws.element_stages
    known = (memory.elements or ElementMemory(state.positions, ())).of(state.positions, len(stages))
    for stage, values in zip(stages, known, strict=True):
        stage.begin_frame(ws.previous, values)
    damping, lengths = damping_in(ws, h), cycles(substeps)
    if damping is not None:
        damping.begin_step(memory.viscous, state.velocities)
    frame = SubstepRunner(ws, state.time, dt, substeps, damping)
    for k in ws.pace.tasks(0 if sleep.asleep.all() else substeps, ws.most_threads):
        begun = state.time + k * h
        if damping is not None and k in lengths:
            moving = ws.anchors.velocities(begun, h)
            damping.begin_cycle(ws.extended, ws.velocities, moving, lengths[k], h)
        if ws.grows:
            grow(ws, begun + h)
        if not frame.run(k):
            break
    frame.end()


def damping_in(ws: XPBDWorkspace, h: float) -> Damping | None:
    """Damping in substeps of h [s]; None where XPBD itself damps as much, which is like tau = h."""
    return ws.damping if ws.damping is not None and ws.damping.tau > h else None


def overlaps_of(ws: XPBDWorkspace, time: float, sleep: SleepMemory) -> list[Overlap]:
    """The things that penetrate each other at the world positions of the workspace."""
    return ws.assessment.surfaces.find(ws.world, time, sleep.asleep) if ws.contact else []


def overlaps_after(ws: XPBDWorkspace, time: float, sleep: SleepMemory) -> list[Overlap]:
    """The same after the substeps of a frame."""
    find = ws.assessment.surfaces.find_kept_apart if ws.contact.kept_apart else ws.assessment.surfaces.find
    return find(ws.world, time, sleep.asleep)


def disturbed_bodies(ws: XPBDWorkspace, time: float, sleep: SleepMemory) -> NDArray[np.bool_]:
    """(b,) the sleeping bodies that something awake pushed, or is through, at the end of a frame."""
    if not sleep.asleep.any() or sleep.asleep.all():
        return np.zeros(len(sleep.islands), dtype=np.bool_)
    to_world(ws.points, ws.origins, ws.world)
    crossing = np.array([overlap.numbers for overlap in overlaps_after(ws, time, sleep)], dtype=np.int64).reshape(-1, 2)
    return ws.sleep.disturbed(sleep, np.concatenate([ws.contact.forces.pairs(), crossing]))
