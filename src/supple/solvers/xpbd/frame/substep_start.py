"""A frame's arrays, and the beginning of a substep: prediction, pins, and the contact forces of the substep before."""

from __future__ import annotations

from itertools import accumulate

import numpy as np
from numpy.typing import NDArray

from supple.model.energy_balance import add_works
from supple.model.state import State
from supple.model.system import System
from supple.solvers.xpbd.damping.kelvin_voigt import Damping, cycle_lengths
from supple.solvers.xpbd.integration import hold, origins_of_components, predict, to_world
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
