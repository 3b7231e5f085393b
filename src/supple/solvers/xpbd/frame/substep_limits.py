"""The end of a substep: contacts, then volumes and contacts in turn, the last resort, and works."""

from __future__ import annotations

from itertools import chain, repeat

import numpy as np
from numpy.typing import NDArray

from supple.solvers.xpbd.assessment.moment import Substep
from supple.solvers.xpbd.constraints.volume_guard import ENOUGH
from supple.solvers.xpbd.damping.kelvin_voigt import Damping
from supple.solvers.xpbd.integration import to_world, update_velocities
from supple.solvers.xpbd.rigid_fallback import united
from supple.solvers.xpbd.workspace import XPBDWorkspace

# How often tets that are compressed too fast are projected in a substep, in turn with the contacts, before the motion
# of their body is shortened.
MOST_PROJECTIONS = 10
# After how many of these projections contacts of surfaces are searched, which costs about ten times as much.
SEARCH_EACH = 3
# How often joints and contacts are projected in turn in a substep with contact, at most, and below which correction of
# a joint, as a share of its size, they are not projected again. What a heavy body and a joint push at from both sides
# takes as many as the ratio of the masses.
JOINT_PASSES, JOINT_EXACT = 100, 1e-5
# Of the motion of components that have passed through each other in spite of that: the shares that are tried, before
# none is left.
SHARES = (0.5, 0.25, 0.1, 0.01)


def move_rigid(ws: XPBDWorkspace, time: float, h: float) -> None:
    """Move rigid bodies as all impulses of a substep, and their joints, determine."""
    ws.rigid.gather(ws.points, ws.velocities, h)
    ws.rigid.advance(ws.points, ws.previous, ws.velocities, h)
    if not len(ws.joints):
        return
    ws.joints.project(ws.points, ws.previous, ws.velocities, ws.origins, time, h)
    ws.rigid.advance(ws.points, ws.previous, ws.velocities, h)


def hold_in_contact(ws: XPBDWorkspace, time: float, h: float) -> None:
    """Project joints and contacts in turn, where contacts have moved what joints hold."""
    for _ in range(JOINT_PASSES if len(ws.joints) and ws.collisions.contacts else 0):
        moved = ws.joints.project_again(ws.points, ws.previous, ws.velocities, ws.origins, time, h)
        ws.rigid.advance(ws.points, ws.previous, ws.velocities, h)
        if not collide_again(ws, time, h) or moved <= JOINT_EXACT:
            return


def collide(ws: XPBDWorkspace, time: float, h: float) -> bool:
    """Project the contacts of a substep, in the world. Returns False, without effect, where a position is lost."""
    if not _to_world(ws):
        return False
    ws.collisions.project(ws.world, ws.world_previous, time, h)
    _apply(ws, time, h)
    return True


def collide_again(ws: XPBDWorkspace, time: float, h: float) -> bool:
    """`collide` with the contacts of surfaces that were found last."""
    if not _to_world(ws):
        return False
    ws.collisions.project_again(ws.world, ws.world_previous, time, h)
    _apply(ws, time, h)
    return True


def _apply(ws: XPBDWorkspace, time: float, h: float) -> None:
    if ws.collisions.moved:
        ws.apply_changes(h)
    if len(ws.rigid):
        # Contacts turn bodies by small rotations; the turn that follows from their momenta ends a little elsewhere.
        ws.rigid.advance(ws.points, ws.previous, ws.velocities, h)
        if _to_world(ws):
            ws.collisions.check_separated(ws.world, time)


def _to_world(ws: XPBDWorkspace) -> bool:
    to_world(ws.previous, ws.origins, ws.world_previous)
    return to_world(ws.points, ws.origins, ws.world)


def keep_volumes(ws: XPBDWorkspace, time: float, h: float) -> bool:
    """Project tets that lose too much volume, in turn with contacts. Returns whether that was not enough."""
    searched = True  # whether the contacts that were projected last had been searched anew
    for k in range(MOST_PROJECTIONS):
        low = ws.guard.measure(ws.points, ENOUGH if k else 1.0)
        if not low and searched and ws.collisions.separated:
            ws.guard.accept()
            return False
        if low:
            ws.guard.project(ws.points)
            restore(ws, h)
        searched = not low or k % SEARCH_EACH == 0
        if ws.collisions:
            found = collide(ws, time, h) if searched else collide_again(ws, time, h)
            if not found:
                return True
    return _shorten(ws, time, h)


def _shorten(ws: XPBDWorkspace, time: float, h: float) -> bool:
    """Shorten the motion of what has still turned over or passed through something. Returns whether there was any."""
    ws.guard.measure(ws.points)
    failures = ws.guard.failures()
    arrays = (ws.points, ws.velocities, ws.previous, ws.begun, ws.origins, h, ws.guard.bounds, time)
    failed = bool(failures.any())
    if failed:
        ws.fallback.apply(*arrays, [[label] for label in np.unique(ws.fallback.tet_labels[failures])])
    groups: list[set[int]] = []
    stopped = False
    for share in chain(SHARES, repeat(0.0)):
        passed = _passed(ws)
        if not len(passed):
            break
        failed, joined = True, united(groups, passed.tolist())
        if stopped and joined == groups:
            break
        groups, stopped = joined, share == 0.0
        ws.fallback.apply(*arrays, [sorted(group) for group in groups], share)
        ws.rigid.settle(ws.points, ws.velocities)
    ws.guard.measure(ws.points)
    ws.guard.accept()
    return failed


def _passed(ws: XPBDWorkspace) -> NDArray[np.int64]:
    """(k, 2) the components that passed through each other in this substep; see `SurfaceCollisions.passed`."""
    to_world(ws.points, ws.origins, ws.world)
    return ws.collisions.passed(ws.world, ws.fallback.labels)


def restore(ws: XPBDWorkspace, h: float) -> None:
    """The velocities of changed positions, with the momentum of the velocities before; rigid bodies are rigid."""
    if ws.momentum is not None:
        ws.momentum.apply(ws.points, ws.previous, ws.velocities, h)
    ws.rigid.gather(ws.points, ws.velocities, h)
    ws.rigid.advance(ws.points, ws.previous, ws.velocities, h)
    if ws.momentum is None:
        update_velocities(ws.points, ws.previous, ws.velocities, h)


def note_works(ws: XPBDWorkspace, at: Substep, damping: Damping | None) -> None:
    """Add up the works of a substep that has ended."""
    ws.actuators.end_substep(at)
    forces = list(ws.loads.acting)
    if damping is not None:
        forces.append(("damping", *damping.acting))
    ws.works.end_substep(at, forces, ws.collisions.forces, ws.extended, ws.actuators.acting)
