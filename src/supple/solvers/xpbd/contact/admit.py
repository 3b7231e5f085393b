"""The guarantee of a substep: surfaces that are apart at x_n stay apart, and J stays positive, for any forces.

Nodes go straight from x_n to x. A pair is good if the plane across n that moves with it still separates both sides at
x, by a share of the distance or, below a floor, by all of it. It is also good if a plane that turns with the pair
separates the sides all the time. Only a pair that is not good gets a fixed plane, where both sides would meet. Motions
are shortened so that each node ends on its side of it. A tet that loses too much volume gets the share for which any
independent shorter motions keep J. Motions only become shorter, so that pairs with a plane and tets that were cut stay
good. Each is treated at most once, and the loop ends.

Nodes of inverse mass zero are kinematic: their motion is prescribed and is not shortened. Nodes that they push are
carried: their places at x_n are moved along n to their side, and their motion is shortened from there. Where that
inverts a tet, or takes a node through another surface, no motion is left to shorten, and `admit` reports it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.numerics.mat3 import dot, row, subtract
from supple.runtime.kernel_cache import njit
from supple.solvers.xpbd.contact.pairs import POINT, SHAPE, along, weights_of
from supple.solvers.xpbd.contact.tets import determinant, least_J, share_of_tet

# Of the gap: a distance below this may not become smaller in a substep.
NEAREST = 0.02
# Of the gap beyond offsets: to what distance things are moved that begin through each other, and pairs that have been
# that far apart and came nearer by what rows leave. With .15, a ball between two bars is truncated. And things that
# touch, of which no side is known at the next look: a body moves for it by less than 1e-6 of its edges, which is below
# round-off of its energy.
PARTED, APART = 0.2, 1e-5
# Of sqrt(a c), see `_keeps_apart`: 1 is where sides meet.
TURNING = 0.9
# Without carried nodes three rounds are the most that was seen; what is crushed needs no end.
MOST_ROUNDS = 40
# Of its distance, and of its J: what a pair and a tet keep in a substep.
KEEP_DISTANCE, KEEP_J = 0.1, 0.2


class Marks(NamedTuple):
    """Scratch memory: the round in which a node was changed last (N,), the nodes that were, which rows have a plane.

    bodies : (b,) rigid bodies whose motion was shortened
    gaps : (N,) of the nodes [m]; longest : (1,) the square of the longest way that was cut, in gaps
    """

    stamp: NDArray[np.int64]
    changed: NDArray[np.int64]
    planes: NDArray[np.bool_]
    bodies: NDArray[np.bool_]
    gaps: NDArray[np.float64]
    longest: NDArray[np.float64]


@njit(inline="always")
def least_distance(before, nearest):
    """What must remain of a distance."""
    return min((1.0 - 1e-6) * before, max(KEEP_DISTANCE * before, nearest))


@njit
def _shorten(base, points, i, share, marks, count, turn):
    """Leave a node a share of its motion; returns how many nodes were changed in this round."""
    moved, square = False, 0.0
    for j in range(3):
        place = base[i, j] + share * (points[i, j] - base[i, j])
        moved = moved or place != points[i, j]
        square += (place - points[i, j]) ** 2
        points[i, j] = place
    marks.longest[0] = max(marks.longest[0], square / marks.gaps[i] ** 2)
    return _note(i, marks, count, turn) if moved else count


@njit
def _shorten_all(base, points, i, share, movers, marks, count, turn):
    """`_shorten`, of the whole body if the node is on one."""
    b = movers.bodies.body[i]
    if b < 0:
        return _shorten(base, points, i, share, marks, count, turn)
    marks.bodies[b] = True
    for k in range(movers.nodes.start[b], movers.nodes.start[b + 1]):
        count = _shorten(base, points, movers.nodes.items[k], share, marks, count, turn)
    return count


@njit
def _carry(base, points, i, back, ahead, n, movers, marks, count, turn):
    """Move a node, or its whole body, along n: `back` at the beginning and `ahead` at the end [m]."""
    b = movers.bodies.body[i]
    first, last = (0, 1) if b < 0 else (movers.nodes.start[b], movers.nodes.start[b + 1])
    for k in range(first, last):
        v = i if b < 0 else movers.nodes.items[k]
        for j in range(3):
            base[v, j] += back * n[j]
            points[v, j] += ahead * n[j]
        count = _note(v, marks, count, turn)
    return count


@njit
def _note(i, marks, count, turn):
    if marks.stamp[i] != turn:
        marks.stamp[i] = turn
        marks.changed[count] = i
        count += 1
    return count


@njit
def _apart(x, rows, e, n):
    """How far the sides of a pair are apart along n."""
    p, q, r, s = rows.nodes[e, 0], rows.nodes[e, 1], rows.nodes[e, 2], rows.nodes[e, 3]
    if rows.kinds[e] == POINT:
        return along(x, p, n) - max(along(x, q, n), max(along(x, r, n), along(x, s, n)))
    return min(along(x, p, n), along(x, q, n)) - max(along(x, r, n), along(x, s, n))


@njit
def _keeps_apart(base, points, rows, e, n, remains, bends):
    """Whether a plane separates the sides of a pair all the time while nodes go straight from `base` to `points`.

    First one with the normal n of the beginning; then one that turns from it to that of the end. For nodes p and q of
    the two sides, (1 - s) n + s n' times p - q is a quadratic in s, with the coefficients a, 2 b, c of Bernstein; it is
    positive where a and c are and b > -sqrt(a c). Ways that are bent by `bends` [m] take two of these from each.
    """
    need = max(remains, min(remains + 2.0 * bends, (1.0 - 1e-6) * rows.distances[e]))
    if _apart(points, rows, e, n) >= need:
        return True
    _, r = weights_of(points, rows.nodes, e, rows.kinds[e])
    size = math.sqrt(dot(r, r))
    if not size >= need:
        return False
    m = (r[0] / size, r[1] / size, r[2] / size)
    first = 1 if rows.kinds[e] == POINT else 2
    for i in range(first):
        p = rows.nodes[e, i]
        for j in range(first, 4):
            q = rows.nodes[e, j]
            before, after = subtract(row(base, p), row(base, q)), subtract(row(points, p), row(points, q))
            a, c = dot(n, before) - 2.0 * bends, dot(m, after) - 2.0 * bends
            b = 0.5 * (dot(n, after) + dot(m, before)) - 2.0 * bends
            if not (a > 0.0 and c > 0.0 and b > -TURNING * math.sqrt(a * c)):
                return False
    return True


@njit
def _plane(base, points, rows, e, n, margin):
    """Where the plane of a pair stands along n: where both sides would arrive at the same time."""
    top, floor = np.inf, -np.inf
    down = up = 0.0
    lowest, highest = np.inf, -np.inf  # of kinematic nodes
    end_top, end_floor = np.inf, -np.inf
    for i in range(4):
        v = rows.nodes[e, i]
        a, b = along(base, v, n), along(points, v, n)
        if i == 0 or (i == 1 and rows.kinds[e] != POINT):
            top, end_top = min(top, a), min(end_top, b)
            lowest = min(lowest, b) if points[v, 3] == 0.0 else lowest
        else:
            floor, end_floor = max(floor, a), max(end_floor, b)
            highest = max(highest, b) if points[v, 3] == 0.0 else highest
    down, up = max(0.0, top - end_top), max(0.0, end_floor - floor)
    share = up / (up + down) if up + down > 0.0 else 0.5
    where = floor + margin + (top - floor - 2.0 * margin) * share
    return max(min(where, lowest - margin), highest + margin)


@njit
def admit(base, points, movers, rows, count, tets, low, moved, keep, marks, cuts):
    """Shorten motions from `base` (N, 3) in `points` (N, 4) until the guarantee holds; see the module.

    Parameters
    ----------
    low : number of tets in `tets.low`, as measured; moved : number of nodes in `marks.changed` that moved since then
    keep : share of J that a tet keeps

    Returns
    -------
    cut : number of rows of `cuts`; rounds
    """
    cut = rounds = 0
    marks.planes[:count] = marks.bodies[:] = False
    changed = moved
    while True:
        if changed:
            low = _low_around(points, tets, keep, marks, changed, low if rounds == 0 else 0)
        elif rounds:
            break
        if rounds == MOST_ROUNDS:
            break
        changed = 0
        rounds += 1
        for k in range(low):
            t = tets.low[k]
            share = share_of_tet(base, points, tets, t, keep)
            if share == 1.0:
                continue
            for i in range(4):
                v = tets.nodes[t, i]
                if points[v, 3] > 0.0:
                    changed = _shorten_all(base, points, v, share, movers, marks, changed, rounds)
                if cut < len(cuts.nodes):
                    cuts.nodes[cut, i] = v
            if cut < len(cuts.nodes):
                cuts.shares[cut], cuts.rows[cut] = share, -1
                cut += 1
        for e in range(count):
            # What is behind a triangle since the frame began is not kept there.
            if marks.planes[e] or rows.kinds[e] == SHAPE or rows.distances[e] <= 0.0:
                continue
            n = row(rows.normals, e)
            remains = least_distance(rows.distances[e], NEAREST * rows.gaps[e])
            # A body that is shortened is put back from straight ways onto its arcs.
            bends = most = 0.0
            for i in range(4):
                b, bend = movers.bodies.body[rows.nodes[e, i]], movers.bodies.bends[rows.nodes[e, i]]
                most = max(most, bend)
                if b >= 0 and marks.bodies[b]:
                    bends = max(bends, bend)
            if _keeps_apart(base, points, rows, e, n, remains, bends):
                continue
            marks.planes[e] = True
            margin = min(0.5 * remains + most, 0.5 * (1.0 - 1e-6) * rows.distances[e])
            where = _plane(base, points, rows, e, n, margin)
            least = 1.0
            for i in range(4):
                v = rows.nodes[e, i]
                if cut < len(cuts.nodes):
                    cuts.nodes[cut, i] = v
                if points[v, 3] == 0.0:
                    continue
                sign = 1.0 if i == 0 or (i == 1 and rows.kinds[e] != POINT) else -1.0
                begin, end = sign * (along(base, v, n) - where), sign * (along(points, v, n) - where)
                if begin < margin:
                    # A kinematic node pushes this node.
                    back, ahead = sign * (margin - begin), sign * max(0.0, margin - end)
                    changed = _carry(base, points, v, back, ahead, n, movers, marks, changed, rounds)
                elif end < margin:
                    share = max(0.0, min(1.0, (begin - margin) / (begin - end))) * (1.0 - 1e-12)
                    least = min(least, share)
                    changed = _shorten_all(base, points, v, share, movers, marks, changed, rounds)
            if cut < len(cuts.nodes):
                cuts.shares[cut], cuts.rows[cut] = least, e
                cut += 1
    marks.stamp[:] = 0
    return cut, rounds


@njit
def _low_around(points, tets, keep, marks, changed, low):
    """List the tets around changed nodes that have too little volume, after the first `low`."""
    for k in range(changed):
        i = marks.changed[k]
        for a in range(tets.around.start[i], tets.around.start[i + 1]):
            t = tets.around.items[a]
            J = tets.scales[t] * determinant(points, tets.nodes, t)
            tets.now[t] = J
            if not least_J(tets.J[t], keep) <= J and low < len(tets.low):
                tets.low[low] = t
                low += 1
    return low


@njit(cache=True)
def count_crossing(base, points, rows, count):
    """How many pairs that were apart are not, after `admit`: what was carried went through something."""
    bad = 0
    for e in range(count):
        if rows.kinds[e] != SHAPE and rows.distances[e] > 0.0:
            n = row(rows.normals, e)
            remains = least_distance(rows.distances[e], NEAREST * rows.gaps[e])
            bad += not _keeps_apart(base, points, rows, e, n, 0.5 * remains, 0.0)
    return bad


@njit
def part(points, movers, loose, pairs, rows, count, most, marks):
    """Part what is through each other by at most `most` [m], and what touches; put nodes back onto walls.

    What is apart is never moved farther apart than it has been: that would be energy without a source.

    Velocities do not change. Bodies are shifted by their inverse masses times `loose` (b,). Returns how many nodes of
    `marks.changed` moved.
    """
    moved = 0
    for e in range(count):
        if rows.masses[e] == 0.0:
            continue
        n = row(rows.normals, e)
        s = -(n[0] * rows.places[e, 0] + n[1] * rows.places[e, 1] + n[2] * rows.places[e, 2])
        for i in range(4):
            s += rows.weights[e, i] * along(points, rows.nodes[e, i], n)
        if rows.kinds[e] == SHAPE:
            lack = rows.targets[e] - s if rows.distances[e] >= 0.0 else min(most, -s)
        elif pairs.deep[rows.pairs[e]]:
            lack = min(most, rows.offsets[e] + PARTED * (rows.gaps[e] - rows.offsets[e]) - s)
        else:
            parted = rows.offsets[e] + PARTED * (rows.gaps[e] - rows.offsets[e])
            known = min(parted, pairs.reached[rows.pairs[e]])
            lack = min(most, max(APART * rows.gaps[e], known) - s) if rows.distances[e] < rows.gaps[e] else 0.0
        if not lack > 0.0:
            continue
        for i in range(1 if rows.kinds[e] == SHAPE else 4):
            v = rows.nodes[e, i]
            b = movers.bodies.body[v]
            g = (loose[b] * movers.bodies.w[b] if b >= 0 else points[v, 3]) * rows.weights[e, i] * rows.masses[e] * lack
            if rows.kinds[e] == SHAPE and b >= 0:
                g = lack if loose[b] * movers.bodies.w[b] > 0.0 else 0.0
            moved = _carry(points, points, v, 0.0, g, n, movers, marks, moved, -1)
    return moved
