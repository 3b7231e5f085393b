"""One substep of XPBD: contact is found at x_n, where nothing crosses, and nothing can cross.

The numbers of steps and equations are those of docs/theory/xpbd.md and docs/theory/contact.md.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.model.energy_balance import add_works
from supple.solvers.xpbd.damping.kelvin_voigt import Damping
from supple.solvers.xpbd.frame.volumes import hold_volumes, restore
from supple.solvers.xpbd.integration import first_lost, hold, predict
from supple.solvers.xpbd.workspace import XPBDWorkspace


def substep(
    ws: XPBDWorkspace, damping: Damping | None, targets: NDArray[np.float64], end: float, h: float, last: bool
) -> None:
    """Advance the arrays of the workspace by h [s], to the time `end` [s].

    Parameters
    ----------
    damping : whose cycle has begun, None where nothing is damped; targets : (k, 3) of the pinned vertices [m]
    last : whether it is the last one of the frame, in which the stress that sweeps deliver is measured
    """
    x_n, x, v, contact = ws.previous, ws.points, ws.velocities, ws.contact
    ws.time = end
    contact.guard(ws.sound)
    contact.begin(end)  # 1: lists at x_n, impulses that are kept (C5)
    predict(x, x_n, v, ws.system.gravity, h)  # 2
    if len(targets):
        hold(x, ws.system.pinned_vertices, targets, ws.origins)
    ws.rigid.follow(x, v)
    ws.anchors.place(ws.extended, ws.origins, end)
    at = ws.substep(end, h)
    ws.loads.add_forces(at)  # 3
    push(ws, damping, h)  # (X6)
    if last:
        ws.delivered.begin(ws.extended)
    for constraints in ws.sets:  # 4: (X1) to (X4)
        if last:
            ws.stitch_forces.project(constraints, ws.extended, h)
        else:
            constraints.project(ws.extended, h)
    ws.actuators.project_within(at)
    restore(ws, h)  # 5: (X5)
    ws.loads.pull_to_targets(at)  # 6
    ws.loads.pull_springs(at)
    ws.actuators.project_between(at)
    ws.rigid.move(ws.points, ws.previous, ws.velocities, h)
    if first_lost(x, v) >= 0:
        return
    rows = contact.detect()  # 7: (C4)
    if len(ws.joints):
        contact.solve_joined(rows, ws.joints)
    else:
        contact.solve(rows)
    low = hold_volumes(ws, rows, h)  # (X7)
    contact.keep(rows)
    contact.admit(rows, low)  # 8: (C7)
    if len(ws.joints):
        add_works(ws.works.by_name, {"joints": ws.joints.end_substep(x, x_n, h)})
    ws.actuators.end_substep(at)
    forces = [*ws.loads.acting] if damping is None else [*ws.loads.acting, ("damping", *damping.acting)]
    ws.works.end_substep(at, forces, contact, ws.extended, (ws.actuators.add_forces, ws.joints.add_forces))


def push(ws: XPBDWorkspace, damping: Damping | None, h: float) -> None:
    """Apply viscous forces to the prediction."""
    if damping is not None:
        damping.push(ws.points, h)
    welded = ws.rigid.welding.vertices
    internal = (ws.points[welded, :3] - ws.previous[welded]) / h - ws.velocities[welded]
    ws.rigid.move(ws.points, ws.previous, ws.velocities, h)
    if len(welded):
        # Constraints use welded vertices at the places that their bodies will have. Momenta are restored to those
        # without internal forces, of which bodies have their part already.
        ws.velocities[welded] -= internal
