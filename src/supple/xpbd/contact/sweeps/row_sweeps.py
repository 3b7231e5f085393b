"""The Gauss-Seidel sweeps over the rows of contact of a substep; see `contact_rows`."""

import math

import numpy as np

from supple.numerics.kernel_cache import njit
from supple.numerics.mat3 import dot, row, subtract
from supple.xpbd.contact.friction import along_surface, friction_total
from supple.xpbd.contact.impulses import (
    apply_impulse,
    compliance,
    difference,
    is_rigid,
    relative,
    relative_before,
    shift_both,
    shift_compliance,
)
from supple.xpbd.contact.response_rates import kept_share
from supple.xpbd.contact.sweeps.rigid_rows import empty_rows, prepare_row, push_bodies, slip_of, softness_along

# Of the gap that is kept: an overlap of this size remains where a body is rigid. A shift that removes it lifts the body
# off its other contacts, onto which it falls in the next substep, so that nothing would come to rest.
REMAINS = 0.3


@njit(cache=True, error_model="numpy")
def solve_rows(x, x_prev, predicted, begun, points, chosen, rows, h, limit, sweeps, depth):
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
    points : movers, see `Movers`; rates (n,) see `response_rates` [1/s^2]
    chosen : (c,) rows, in the order of a sweep
    rows : `ContactRows.described`; forces are those that x contains, and shares are set
    h : length of the substep [s]
    limit : the largest part of an old overlap that one substep removes [m]
    sweeps : number of sweeps
    depth : (n,) how deep points are inside other pieces afterwards, where that is more than it is [m]
    """
    vertices, weights, normals, offsets, friction, forces, shares, _, _ = rows
    movers, rates = points
    h2 = h * h
    smallest = _remove_overlaps(x, x_prev, predicted, begun, movers, chosen, rows, limit)
    count = len(chosen)
    # How much larger than its offset each gap was before the substep [m]; what a unit push changes it by [1/kg].
    gaps, totals = np.empty(count), np.empty(count)
    pushes, holds = np.empty(count), np.empty((count, 3))
    rigid = empty_rows(count)
    for k in range(count):
        e = chosen[k]
        n, force = row(normals, e), row(forces, e)
        pushes[k] = max(0.0, h2 * dot(force, n))
        t = along_surface(force, n)
        for j in range(3):
            holds[k, j] = h2 * t[j]
        whole, totals[k], before = prepare_row(rigid, k, (x, x_prev), movers, vertices, weights, e, n)
        if not whole:
            totals[k] = compliance(movers, vertices, weights, e, n)
            before = relative_before(x_prev, movers, vertices, weights, e)
        gaps[k] = dot(before, n) - offsets[e]
    largest = 0.0
    for sweep in range(sweeps):
        for k in range(count):
            e, push = chosen[k], pushes[k]
            if not totals[k] > 0.0:
                continue
            if rigid.bodies[k, 0] >= -1:
                _solve_rigid(rigid, k, movers, row(normals, e), gaps[k], totals[k], friction[e], pushes, holds)
            else:
                places = (x, x_prev, movers, vertices, weights)
                _solve(places, e, k, row(normals, e), offsets[e], gaps[k], totals[k], friction[e], pushes, holds)
            if sweep == 0 and rigid.bodies[k, 0] >= -1:
                largest = max(largest, abs(pushes[k] - push) * totals[k])
    contacts = 0
    for k in range(count):
        e = chosen[k]
        contacts += pushes[k] > 0.0
        share = 0.0
        if pushes[k] > 0.0:
            # The part of a push that did not stop the approach with which the substep began: that part does not return.
            there = relative_before(predicted, movers, vertices, weights, e)
            approach = min(0.0, gaps[k]) - (dot(there, row(normals, e)) - offsets[e])
            share = max(0.0, 1.0 - max(0.0, approach) / totals[k] / pushes[k])
            share *= kept_share(h2 * _fastest(rates, vertices, weights, e))
        shares[e] = share
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
def _remove_overlaps(x, x_prev, predicted, begun, movers, chosen, rows, limit):
    """Shift what overlapped when the substep began at both of its ends; returns the smallest gap before, or inf."""
    vertices, weights, normals, offsets, _, _, _, _, _ = rows
    smallest = np.inf
    for e in chosen:
        n = row(normals, e)
        before = dot(relative_before(x_prev, movers, vertices, weights, e), n)
        smallest = min(smallest, before)
        if before >= offsets[e]:
            continue
        total = shift_compliance(movers, vertices, weights, e)
        begun_gap = dot(difference(begun, vertices, weights, e), n)
        old = min(offsets[e] - before, limit + max(0.0, begun_gap - before))
        if is_rigid(movers, vertices, e):
            old = min(old, max(0.0, begun_gap - before) + max(0.0, (1.0 - REMAINS) * offsets[e] - begun_gap))
        if old > 0.0 and total > 0.0:
            s = old / total
            shift_both(x, x_prev, predicted, movers, vertices, weights, e, (s * n[0], s * n[1], s * n[2]))
    return smallest


@njit
def _solve_rigid(rigid, k, movers, n, gap, total, friction, pushes, holds):
    """Solve a row between rigid bodies."""
    slip = slip_of(rigid, k, movers)
    push = max(0.0, pushes[k] - (max(0.0, gap) + dot(slip, n)) / total)
    held = row(holds, k)
    if push == 0.0 and pushes[k] == 0.0 and held[0] == 0.0 and held[1] == 0.0 and held[2] == 0.0:
        return
    more = push - pushes[k]
    a = row(rigid.answers, k)
    # The push turns bodies, and they answer differently along the surface.
    slip = along_surface((slip[0] + more * a[0], slip[1] + more * a[1], slip[2] + more * a[2]), n)
    square = dot(slip, slip)
    along = softness_along(rigid, k, slip) / square if square > 0.0 else total
    d = _more_friction(slip, n, push, friction, along, k, holds)
    pushes[k] = push
    push_bodies(rigid, k, movers, n, more, d)


@njit
def _solve(places, e, k, n, offset, gap, total, friction, pushes, holds):
    """Solve a row that moves vertices."""
    x, x_prev, movers, vertices, weights = places
    r = relative(x, movers, vertices, weights, e)
    r_prev = relative_before(x_prev, movers, vertices, weights, e)
    missing = min(0.0, gap) - (dot(r, n) - offset)
    push = max(0.0, pushes[k] + missing / total)
    more = push - pushes[k]
    slip = subtract(r, r_prev)
    if is_rigid(movers, vertices, e):
        apply_impulse(x, x_prev, movers, vertices, weights, e, (more * n[0], more * n[1], more * n[2]))
        more = 0.0
        slip = along_surface(subtract(relative(x, movers, vertices, weights, e), r_prev), n)
        length = math.sqrt(dot(slip, slip))
        if length > 0.0:
            along = (slip[0] / length, slip[1] / length, slip[2] / length)
            total = compliance(movers, vertices, weights, e, along)
    d = _more_friction(slip, n, push, friction, total, k, holds)
    pushes[k] = push
    d = (more * n[0] + d[0], more * n[1] + d[1], more * n[2] + d[2])
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
