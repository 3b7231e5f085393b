"""One substep of XPBD on rows: contact is found at x_n, where nothing crosses, and nothing can cross."""

from __future__ import annotations

from supple.solvers.xpbd.damping.kelvin_voigt import Damping
from supple.solvers.xpbd.frame.substep_limits import move_rigid, restore
from supple.solvers.xpbd.integration import hold, predict, update_velocities
from supple.solvers.xpbd.workspace import XPBDWorkspace
from trials.xpbd_rows.contact import RowContact


def substep(ws: XPBDWorkspace, contact: RowContact, damping: Damping | None, targets, time: float, h: float) -> None:
    """Advance the arrays of the workspace by h [s], to `time` [s].

    Parameters
    ----------
    damping : whose cycle has begun, None where nothing is damped; targets : (k, 3) of the pinned vertices [m]
    """
    x_n, x, v = ws.previous, ws.points, ws.velocities
    contact.begin(time, h)  # lists, and the impulses kept of the substep before
    predict(x, x_n, v, ws.system.gravity, h)
    ws.begun[:] = x_n
    if len(targets):
        hold(x, ws.system.pinned_vertices, targets, ws.origins)
    ws.rigid.follow(x, v)
    ws.anchors.place(ws.extended, ws.origins, time)
    at = ws.substep(time, h)
    ws.loads.add_forces(at)
    if damping is not None:
        damping.push(x, h)
    ws.rigid.gather(x, v, h)
    ws.rigid.advance(x, x_n, v, h)
    for constraints in ws.sets:
        constraints.project(ws.extended, h)
    ws.actuators.project_within(at)
    restore(ws, h)
    ws.loads.pull_to_targets(at)
    ws.loads.pull_springs(at)
    ws.actuators.project_between(at)
    move_rigid(ws, time, h)
    rows = contact.detect()
    contact.solve(rows)
    low = contact.hold_volumes(rows)
    update_velocities(x, x_n, v, h)
    contact.keep(rows)
    contact.admit(rows, low)
    ws.actuators.end_substep(at)
    if len(ws.joints):
        ws.joints.end_substep(x, ws.origins, time, h)
