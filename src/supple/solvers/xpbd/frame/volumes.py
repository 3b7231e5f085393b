"""Tets that lose too much volume in a substep are projected in turn with the rows of contact, before `admit`.

The elastic energies of XPBD are finite at J = 0, so that a fast impact can push a tet through zero volume, where its
forces point the wrong way. A projection is a perfectly inelastic collision inside of the body.
"""

from __future__ import annotations

from supple.solvers.xpbd.contact.tets import measure
from supple.solvers.xpbd.integration import update_velocities
from supple.solvers.xpbd.workspace import XPBDWorkspace

# How often tets that lose too much volume are projected in turn with rows, and the share of what the guard asks for
# at which that ends. Tets are cut inside of their body so that they keep the last share.
MOST_PROJECTIONS, ENOUGH, KEEP_INSIDE = 20, 0.7, 0.3
# Of the gap: what a sweep over rows may still change then where some tet has less than this J. More would be put back
# from walls into flat tets, whose motion would be cut.
LEFT, FLAT = 0.25, 0.2


def hold_volumes(ws: XPBDWorkspace, rows: int, h: float) -> int:
    """Project tets; shorten the motions of those that still lose too much volume.

    They are shortened relative to the mean motion of their body, so that nothing stops in the world for it.
    Returns how many tets, listed, have still lost too much.
    """
    contact, tets = ws.contact, ws.contact.tets
    x, x_n = ws.points, ws.previous
    low = measure(contact.nodes.x, tets, True, 1.0)
    if not low:
        return 0
    contact.keep_active(low, LEFT, FLAT, first=True)
    for _ in range(MOST_PROJECTIONS):
        contact.project_low(ws.bounds)
        restore(ws, h)
        contact.sweep(rows)
        low = measure(contact.nodes.x, tets, True, ENOUGH)
        if not contact.keep_active(low, LEFT, FLAT):
            return 0
    low = measure(contact.nodes.x, tets, False, KEEP_INSIDE)
    if not low:
        return 0
    base = contact.nodes.carried()
    for part in ws.system.bodies:
        mine = slice(part.vertices.start, part.vertices.stop)
        free = x[mine, 3] > 0.0
        base[mine][free] += (x[mine, :3] - x_n[mine])[free].mean(axis=0) if free.any() else 0.0
    low = contact.cut_inside(base, low, KEEP_INSIDE)
    restore(ws, h)
    return low


def restore(ws: XPBDWorkspace, h: float) -> None:
    """The velocities of changed positions, with the momentum of the velocities before; rigid bodies are rigid."""
    if ws.momentum is not None:
        ws.momentum.apply(ws.points, ws.previous, ws.velocities, h)
    ws.rigid.move(ws.points, ws.previous, ws.velocities, h)
    if ws.momentum is None:
        update_velocities(ws.points, ws.previous, ws.velocities, h)
