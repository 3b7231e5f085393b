"""The Gauss-Seidel sweeps over the rows of contact of a substep; see `contact_rows`."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.numerics.mat3 import dot, row, subtract
from supple.runtime.kernel_cache import njit
from supple.solvers.xpbd.contact.friction import along_surface, friction_total
from supple.solvers.xpbd.contact.impulses import (
    apply_impulse,
    compliance,
    difference,
    relative,
    relative_before,
    shift_both,
    shift_compliance,
)
from supple.solvers.xpbd.contact.response_rates import kept_share
from supple.solvers.xpbd.contact.sweeps.rigid_rows import (
    RIGID_COLUMNS,
    answer_of,
    begin_bodies,
    begin_sweeps,
    join_points,
    place_of_bodies,
    prepare_bodies,
    push_bodies,
    shift_bodies,
    slip_of_bodies,
    softness_along,
)
from supple.solvers.xpbd.contact.sweeps.vertex_rows import (
    VERTEX_COLUMNS,
    begin_vertices,
    prepare_vertices,
    push_vertices,
    slip_of_vertices,
)

# Rows of contact with what remains the same in all passes of a substep, found once.
#
# A row is one line of numbers, which kernels find by columns. Arguments of many arrays, which tell a kernel where
# each of them lies, cost a sweep more than its arithmetic.


# What a unit push changes the relative place by along the normal, and what a unit shift does [1/kg]; the columns of
# `rigid_rows` or `vertex_rows` follow.
TOTAL, YIELD, FIRST = 0, 1, 2
COLUMNS = FIRST + max(RIGID_COLUMNS, VERTEX_COLUMNS)
# In place of the first body: of a row that moves vertices alone, and of one that moves vertices and a rigid body.
VERTICES, BOTH = -2, -3


class PreparedRows(NamedTuple):
    """k rows, as kernels receive them.

    Attributes
    ----------
    bodies : (k, 2) the rigid bodies of each row, -1 for none; VERTICES or BOTH for the first where it moves vertices
    numbers : (k, COLUMNS)
    """

    bodies: NDArray[np.int64]
    numbers: NDArray[np.float64]


@njit(cache=True)
def prepare_rows(chosen, movers, rows):
    """Prepare the chosen rows; see `solve_rows`."""
    count, vertices, weights, normals = len(chosen), rows[0], rows[1], rows[2]
    out = PreparedRows(np.empty((count, 2), dtype=np.int64), np.zeros((count, COLUMNS)))
    bodies, numbers = out
    for k in range(count):
        e = chosen[k]
        numbers[k, TOTAL] = compliance(movers, vertices, weights, e, row(normals, e))
        numbers[k, YIELD] = shift_compliance(movers, vertices, weights, e)
        any_body, any_vertex = False, False
        for i in range(4):
            p = vertices[e, i]
            any_body = any_body or movers.body[p] >= 0
            any_vertex = any_vertex or movers.inverse_masses[p] > 0.0
        mine = numbers[k, FIRST:]
        if not any_body:
            bodies[k, 0] = VERTICES
            prepare_vertices(mine, movers.inverse_masses, vertices[e], weights[e])
        elif any_vertex or not join_points(bodies[k], mine, movers, vertices[e], weights[e]):
            bodies[k, 0] = BOTH
        else:
            prepare_bodies(bodies[k], mine, movers.w, movers.J)
    return out


# Of the gap that is kept: an overlap of this size remains where a body is rigid. A shift that removes it lifts the body
# off its other contacts, onto which it falls in the next substep, so that nothing would come to rest.
REMAINS = 0.3


@njit(cache=True)
def solve_rows(x, x_prev, predicted, begun, movers, chosen, rows, prepared, h, limit, sweeps, depth):
    """Sweep over the chosen rows, in place.

    Returns how many push, the smallest gap before the substep (or inf), and the largest change of a gap between rigid
    bodies in the first sweep [m].

    An overlap that existed when the substep began is removed at both ends of the substep alike, by at most `limit`;
    what such shifts have brought nearer than it was, at once. The impulse only prevents the gap from becoming smaller
    than it was then (pre-stabilization: Macklin et al., "Unified Particle Physics", 2014, section 4.4).

    Parameters
    ----------
    x, x_prev : (n, 3) at the end and at the beginning of the substep [m]; x includes the forces' impulses
    predicted : (n, 3) the prediction, before forces and constraints [m]
    begun : (n, 3) `x_prev` without the shifts of this substep [m]
    movers : of the points, see `Movers`; they have no twists yet
    chosen : (c,) rows, in the order of a sweep; prepared : see `prepare_rows`
    rows : `ContactRows.described`; forces are those that x contains
    h : length of the substep [s]
    limit : the largest part of an old overlap that one substep removes [m]
    sweeps : number of sweeps
    depth : (n,) how deep points are inside other pieces afterwards, where that is more than it is [m]
    """
    vertices, weights, normals, offsets, friction, forces, _, _, _ = rows
    h2 = h * h
    smallest = _remove_overlaps(x, x_prev, predicted, begun, movers, chosen, rows, prepared, limit)
    count, (bodies, numbers) = len(chosen), prepared
    # How much larger than its offset each gap was before the substep [m].
    gaps, pushes, holds = np.empty(count), np.empty(count), np.empty((count, 3))
    for k in range(count):
        e, mine = chosen[k], numbers[k, FIRST:]
        n, force = row(normals, e), row(forces, e)
        along = dot(force, n)
        pushes[k] = max(0.0, h2 * along)
        for j in range(3):
            holds[k, j] = h2 * (force[j] - along * n[j])
        if bodies[k, 0] == VERTICES:
            before = begin_vertices(mine, x_prev, vertices[e], weights[e])
        elif bodies[k, 0] == BOTH:
            before = relative_before(x_prev, movers, vertices, weights, e)
        else:
            before = place_of_bodies(bodies[k], mine, movers.twists)
            begin_sweeps(bodies[k], mine, x, before, movers.J, vertices[e], weights[e], n)
        gaps[k] = dot(before, n) - offsets[e]
    largest = 0.0
    for sweep in range(sweeps):
        for k in range(count):
            e, push, total = chosen[k], pushes[k], numbers[k, TOTAL]
            if not total > 0.0:
                continue
            n, gap, mine = row(normals, e), gaps[k], numbers[k, FIRST:]
            if bodies[k, 0] == VERTICES:
                _solve_vertices(mine, k, x, vertices[e], weights[e], n, total, gap, friction[e], pushes, holds)
            elif bodies[k, 0] == BOTH:
                places = (x, x_prev, movers, vertices, weights)
                _solve_both(places, e, k, n, total, offsets[e], gap, friction[e], pushes, holds)
            else:
                moved = (movers.twists, movers.J)
                _solve_rigid(bodies[k], mine, k, moved, n, total, gap, friction[e], pushes, holds)
                if sweep == 0:
                    largest = max(largest, abs(pushes[k] - push) * total)
    contacts = 0
    for k in range(count):
        e = chosen[k]
        contacts += pushes[k] > 0.0
        for j in range(3):
            forces[e, j] = (pushes[k] * normals[e, j] + holds[k, j]) / h2
    _note_depths(x, movers, chosen, rows, depth)
    return contacts, smallest, largest


@njit
def _note_depths(x, movers, chosen, rows, depth):
    vertices, weights, normals, _, _, _, _, _, deep = rows
    for e in chosen:
        if deep[e]:
            p = vertices[e, 0]
            depth[p] = max(depth[p], -dot(relative(x, movers, vertices, weights, e), row(normals, e)))


@njit
def _remove_overlaps(x, x_prev, predicted, begun, movers, chosen, rows, prepared, limit):
    """Shift what overlapped when the substep began at both of its ends; returns the smallest gap before, or inf."""
    vertices, weights, normals, offsets, _, _, _, _, _ = rows
    smallest, (bodies, numbers) = np.inf, prepared
    for k in range(len(chosen)):
        e = chosen[k]
        n, kind, mine = row(normals, e), bodies[k, 0], numbers[k, FIRST:]
        if kind == BOTH:
            before = dot(relative_before(x_prev, movers, vertices, weights, e), n)
        elif kind == VERTICES:
            before = dot(difference(x_prev, vertices, weights, e), n)
        else:
            begin_bodies(mine, x_prev, vertices[e], weights[e])
            before = dot(place_of_bodies(bodies[k], mine, movers.twists), n)
        smallest = min(smallest, before)
        if before >= offsets[e]:
            continue
        begun_gap = dot(difference(begun, vertices, weights, e), n)
        old = min(offsets[e] - before, limit + max(0.0, begun_gap - before))
        if kind != VERTICES:
            old = min(old, max(0.0, begun_gap - before) + max(0.0, (1.0 - REMAINS) * offsets[e] - begun_gap))
        if old > 0.0 and numbers[k, YIELD] > 0.0:
            s = old / numbers[k, YIELD]
            shift = (s * n[0], s * n[1], s * n[2])
            if kind in (VERTICES, BOTH):
                shift_both(x, x_prev, predicted, movers, vertices, weights, e, shift)
            else:
                shift_bodies(bodies[k], mine, movers, shift)
    return smallest


@njit(cache=True)
def note_shares(x_prev, predicted, points, rows, h):
    """Set which share of its force each row keeps: the part of a push that did not stop an approach.

    The approach with which the substep began does not return.

    Parameters
    ----------
    x_prev, predicted, h : see `solve_rows`, at the end of the substep; points : movers, and rates (n,) [1/s^2], see
        `response_rates`
    rows : `ContactRows.described`; shares are set
    """
    vertices, weights, normals, offsets, _, forces, shares, _, _ = rows
    movers, rates = points
    h2 = h * h
    for e in range(len(forces)):
        n = row(normals, e)
        push = h2 * dot(row(forces, e), n)
        shares[e] = 0.0
        if push > 0.0:
            gap = dot(relative_before(x_prev, movers, vertices, weights, e), n) - offsets[e]
            approach = min(0.0, gap) - (dot(relative_before(predicted, movers, vertices, weights, e), n) - offsets[e])
            share = max(0.0, 1.0 - max(0.0, approach) / compliance(movers, vertices, weights, e, n) / push)
            shares[e] = share * kept_share(h2 * _fastest(rates, vertices, weights, e))


@njit
def _solve_rigid(bodies, numbers, k, moved, n, total, gap, friction, pushes, holds):
    """Solve row k, between rigid bodies, with their twists and J."""
    twists, J = moved
    slip = slip_of_bodies(bodies, numbers, twists)
    push = max(0.0, pushes[k] - (max(0.0, gap) + dot(slip, n)) / total)
    if push == 0.0 and pushes[k] == 0.0 and holds[k, 0] == 0.0 and holds[k, 1] == 0.0 and holds[k, 2] == 0.0:
        return
    more = push - pushes[k]
    a = answer_of(numbers)
    # The push turns bodies, and they answer differently along the surface.
    slip = along_surface((slip[0] + more * a[0], slip[1] + more * a[1], slip[2] + more * a[2]), n)
    square = dot(slip, slip)
    along = softness_along(numbers, slip) / square if square > 0.0 else total
    d = _more_friction(slip, n, push, friction, along, k, holds)
    pushes[k] = push
    push_bodies(bodies, numbers, twists, J, n, more, d)


@njit
def _solve_vertices(numbers, k, x, vertices, weights, n, total, gap, friction, pushes, holds):
    """Solve row k, which moves vertices alone."""
    slip = slip_of_vertices(numbers, x, vertices, weights)
    push = max(0.0, pushes[k] - (max(0.0, gap) + dot(slip, n)) / total)
    if push == 0.0 and pushes[k] == 0.0 and holds[k, 0] == 0.0 and holds[k, 1] == 0.0 and holds[k, 2] == 0.0:
        return
    more = push - pushes[k]
    d = _more_friction(slip, n, push, friction, total, k, holds)
    pushes[k] = push
    push_vertices(numbers, x, vertices, (more * n[0] + d[0], more * n[1] + d[1], more * n[2] + d[2]))


@njit
def _solve_both(places, e, k, n, total, offset, gap, friction, pushes, holds):
    """Solve row k, which moves vertices and a rigid body."""
    x, x_prev, movers, vertices, weights = places
    r_prev = relative_before(x_prev, movers, vertices, weights, e)
    missing = min(0.0, gap) - (dot(relative(x, movers, vertices, weights, e), n) - offset)
    push = max(0.0, pushes[k] + missing / total)
    more = push - pushes[k]
    apply_impulse(x, x_prev, movers, vertices, weights, e, (more * n[0], more * n[1], more * n[2]))
    # The push turns the body, and it answers differently along the surface.
    slip = along_surface(subtract(relative(x, movers, vertices, weights, e), r_prev), n)
    length = math.sqrt(dot(slip, slip))
    if length > 0.0:
        along = (slip[0] / length, slip[1] / length, slip[2] / length)
        total = compliance(movers, vertices, weights, e, along)
    d = _more_friction(slip, n, push, friction, total, k, holds)
    pushes[k] = push
    apply_impulse(x, x_prev, movers, vertices, weights, e, d)


@njit
def _more_friction(slip, n, push, friction, total, k, holds):
    """Set the tangential impulse of row k, which answers with `total` [1/kg] along the slip; returns its change."""
    held = row(holds, k)
    # Corrections of positions in place of impulses: divided by the same inverse masses.
    scaled = (held[0] * total, held[1] * total, held[2] * total)
    hold = friction_total(scaled, slip, n, friction * push * total)
    hold = (hold[0] / total, hold[1] / total, hold[2] / total)
    for j in range(3):
        holds[k, j] = hold[j]
    return subtract(hold, held)


@njit
def _fastest(rates, vertices, weights, e):
    """The largest rate of the vertices that take part."""
    rate = 0.0
    for i in range(4):
        if weights[e, i] != 0.0:
            rate = max(rate, rates[vertices[e, i]])
    return rate
