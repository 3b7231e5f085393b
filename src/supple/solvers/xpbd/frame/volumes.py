"""Tets that lose too much volume in a substep are projected in turn with the rows of contact, before `admit`.

The elastic energies of XPBD are finite at J = 0, so that a fast impact can push a tet through zero volume, where its
forces point the wrong way. A projection is a perfectly inelastic collision inside of the body.
"""

from __future__ import annotations

from supple.solvers.xpbd.contact.admit import KEEP_J
from supple.solvers.xpbd.contact.islands import find_islands, keep_active
from supple.solvers.xpbd.contact.tets import measure, project_low
from supple.solvers.xpbd.integration import update_velocities
from supple.solvers.xpbd.record import LOW, ROWS, Record, SharedRecord
from supple.solvers.xpbd.stages import KEEP_INSIDE, Stages
from supple.solvers.xpbd.workspace import XPBDWorkspace

# How often tets that lose too much volume are projected in turn with rows, and the share of what the guard asks for
# at which that ends.
MOST_PROJECTIONS, ENOUGH = 20, 0.7
# Of the gap: what a sweep over rows may still change then where some tet has less than this J. More would be put back
# from walls into flat tets, whose motion would be cut.
LEFT, FLAT = 0.25, 0.2


def hold_volumes(ws: XPBDWorkspace, record: Record, shared: SharedRecord, h: float, stages: Stages) -> None:
    """Project the tets of a record; shorten the motions of those that still lose too much volume.

    They are shortened relative to the mean motion of their body, so that nothing stops in the world for it. The record
    has then those that have still lost too much.
    """
    tets, islands, counts, nodes = record.tets.tets, record.solving.islands, record.counts, record.nodes
    x, x_n = ws.points, ws.previous
    find_islands(nodes.x, record.solving.rows, counts[ROWS], islands)
    if not counts[ROWS]:
        islands.residual[:] = 0.0
    keep_active(tets, counts[LOW], islands, LEFT, FLAT, True)
    for _ in range(MOST_PROJECTIONS):
        project_low(nodes.x, tets, islands, ws.bounds)
        restore(ws, h)
        if counts[ROWS]:
            stages.solve_rows(shared, h, 1, 1, False)
        counts[LOW] = measure(nodes.x, tets, True, ENOUGH)
        if not keep_active(tets, counts[LOW], islands, LEFT, FLAT, False):
            counts[LOW] = 0
            return
    counts[LOW] = measure(nodes.x, tets, False, KEEP_INSIDE)
    if not counts[LOW]:
        return
    held = nodes.x[:, 3] == 0.0
    nodes.base[:] = nodes.begin
    nodes.base[held] = nodes.x[held, :3]
    for part in ws.system.bodies:
        mine = slice(part.vertices.start, part.vertices.stop)
        free = x[mine, 3] > 0.0
        nodes.base[mine][free] += (x[mine, :3] - x_n[mine])[free].mean(axis=0) if free.any() else 0.0
    stages.cut_inside(shared)
    counts[LOW] = measure(nodes.x, tets, False, KEEP_J)
    restore(ws, h)


def restore(ws: XPBDWorkspace, h: float) -> None:
    """The velocities of changed positions, with the momentum of the velocities before; rigid bodies are rigid."""
    if ws.restores:
        ws.momentum.apply(ws.points, ws.previous, ws.velocities, h)
    ws.rigid.move(ws.points, ws.previous, ws.velocities, h)
    if not ws.restores:
        update_velocities(ws.points, ws.previous, ws.velocities, h, len(ws.points))
