"""Points against simple shapes, as kernels.

Each shape supplies its contact as an element function. The two kernels of this file are compiled once for each such
function, which is inlined: a new kind of obstacle does not slow down the others.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from types import FunctionType
from typing import Any

from supple.numerics.mat3 import cross, dot, row, subtract
from supple.runtime.kernel_cache import njit
from supple.solvers.xpbd.contact.friction import along_surface, friction_total
from supple.solvers.xpbd.contact.movers import place, place_before, push_body, softness
from supple.solvers.xpbd.contact.response_rates import kept_share


@njit
def _local(frames, k, p):
    """Coordinates of the point p in frame k."""
    d = (p[0] - frames[k, 0, 0], p[1] - frames[k, 0, 1], p[2] - frames[k, 0, 2])
    return (
        frames[k, 1, 0] * d[0] + frames[k, 1, 1] * d[1] + frames[k, 1, 2] * d[2],
        frames[k, 2, 0] * d[0] + frames[k, 2, 1] * d[1] + frames[k, 2, 2] * d[2],
        frames[k, 3, 0] * d[0] + frames[k, 3, 1] * d[1] + frames[k, 3, 2] * d[2],
    )


@njit
def _turned(frames, k, s):
    """The vector with coordinates s in frame k."""
    return (
        frames[k, 1, 0] * s[0] + frames[k, 2, 0] * s[1] + frames[k, 3, 0] * s[2],
        frames[k, 1, 1] * s[0] + frames[k, 2, 1] * s[1] + frames[k, 3, 1] * s[2],
        frames[k, 1, 2] * s[0] + frames[k, 2, 2] * s[1] + frames[k, 3, 2] * s[2],
    )


@njit
def contact(parameters, s0, s1):
    """Replaced by the element function of a shape; see `kernels_of`."""
    return math.inf, math.inf, (0.0, 0.0, 0.0)


def _find_candidates(x, reach, tested, shapes, rules, frames, starts, vertices, first, last, count):
    """Vertices that may touch the shapes [first, last) before they have moved by their reach (n,) [m].

    All vertices, where the shape moves. Vertices whose body does not collide with the shape, and those that are not
    tested (n,), are left out. `shapes` and `rules`: see `_project_shapes`.

    Writes `starts` (k + 1,) and as many of `vertices`, from `count` on, as fit. Returns their number so far.
    """
    parameters, moving = shapes
    owner, collide, _ = rules
    for k in range(first, last):
        starts[k] = count
        numbers = parameters[k]
        for i in range(len(x)):
            if not tested[i] or not collide[owner[i], k]:
                continue
            if not moving[k]:
                s = _local(frames, k, row(x, i))
                gap, _, _ = contact(numbers, s, s)
                if not gap <= reach[i]:
                    continue
            if count < len(vertices):
                vertices[count] = i
            count += 1
    starts[last] = count
    return count


def _project_shapes(
    x, x_prev, points, candidates, shapes, rules, frames, frames_before, first, last, h, limit, scales, sweeps
):
    """Push vertices out of the shapes [first, last), in place. Returns the number of contacts and the smallest gap.

    The gap is that before the substep, or inf. An overlap that existed when the substep began is removed at both ends
    of the substep alike, by at most `limit`; what such shifts have brought nearer than it was, at once. The push only
    prevents the gap from becoming smaller than it was then.

    Parameters
    ----------
    points : predicted (n, 3), positions before loads and constraints [m]; rates (n,), see `response_rates` [1/s^2];
        movers, see `Movers`; begun (n, 3), `x_prev` without the shifts of this substep [m]
    candidates : starts (k + 1,), vertices (c,), as from `_find_candidates`; loads (c, 3), those that x contains, and
        shares (c,) of them for the next substep; see `ObstacleContacts`; places (c, 4) are set to the normal and to the
        gap that remains
    shapes : parameters (k, PARAMETERS), moving (k,)
    rules : owner (n,), the body of a vertex; collide (b, k), friction (b, k), of each body with each shape
    frames, frames_before : (k, 4, 3) at the end and at the beginning of the substep
    h : length of the substep [s]
    limit : the largest part of an old overlap that is removed at each vertex [m]
    scales : skin, the gap that is kept; near, gaps above this are not reported [m]
    sweeps : over points of rigid bodies; the first one is also over vertices
    """
    predicted, rates, movers, begun = points
    starts, vertices, loads, shares, places = candidates
    parameters, moving = shapes
    owner, _, friction = rules
    skin, near = scales
    contacts, smallest, h2 = 0, math.inf, h * h
    for again in range(sweeps):
        for k in range(first, last):
            numbers = parameters[k]
            for c in range(starts[k], starts[k + 1]):
                i = vertices[c]
                is_rigid = movers.body[i] >= 0
                if again and not is_rigid:
                    continue
                p, p_before = place(x, movers, i), place_before(x_prev, movers, i)
                s = _local(frames, k, p)
                gap, gap_before, normal = contact(numbers, _local(frames_before, k, p_before), s)
                if gap_before < near and not again:
                    smallest = min(smallest, gap_before)
                load = row(loads, c)
                loaded = load[0] != 0.0 or load[1] != 0.0 or load[2] != 0.0
                if not gap < skin and not loaded:
                    continue
                n = _turned(frames, k, normal)
                load = (h2 * load[0], h2 * load[1], h2 * load[2])
                pushed, held = max(0.0, dot(load, n)), along_surface(load, n)
                # A vertex moves by its load; a point of a rigid body by what the body makes of a force.
                soft = softness(movers, movers.body[i], 1.0, cross(row(movers.arms, i), n)) if is_rigid else 1.0
                old = max(0.0, skin - gap_before)
                stays = again > 0 or (is_rigid and movers.loose[movers.body[i]] == 0.0)
                begun_gap = gap_before
                if old > 0.0:
                    _, begun_gap, _ = contact(numbers, _local(frames_before, k, row(begun, i)), s)
                shift = 0.0 if stays else min(old, limit + max(0.0, begun_gap - gap_before))
                push = max(0.0, pushed + (skin - gap - old) / soft)
                carried = p  # position, at the beginning, of the obstacle's point that is now at p
                if moving[k]:
                    d = _turned(frames_before, k, s)
                    carried = (
                        frames_before[k, 0, 0] + d[0],
                        frames_before[k, 0, 1] + d[1],
                        frames_before[k, 0, 2] + d[2],
                    )
                slip = (carried[0] - p_before[0], carried[1] - p_before[1], carried[2] - p_before[2])
                more = push - pushed
                if is_rigid:
                    # The push turns the body, and it answers differently along the surface.
                    push_body(movers, i, (more * n[0], more * n[1], more * n[2]))
                    moved = subtract(place(x, movers, i), p)
                    slip = along_surface((slip[0] + moved[0], slip[1] + moved[1], slip[2] + moved[2]), n)
                    length = math.sqrt(dot(slip, slip))
                    if length > 0.0:
                        along = (slip[0] / length, slip[1] / length, slip[2] / length)
                        f = 1.0 / softness(movers, movers.body[i], 1.0, cross(row(movers.arms, i), along))
                        slip = (f * slip[0], f * slip[1], f * slip[2])
                hold = friction_total(held, slip, n, friction[owner[i], k] * push)
                contacts += push > 0.0 and not again
                # What stopped the approach with which the substep began does not return.
                impact = dot(subtract(p, place_before(predicted, movers, i)), n) + skin - gap - old
                impact = max(0.0, impact) / soft
                shares[c] = max(0.0, 1.0 - impact / push) * kept_share(h2 * rates[i]) if push > 0.0 else 0.0
                if is_rigid:
                    b = movers.body[i]
                    push_body(movers, i, (hold[0] - held[0], hold[1] - held[1], hold[2] - held[2]))
                    for j in range(3):
                        movers.twists[b, 6 + j] += n[j] * shift
                else:
                    for j in range(3):
                        x[i, j] += n[j] * (more + shift) + (hold[j] - held[j])
                        x_prev[i, j] += n[j] * shift
                        predicted[i, j] += n[j] * shift
                for j in range(3):
                    loads[c, j] = (n[j] * push + hold[j]) / h2
                    places[c, j] = n[j]
                places[c, 3] = gap + soft * more + shift
    return contacts, smallest


@cache
def kernels_of(function: Callable[..., Any]) -> tuple[Callable[..., Any], Callable[..., Any]]:
    """`_find_candidates` and `_project_shapes` with `contact` replaced by a shape's element function, compiled.

    Numba names symbols of machine code by the kernel's name, so that it contains that of the function.
    """
    compiled = []
    for kernel in (_find_candidates, _project_shapes):
        names = {**kernel.__globals__, "contact": function}
        copy = FunctionType(kernel.__code__, names, kernel.__name__, kernel.__defaults__)
        copy.__qualname__ = f"{kernel.__qualname__}_{function.__module__}.{function.__qualname__}"
        copy.__module__ = kernel.__module__
        compiled.append(njit(cache=True)(copy))
    return compiled[0], compiled[1]


@njit(cache=True)
def add_loads(x, movers, vertices, loads, h):
    """x += h^2 a, for the loads a (c, 3) [m/s^2] of these vertices (c,); forces [N] on points of rigid bodies."""
    for c in range(len(vertices)):
        i = vertices[c]
        if movers.body[i] >= 0:
            push_body(movers, i, (h * h * loads[c, 0], h * h * loads[c, 1], h * h * loads[c, 2]))
            continue
        for j in range(3):
            x[i, j] += h * h * loads[c, j]
