"""The guarantee of a substep: what was apart at x_n stays apart, and J stays positive, whatever the forces were.

Nodes go straight from x_n to x. A pair is good if the plane across n that moves with it still parts both sides at x,
by a share of the distance or, below a floor, all of it: both sides go straight, so that such a plane parts them all
the time. Only a pair that is not good gets a plane that stands still, where both sides would meet, and motions are
shortened so that each node ends on its side of it. A tet that loses too much gets the share for which any independent
shorter motions keep J. Motions only become shorter, so that pairs with a plane and tets that were cut stay good; each
is treated at most once, and the loop ends.

Nodes of inverse mass zero go where they are told. What they push before them is carried: its place at x_n is moved
along n to its side, from where its motion is shortened. Where that turns a tet over, or takes a node through something
else, nothing is left that could be cut, and `admit` says so.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.numerics.adjacency import Adjacency
from supple.numerics.mat3 import cross, dot, row, subtract
from supple.runtime.kernel_cache import njit
from supple.solvers.xpbd.rigid.motion import solve_symmetric
from trials.xpbd_rows.bodies import Bodies, push_node, softness
from trials.xpbd_rows.pairs import POINT, SHAPE, along
from trials.xpbd_rows.tets import determinant, least_J, share_of_tet

# Of the gap: a distance below this may not become smaller in a substep.
NEAREST = 0.02
# Without carried nodes three rounds are the most that was seen; what is crushed needs no end.
MOST_ROUNDS = 40
# Of its distance, and of its J: what a pair and a tet keep in a substep.
KEEP_DISTANCE, KEEP_J = 0.1, 0.2


class Cuts(NamedTuple):
    """Room for what was cut: nodes (c, 4) of pairs and tets, their rows or -1, and the shares of motion left."""

    nodes: NDArray[np.int32]
    rows: NDArray[np.int64]
    shares: NDArray[np.float64]

    @classmethod
    def room(cls, c: int) -> Cuts:
        """For c cuts."""
        return cls(np.zeros((c, 4), np.int32), np.zeros(c, np.int64), np.zeros(c))


class Movers(NamedTuple):
    """What nodes on rigid bodies need: the bodies, and the nodes of each of them."""

    bodies: Bodies
    nodes: Adjacency


class Marks(NamedTuple):
    """Scratch memory: the round in which a node was changed last (N,), the nodes that were, which rows have a plane."""

    stamp: NDArray[np.int64]
    changed: NDArray[np.int64]
    planes: NDArray[np.bool_]


@njit(inline="always")
def least_distance(before, nearest):
    """What must remain of a distance."""
    return min((1.0 - 1e-6) * before, max(KEEP_DISTANCE * before, nearest))


@njit
def _shorten(base, points, i, share, marks, count, turn):
    """Leave a node a share of its motion; returns how many nodes were changed in this round."""
    moved = False
    for j in range(3):
        place = base[i, j] + share * (points[i, j] - base[i, j])
        moved = moved or place != points[i, j]
        points[i, j] = place
    return _note(i, marks, count, turn) if moved else count


@njit
def _shorten_all(base, points, i, share, movers, marks, count, turn):
    """`_shorten`, of the whole body if the node is on one."""
    b = movers.bodies.body[i]
    if b < 0:
        return _shorten(base, points, i, share, marks, count, turn)
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
def _plane(base, points, rows, e, n, margin):
    """Where the plane of a pair stands along n: where both sides would arrive at the same time."""
    top, floor = np.inf, -np.inf
    down = up = 0.0
    lowest, highest = np.inf, -np.inf  # of nodes that go where they are told
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


@njit(cache=True)
def admit(base, points, movers, rows, count, tets, low, moved, keep, nearest, marks, cuts):
    """Shorten motions from `base` (N, 3) in `points` (N, 4) until the guarantee holds; see the module.

    Parameters
    ----------
    low : number of tets in `tets.low`, as measured; moved : number of nodes in `marks.changed` that moved since then
    keep : share of J that a tet keeps; nearest : floor of distances [m]

    Returns
    -------
    cut : number of rows of `cuts`; rounds
    """
    cut = rounds = 0
    marks.planes[:count] = False
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
            if marks.planes[e] or rows.kinds[e] == SHAPE:
                continue
            n = row(rows.normals, e)
            remains = least_distance(rows.distances[e], nearest)
            bends = 0.0
            for i in range(4):
                bends = max(bends, movers.bodies.bends[rows.nodes[e, i]])
            if _apart(points, rows, e, n) >= max(remains, min(remains + 2.0 * bends, (1.0 - 1e-6) * rows.distances[e])):
                continue
            marks.planes[e] = True
            margin = 0.5 * remains
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
                    # What goes where it is told pushes this node before it.
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
def count_crossing(points, rows, count, nearest):
    """How many pairs that were apart are not, after `admit`: what was carried went through something."""
    bad = 0
    for e in range(count):
        if rows.kinds[e] != SHAPE:
            n = row(rows.normals, e)
            bad += not _apart(points, rows, e, n) >= 0.5 * least_distance(rows.distances[e], nearest)
    return bad


@njit(cache=True)
def widen(points, movers, loose, rows, count, gap, most, marks):
    """Widen gaps of pushing pairs that are too narrow by at most `most` [m]; put nodes back onto walls.

    No velocity follows. Bodies are shifted by their inverse masses `loose` (b,). Returns how many nodes of
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
            lack = rows.targets[e] - s
        else:
            lack = min(most, gap - s) if rows.distances[e] < gap else 0.0
        if not lack > 0.0:
            continue
        for i in range(1 if rows.kinds[e] == SHAPE else 4):
            v = rows.nodes[e, i]
            b = movers.bodies.body[v]
            g = (loose[b] if b >= 0 else points[v, 3]) * rows.weights[e, i] * rows.masses[e] * lack
            moved = _carry(points, points, v, 0.0, g, n, movers, marks, moved, -1)
    return moved


@njit(cache=True)
def share_motion(points, movers, rows, begin, velocities, cuts, count):
    """Give back what the cuts took: the velocities of the four nodes go over to those of their common rigid motion.

    By the share that was cut. In the metric of the masses, the rigid motion is the projection of the motion, so that
    the kinetic energy does not rise; both momenta, about the places x_n, remain. Nodes that go where they are told
    give their own velocity to the others.
    """
    for e in range(count):
        part = 1.0 - cuts.shares[e]
        if _has_body(movers.bodies, cuts.nodes, e):
            if cuts.rows[e] >= 0:
                _stop_approach(points, movers.bodies, rows, cuts.rows[e], velocities, part)
            continue
        total = cx = cy = cz = px = py = pz = 0.0
        told = 0
        for i in range(4):
            v = cuts.nodes[e, i]
            told += points[v, 3] == 0.0
        for i in range(4):
            v = cuts.nodes[e, i]
            if told:
                m = 1.0 if points[v, 3] == 0.0 else 0.0
            else:
                m = 1.0 / points[v, 3]
            total += m
            cx, cy, cz = cx + m * begin[v, 0], cy + m * begin[v, 1], cz + m * begin[v, 2]
            px, py, pz = px + m * velocities[v, 0], py + m * velocities[v, 1], pz + m * velocities[v, 2]
        cx, cy, cz = cx / total, cy / total, cz / total
        mean = (px / total, py / total, pz / total)
        spin = (0.0, 0.0, 0.0)
        if not told:
            spin = _spin(points, begin, velocities, cuts.nodes, e, (cx, cy, cz))
        for i in range(4):
            v = cuts.nodes[e, i]
            if points[v, 3] == 0.0:
                continue
            turned = cross(spin, (begin[v, 0] - cx, begin[v, 1] - cy, begin[v, 2] - cz))
            for j in range(3):
                velocities[v, j] += part * (mean[j] + turned[j] - velocities[v, j])


@njit
def _has_body(bodies, nodes, e):
    return max(
        max(bodies.body[nodes[e, 0]], bodies.body[nodes[e, 1]]), max(bodies.body[nodes[e, 2]], bodies.body[nodes[e, 3]])
    ) >= 0  # fmt: skip


@njit
def _stop_approach(points, bodies, rows, e, velocities, part):
    """Take back a part of the approach of a row by opposite impulses; those on bodies go to their twists."""
    n, speed = row(rows.normals, e), 0.0
    for i in range(4):
        v = rows.nodes[e, i]
        b = bodies.body[v]
        u = row(velocities, v)
        if b >= 0:
            t = bodies.twists
            turned = cross((t[b, 3], t[b, 4], t[b, 5]), row(bodies.arms, v))
            u = (u[0] + t[b, 0] + turned[0], u[1] + t[b, 1] + turned[1], u[2] + t[b, 2] + turned[2])
        speed += rows.weights[e, i] * dot(n, u)
    soft = softness(points, bodies, rows.nodes, e, (*row(rows.weights, e), rows.weights[e, 3]), n)
    if not speed < 0.0 or not soft > 0.0:
        return
    for i in range(4):
        v = rows.nodes[e, i]
        f = -part * speed / soft * rows.weights[e, i]
        if bodies.body[v] >= 0:
            push_node(points, bodies, v, (f * n[0], f * n[1], f * n[2]))
        else:
            for j in range(3):
                velocities[v, j] += points[v, 3] * f * n[j]


@njit
def _spin(points, begin, velocities, nodes, e, center):
    """The angular velocity of four free nodes with their angular momentum; zero where they are in a line."""
    xx = yy = zz = xy = yz = zx = 0.0
    moment = (0.0, 0.0, 0.0)
    for i in range(4):
        v = nodes[e, i]
        m = 1.0 / points[v, 3]
        r = subtract(row(begin, v), center)
        xx, yy, zz = (
            xx + m * (r[1] ** 2 + r[2] ** 2),
            yy + m * (r[2] ** 2 + r[0] ** 2),
            zz + m * (r[0] ** 2 + r[1] ** 2),
        )
        xy, yz, zx = xy - m * r[0] * r[1], yz - m * r[1] * r[2], zx - m * r[2] * r[0]
        u = cross(r, row(velocities, v))
        moment = (moment[0] + m * u[0], moment[1] + m * u[1], moment[2] + m * u[2])
    if not determinant_of((xx, xy, zx), (xy, yy, yz), (zx, yz, zz)) > 1e-9 * (0.5 * (xx + yy + zz)) ** 3:
        return (0.0, 0.0, 0.0)
    return solve_symmetric((xx, yy, zz, xy, yz, zx), moment)


@njit
def determinant_of(a, b, c):
    return dot(a, cross(b, c))
