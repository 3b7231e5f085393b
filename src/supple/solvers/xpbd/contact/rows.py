"""Rows: the pairs that take part in a substep, found at x_n, where nothing crosses.

There the nearest places of both sides, the unit normal n and the distance d = n . r are always defined. A row asks for
n . r >= min(gap, d) at the end of the substep, and for as little slip across n as Coulomb friction can prevent.
"""

from __future__ import annotations

import numpy as np

from supple.numerics.mat3 import cross, dot, row, subtract
from supple.runtime.kernel_cache import njit
from supple.solvers.xpbd.contact.levers import set_levers, softness
from supple.solvers.xpbd.contact.pairs import EDGES, NIL, POINT, SHAPE, along, facing, is_loaded, room_between

# Of the gap: the distance from simple shapes.
SKIN = 0.01
# Edges at a smaller angle [rad] do not push each other.
PARALLEL = 0.05


# A row: the number of its pair, its nodes and its kind; c_i, q (see `pairs`), n, the least n . r, and d [m]; the gap
# of the pair and its offsets [m]; the impulse [kg m] along n that changes n . r by one, see `softness`, 0 where
# nothing moves or pushes; the same along the surface, of rows with a rigid body, 0 until something slips; the
# coefficient of friction;
# the accumulated impulse [kg m]; whether a node is on a rigid body; of rows with rigid bodies these, shares and arms
# [m], and what is fixed [m]; see `levers`.
ROW = np.dtype(
    [
        ("pairs", np.int64),
        ("nodes", np.int32, 4),
        ("kinds", np.int8),
        ("rigid", np.bool_),
        ("weights", np.float64, 4),
        ("places", np.float64, 3),
        ("normals", np.float64, 3),
        *((name, np.float64) for name in ("targets", "distances", "gaps", "offsets", "masses", "across", "friction")),
        ("impulses", np.float64, 3),
        ("movers", np.int32, 4),
        ("levers", np.float64, (4, 4)),
        ("fixed", np.float64, 3),
    ],
    align=True,
)


@njit
def detect(begin, end, bodies, faces, first_of, near, pairs, walls, slack, chosen, moved, first, rows):
    """Append the rows of all pairs that are not sure to keep their reach on the way; returns the number of rows.

    Parameters
    ----------
    begin : (N, >= 3) x_n; end : (N, 4) places to which nodes would go, and inverse masses
    faces : see `facing`; first_of : see `Simplices.first`
    near : (m,) the pairs that are asked; walls : of the last of these, those with shapes
    slack : the reach of a pair is its gap and this [m]; below zero: the reach is zero
    chosen : (k,) the pairs that are rows already; out
    moved : (N,) of a pair, one node is among these
    first : how many rows there are already
    """
    count = first
    shape = len(near) - len(walls.gaps)
    for m in range(len(near)):
        k = near[m]
        kind = pairs.kinds[k]
        if chosen[k]:
            continue
        p, q, r, s = pairs.nodes[k, 0], pairs.nodes[k, 1], pairs.nodes[k, 2], pairs.nodes[k, 3]
        if not (moved[p] or moved[q] or moved[r] or moved[s]):
            continue
        loaded = is_loaded(pairs.impulses, k)
        reach = pairs.gaps[k] + slack if slack >= 0.0 else 0.0
        if kind == SHAPE:
            w = m - shape
            n, place = row(walls.normals, w), row(walls.places, w)
            if not loaded and along(end, p, n) - dot(place, n) > reach:
                continue
            c, d = (1.0, 0.0, 0.0, 0.0), walls.gaps[w]
            # What is behind a wall leaves it slowly.
            skin = SKIN * (pairs.gaps[k] - pairs.offsets[k])
            target = min(pairs.offsets[k] + skin, d) if d >= 0.0 else min(0.0, d + skin)
        else:
            loaded = loaded or pairs.deep[k]
            if not loaded and room_between(begin, end, pairs.nodes, k, kind, row(pairs.normals, k)) > reach:
                continue
            c, n, d = facing(begin, pairs, k, faces)
            if n == (0.0, 0.0, 0.0):
                continue
            place = (0.0, 0.0, 0.0)
            target = min(pairs.gaps[k], d)
        for j in range(3):
            pairs.normals[k, j] = n[j]
        if kind != SHAPE and not loaded and room_between(begin, end, pairs.nodes, k, kind, n) > reach:
            continue
        chosen[k] = True
        pairs.reached[k] = max(pairs.reached[k], min(pairs.gaps[k], d))
        for i in range(4):
            rows.nodes[count, i] = pairs.nodes[k, i]
            rows.weights[count, i] = c[i]
        for j in range(3):
            rows.normals[count, j], rows.places[count, j] = n[j], place[j]
            rows.impulses[count, j] = pairs.impulses[k, j]
        rows.pairs[count], rows.kinds[count] = k, kind
        rows.targets[count], rows.distances[count], rows.gaps[count] = target, d, pairs.gaps[k]
        rows.offsets[count] = pairs.offsets[k]
        set_levers(bodies, rows, count)
        soft = softness(end, bodies, rows, count, n)
        pushes = pairs.pushes[k]
        if kind == EDGES and not pairs.deep[k]:
            pushes = pushes and _cross(begin, pairs.nodes, k, c)
        elif kind == POINT and not pairs.deep[k] and d > NIL * pairs.gaps[k]:
            pushes = pushes and _is_own(c, pairs.shapes[k], first_of)
        rows.masses[count] = 1.0 / soft if soft > 0.0 and pushes else 0.0
        rows.across[count], rows.friction[count] = 0.0, pairs.friction[k]
        count += 1
    return count


@njit
def _is_own(c, t, first_of):
    """Whether the nearest place of triangle t is in its interior, or on a side or corner of which it is the first.

    So one place of a surface pushes a point once.
    """
    if c[1] == 0.0 and c[2] == 0.0:
        return first_of[t, 2]
    if c[2] == 0.0 and c[3] == 0.0:
        return first_of[t, 0]
    if c[3] == 0.0 and c[1] == 0.0:
        return first_of[t, 1]
    if c[1] == 0.0:
        return first_of[t, 4]
    if c[2] == 0.0:
        return first_of[t, 5]
    return first_of[t, 3] if c[3] == 0.0 else True


@njit
def _cross(x, nodes, k, c):
    """Whether the nearest places of two edges are within both, and the edges are not parallel.

    Otherwise a point and a triangle carry the load. The nearest places of parallel edges jump along them.
    """
    inside = min(min(c[0], c[1]), min(-c[2], -c[3]))
    a, b = subtract(row(x, nodes[k, 1]), row(x, nodes[k, 0])), subtract(row(x, nodes[k, 3]), row(x, nodes[k, 2]))
    n = cross(a, b)
    return inside > 1e-6 and dot(n, n) > PARALLEL**2 * dot(a, a) * dot(b, b)
