"""The stages of a substep, compiled: contact is found at x_n, where nothing crosses, and nothing can cross.

The numbers of steps and equations are those of docs/theory/xpbd.md and docs/theory/contact.md. Which stages are
compiled depends on whether anything is rigid, and may touch.
"""

from __future__ import annotations

import math
from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple, cast

from supple.runtime.kernel_cache import kernel_with, njit
from supple.solvers.xpbd.contact.admit import KEEP_J, admit, part
from supple.solvers.xpbd.contact.bodies import describe, place_nodes, take_twists
from supple.solvers.xpbd.contact.cuts import keep_spin
from supple.solvers.xpbd.contact.frame_forces import add_loaded, works_of
from supple.solvers.xpbd.contact.islands import find_islands
from supple.solvers.xpbd.contact.levers import hold_bodies
from supple.solvers.xpbd.contact.rows import detect
from supple.solvers.xpbd.contact.search.expected import largest_deviation
from supple.solvers.xpbd.contact.search.lists import choose_near, choose_of
from supple.solvers.xpbd.contact.solve import keep_impulses, push_kept, solve
from supple.solvers.xpbd.integration import hold, predict
from supple.solvers.xpbd.record import (
    CONTACT_WORK,
    CUT,
    CUTS,
    FOUND,
    FRICTION_WORK,
    LATEST,
    LEFT,
    LOADED,
    LOGGED,
    LOW,
    MOVED,
    NEAR,
    RESIDUAL,
    ROWS,
    SMALLEST,
    SWEEPS,
    UNNAMED_WORK,
)
from supple.solvers.xpbd.rigid.bodies import follow_welds
from supple.solvers.xpbd.rigid.motion import advance, spin_of

# The most sweeps over rows; and in islands with rigid bodies, which nothing else corrects. In a heap of 200 boxes
# neither 10 nor 60 sweeps are enough; impulses that are kept go on with them.
MOST_SWEEPS, MOST_RIGID_SWEEPS = 4, 10
# Rows are solved again with bodies where they are while these turn by more than this [rad], at most so often.
MOST_TURNS, SMALL_TURN = 4, 2e-3
# Of the gap: cuts that do not count.
HARMLESS = 0.5
# Tets that still lose too much volume after the projections are cut inside of their body, so that they keep this share.
KEEP_INSIDE = 0.3
# See `detect`.
ONLY_MEETING = -1.0

if TYPE_CHECKING:  # `stages` gives these names to each copy of the functions below
    TOUCHES = True
    begin_rigid = bend_rigid = move_rigid = follow_rigid = cast(Any, None)


def _nothing(nodes, rigid, h):
    """Of a scene without rigid bodies."""


def _begin_rigid(nodes, rigid, h):
    """Describe rigid bodies where the substep begins."""
    place_nodes(nodes.v, rigid.first, rigid.points, rigid.weights)
    describe(nodes.x, nodes.begin, rigid.control, rigid.masses, rigid.movers.bodies)


def _follow_rigid(nodes, rigid, h):
    """Put what is welded to rigid bodies where they are."""
    follow_welds(rigid.welds, nodes.x, nodes.v)


def _moved_rigid(record, h):
    """See `_move_rigid`."""
    move_rigid(record.nodes, record.rigid, h)


def _move_rigid(nodes, rigid, h):
    """Move rigid bodies as their momenta and twists determine, and what is fixed to them."""
    take_twists(nodes.v, rigid.control, rigid.movers.bodies, h)
    advance(nodes.x, nodes.begin, nodes.v, rigid.control, h)
    follow_rigid(nodes, rigid, h)
    place_nodes(nodes.x, rigid.first, rigid.points, rigid.weights)


def _bend_rigid(nodes, rigid, h):
    """Set how far the ways of nodes in h [s] are from straight ones, as bodies turn."""
    bodies = rigid.movers.bodies
    place_nodes(nodes.x, rigid.first, rigid.points, rigid.weights)
    for b in range(len(rigid.control)):
        turn = min(h * spin_of(nodes.begin, nodes.v, rigid.control, b), math.pi)
        f = 1.0 - math.cos(0.5 * turn)
        for k in range(rigid.movers.nodes.start[b], rigid.movers.nodes.start[b + 1]):
            i = rigid.movers.nodes.items[k]
            r = bodies.arms[i]
            bodies.bends[i] = f * math.sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2])


def _begin(record, h):
    """1: x_n, and which volumes are kept."""
    nodes, tets, rigid = record.nodes, record.tets, record.rigid
    x, begin, impulses, J, now, sound = nodes.x, nodes.begin, nodes.impulses, tets.tets.J, tets.tets.now, tets.sound
    for i in range(len(x)):
        for j in range(3):
            begin[i, j] = x[i, j]
    for i in range(len(impulses)):
        for j in range(3):
            impulses[i, j] = 0.0
    for t in range(len(sound)):
        J[t] = now[t] if sound[t] else -1.0
    begin_rigid(nodes, rigid, h)


def _predict(record, k, h):
    """1: the near pairs at x_n, and the impulses that contacts kept (C5); 2: prediction."""
    nodes, pins, rigid, surface, touching, lists, counts = (
        record.nodes,
        record.pins,
        record.rigid,
        record.surface,
        record.touching,
        record.lists,
        record.counts,
    )
    x, begin, v, impulses, before = nodes.x, nodes.begin, nodes.v, nodes.impulses, nodes.before
    if TOUCHES:
        wide, asked = lists.wide.clock, (lists.deviations, lists.margins, surface.surface, h)
        given = lists.tight, wide[1] - wide[0], begin, v, touching.pairs, counts[FOUND] > 0
        found = choose_near(*given, *asked, nodes.far, nodes.expected, touching.near)
        counts[FOUND] = False
        if found >= 0:
            counts[NEAR] = found
        for i in range(len(v)):
            for j in range(3):
                before[i, j] = v[i, j]
        if counts[LOADED]:
            near, bodies = touching.near[: counts[NEAR]], rigid.movers.bodies
            push_kept(x, begin, bodies, v, near, touching.pairs, touching.walls, surface.faces, h)
            take_twists(v, rigid.control, bodies, h)
            for i in range(len(impulses)):
                for j in range(3):
                    impulses[i, j] += v[i, j] - before[i, j]
    predict(x, begin, v, nodes.gravity, h, len(impulses))
    if len(pins.pinned):
        hold(x, pins.pinned, pins.targets[k], nodes.origins)
    follow_rigid(nodes, rigid, h)


def _detect(record, h, again):
    """7: the rows (C4); or, once more, those of pairs of nodes that are `far` from where they were expected."""
    nodes, rigid, surface, touching = record.nodes, record.rigid, record.surface, record.touching
    rows, counts, values, slack, first = record.solving.rows, record.counts, record.values, ONLY_MEETING, 0
    x, expected, far, chosen = nodes.x, nodes.expected, nodes.far, touching.chosen
    if again:
        first = counts[ROWS]
    else:
        slack = record.numbers.slack
        bend_rigid(nodes, rigid, h)
        for i in range(len(x)):
            far[i] = True
            for j in range(3):
                expected[i, j] = x[i, j]
        for k in range(len(chosen)):
            chosen[k] = False
    listed = touching.near[: counts[NEAR]], touching.pairs, touching.walls
    whole = nodes.begin, x, rigid.movers.bodies, surface.faces, surface.first_of
    counts[ROWS] = detect(*whole, *listed, slack, chosen, far, first, rows)
    if not again:
        for e in range(counts[ROWS]):
            values[SMALLEST] = min(values[SMALLEST], rows.distances[e] - rows.offsets[e])


def _solve_rows(record, h, most, most_rigid, anew):
    """7: sweep over the rows of active islands, and give velocities the changes of places; see `solve`.

    anew : whether islands are found, which are all active then
    """
    nodes, rigid, solving, numbers = record.nodes, record.rigid, record.solving, record.numbers
    counts, values = record.counts, record.values
    if anew:
        find_islands(nodes.x, solving.rows, counts[ROWS], solving.islands)
    x, v, impulses, swept, rows, count = nodes.x, nodes.v, nodes.impulses, nodes.swept, solving.rows, counts[ROWS]
    bodies, control, earlier, islands = rigid.movers.bodies, rigid.control, rigid.before, solving.islands
    values[LEFT] = 0.0
    if not count:
        for p in range(len(islands.residual)):
            islands.residual[p] = 0.0
        return
    twists = bodies.twists
    for _ in range(MOST_TURNS):
        hold_bodies(x, bodies, rows, count)
        for i in range(len(impulses)):
            for j in range(3):
                swept[i, j] = x[i, j]
        tolerances, limits = numbers.tolerances, (most, most_rigid)
        counts[SWEEPS], left = solve(x, bodies, nodes.begin, rows, count, islands, tolerances, limits)
        values[LEFT] = left
        turn = 0.0
        for b in range(len(twists)):
            turn = max(turn, twists[b, 3] ** 2 + twists[b, 4] ** 2 + twists[b, 5] ** 2)
        for i in range(len(impulses)):
            for j in range(3):
                change = (x[i, j] - swept[i, j]) / h
                v[i, j] += change
                impulses[i, j] += change
        for b in range(len(twists)):
            for c in range(4):
                for j in range(3):
                    earlier[b, c, j] = v[control[b, c], j]
        move_rigid(nodes, rigid, h)
        for b in range(len(twists)):
            for c in range(4):
                i = control[b, c]
                for j in range(3):
                    impulses[i, j] += v[i, j] - earlier[b, c, j]
        if not turn > SMALL_TURN**2:
            break


def _cut(record, low, moved):
    """8: shorten motions from x_n, or from where kinematic nodes carry it, until the guarantee holds (C7).

    low, moved : numbers of tets and nodes, as listed
    """
    nodes, solving, counts = record.nodes, record.solving, record.counts
    x, begin, base = nodes.x, nodes.begin, nodes.base
    counts[CUT] = 0
    if counts[ROWS] or low or moved:
        for i in range(len(x)):
            for j in range(3):
                base[i, j] = x[i, j] if x[i, 3] == 0.0 else begin[i, j]
        guarded = solving.rows, counts[ROWS], record.tets.tets, low, moved, KEEP_J, solving.marks, solving.cuts
        counts[CUT] = admit(base, x, record.rigid.movers, *guarded)[0]


def _finish(record, h):
    """7: note forces, keep impulses; 8: part what penetrates. Returns whether pairs that were left out may matter."""
    nodes, rigid, surface, touching = record.nodes, record.rigid, record.surface, record.touching
    solving, numbers, counts, values = record.solving, record.numbers, record.counts, record.values
    x, v, expected, far, saved, found = nodes.x, nodes.v, nodes.expected, nodes.far, nodes.swept, False
    rows, pairs, count = solving.rows, touching.pairs, counts[ROWS]
    solving.marks.longest[0] = 0.0
    counts[LATEST], counts[MOVED] = counts[LOGGED], 0
    if TOUCHES:
        values[RESIDUAL] = max(values[RESIDUAL], values[LEFT])
        counts[LOADED] = count > 0
        if count:
            owners = surface.owner, touching.shape_owners, surface.origin, h
            counts[LOGGED] = add_loaded(rows, count, pairs, *owners, solving.log, counts[LOGGED])
            keep_impulses(rows, count, nodes.before, h, surface.rates, touching.near[: counts[NEAR]], pairs)
            counts[MOVED] = part(x, rigid.movers, rigid.loose, pairs, rows, count, numbers.recovered, solving.marks)
        most = 0.5 * numbers.slack
        for i in range(len(expected)):
            a, b, c = x[i, 0] - expected[i, 0], x[i, 1] - expected[i, 1], x[i, 2] - expected[i, 2]
            far[i] = not a * a + b * b + c * c <= most * most
            found = found or far[i]
    # Of what is cut next, and of what Python gives back then.
    for i in range(len(saved)):
        for j in range(3):
            saved[i, j] = v[i, j]
    return found


def _are_covered(record, h):
    """Whether the lists hold for the motion of the substep, which ends."""
    nodes, lists, surface = record.nodes, record.lists, record.surface
    x, wide, tight, off, margins = nodes.x, lists.wide, lists.tight, lists.deviations, lists.margins
    wide.clock[0] += h
    tight.clock[0] += h
    off[0] = largest_deviation(x, wide.x, wide.v, wide.clock[0], surface.surface)
    off[1] = largest_deviation(x, tight.x, tight.v, tight.clock[0], surface.surface)
    return off[0] <= margins[0] and off[1] <= margins[1]


def _account(record, h):
    """The works of contact, and what the impulses of the substep have over them."""
    nodes, surface, solving, counts, values = record.nodes, record.surface, record.solving, record.counts, record.values
    x, begin, v, impulses, saved, masses = nodes.x, nodes.begin, nodes.v, nodes.impulses, nodes.swept, nodes.masses
    if counts[CUT] or counts[MOVED]:
        keep_spin(begin, x, v, h, *surface.spins)
        for i in range(len(impulses)):
            for j in range(3):
                impulses[i, j] += v[i, j] - saved[i, j]
    counts[CUTS] += math.sqrt(solving.marks.longest[0]) > HARMLESS
    total = 0.0
    for i in range(len(impulses)):
        if x[i, 3] > 0.0:
            for j in range(3):
                total += masses[i] * impulses[i, j] * (x[i, j] - begin[i, j])
    if TOUCHES and counts[LOGGED] > counts[LATEST]:
        latest = counts[LATEST], counts[LOGGED]
        normal, tangential = works_of(solving.log, *latest, surface.of_point, surface.points, x, begin)
        values[CONTACT_WORK] += normal
        values[FRICTION_WORK] += tangential
        values[UNNAMED_WORK] -= normal + tangential
    values[UNNAMED_WORK] += total / h


def _cut_inside(record):
    """Shorten motions from `nodes.base` of the nodes of low tets; see `hold_volumes`."""
    nodes, tets, rigid, solving, counts = record.nodes, record.tets, record.rigid, record.solving, record.counts
    low = solving.rows, 0, tets.tets, counts[LOW], 0, KEEP_INSIDE, solving.marks, solving.cuts
    admit(nodes.base, nodes.x, rigid.movers, *low)


def _choose_again(record):
    """8: the near pairs of nodes that are `far`, after the lists were made again for the motion of the substep."""
    nodes, touching, lists, counts = record.nodes, record.touching, record.lists, record.counts
    chosen = touching.pairs, lists.deviations, lists.margins, nodes.far, nodes.expected, touching.near
    counts[NEAR], counts[FOUND], counts[ROWS] = choose_of(lists.tight, *chosen), False, 0
    for i in range(len(nodes.far)):
        nodes.far[i] = True
    for k in range(len(touching.chosen)):
        touching.chosen[k] = False


class Stages(NamedTuple):
    """The kernels of the stages."""

    begin: Any
    move_rigid: Any
    predict: Any
    detect: Any
    solve_rows: Any
    cut_inside: Any
    finish: Any
    cut: Any
    are_covered: Any
    choose_again: Any
    account: Any


@cache
def stages(rigid: bool, touches: bool) -> Stages:
    """The stages of a scene: whether there are rigid bodies, and things that may touch."""
    name = f"{'rigid' if rigid else 'soft'}_{'touching' if touches else 'apart'}"
    made: dict[str, Any] = {"TOUCHES": touches}
    inner = {
        "follow_rigid": _follow_rigid if rigid else _nothing,
        "begin_rigid": _begin_rigid if rigid else _nothing,
        "bend_rigid": _bend_rigid if rigid else _nothing,
        "move_rigid": _move_rigid if rigid else _nothing,
    }
    for key, function in inner.items():
        made[key] = njit(kernel_with(function, name, **made))
    kernels = (_begin, _moved_rigid, _predict, _detect, _solve_rows, _cut_inside, _finish, _cut)
    last = _are_covered, _choose_again, _account
    return Stages(*(njit(cache=True, rows=0)(kernel_with(kernel, name, **made)) for kernel in (*kernels, *last)))
