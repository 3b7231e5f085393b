"""Edges against edges.

Two edges of different pieces touch where the nearest points of their lines are inside of both, and where the direction
between the lines separates the pieces locally: both faces of one edge lie on one side of it, both faces of the other on
the other side.
In all other cases a vertex is nearer to a face.

Besides, two edges touch where they have passed through each other since the substep began, also within one piece. They
do as long as they push each other.

Source: Ericson, "Real-Time Collision Detection" (2005), section 5.1.9 (nearest points of segments); Gregorius, "The
Separating Axis Test between Convex Polyhedra" (2013), for the second condition.
"""

import math

import numpy as np

from supple.numerics.geometry.closest_points import between
from supple.numerics.mat3 import cross, dot, row, subtract
from supple.runtime.kernel_cache import njit

# Edges whose sine of the angle between them is smaller are parallel: vertices and faces hold them apart.
PARALLEL = 1e-3


@njit
def _nearest(p, u, q, v):
    """Parameters on the lines p + s u and q + t v of their nearest points; s = -1 where the lines are parallel."""
    a, b, c = dot(u, u), dot(u, v), dot(v, v)
    det = a * c - b * b
    if det <= PARALLEL * PARALLEL * a * c:
        return -1.0, -1.0
    w = subtract(p, q)
    d, e = dot(u, w), dot(v, w)
    return (b * e - c * d) / det, (a * e - b * d) / det


@njit
def _supports(x, opposite, e, origin, n, sign):
    """Whether both faces of edge e are on the side to which sign n points away from."""
    for k in range(2):
        o = opposite[e, k]
        if o < 0:
            return True
        d = subtract(row(x, o), origin)
        if sign * dot(d, n) > 1e-9 * math.sqrt(dot(d, d)):
            return False
    return True


@njit(forceinline=True)
def _edge_contact(x, x_prev, edges, e, f, closed_e, closed_f, held):
    """Contact of the edges e and f: whether it exists, s, t, the unit normal from f to e, the signed distance [m].

    Edges that hold each other apart keep the side that they were on, whether or not their faces separate the pieces.
    """
    ends, opposite = edges
    nothing = (False, 0.0, 0.0, (0.0, 0.0, 0.0), math.inf)
    a, b, c, d = ends[e, 0], ends[e, 1], ends[f, 0], ends[f, 1]
    p, q = row(x, a), row(x, c)
    u, v = subtract(row(x, b), p), subtract(row(x, d), q)
    s, t = _nearest(p, u, q, v)
    if not (0.0 < s < 1.0 and 0.0 < t < 1.0):
        return nothing
    n = cross(u, v)
    length = math.sqrt(dot(n, n))
    n = (n[0] / length, n[1] / length, n[2] / length)
    # The faces of closed pieces tell which side is free; the border of a sheet has two sides, and keeps the old one.
    side = 0.0
    if held or not (closed_e or closed_f):
        side = dot(n, _between_lines(row(x_prev, a), row(x_prev, b), row(x_prev, c), row(x_prev, d), s, t))
    else:
        if closed_f:
            for k in range(2):
                side -= dot(n, subtract(row(x, opposite[f, k]), q))
        if closed_e:
            for k in range(2):
                side += dot(n, subtract(row(x, opposite[e, k]), p))
    if side < 0.0:
        n = (-n[0], -n[1], -n[2])
    if not (held or (_supports(x, opposite, f, q, n, 1.0) and _supports(x, opposite, e, p, n, -1.0))):
        return nothing
    return True, s, t, n, dot(n, _between_lines(p, row(x, b), q, row(x, d), s, t))


@njit
def _between_lines(a, b, c, d, s, t):
    """From the point t of c, d to the point s of a, b."""
    return subtract(between(a, b, s), between(c, d, t))


@njit(forceinline=True)
def _lines(x, ends, e, f):
    """Origins and directions of two edges, and six times the volume that they span."""
    p, q = row(x, ends[e, 0]), row(x, ends[f, 0])
    u, v = subtract(row(x, ends[e, 1]), p), subtract(row(x, ends[f, 1]), q)
    return p, u, q, v, dot(subtract(p, q), cross(u, v))


@njit(forceinline=True)
def _passage(x, x_prev, ends, e, f):
    """Whether edge e has passed through edge f in this substep, s, t, and the unit normal to the side where e was.

    All points move on straight lines. The volume that the edges span is zero when they are in one plane; it is taken as
    linear between both ends of the substep.
    """
    p1, u1, q1, v1, now = _lines(x, ends, e, f)
    p0, u0, q0, v0, then = _lines(x_prev, ends, e, f)
    nothing = (False, 0.0, 0.0, (0.0, 0.0, 0.0))
    if then * now > 0.0 or then == 0.0:
        return nothing
    k = then / (then - now)
    u, v = between(u0, u1, k), between(v0, v1, k)
    s, t = _nearest(between(p0, p1, k), u, between(q0, q1, k), v)
    if not (0.0 < s < 1.0 and 0.0 < t < 1.0):
        return nothing
    n = cross(u, v)
    length = math.copysign(math.sqrt(dot(n, n)), then)
    return True, s, t, (n[0] / length, n[1] / length, n[2] / length)


@njit(forceinline=True)
def _enter(rows, r, ends, e, f, s, t, n, gap, mu):
    """Fill in the row r of a contact of the edges e and f."""
    vertices, weights, normals, offsets, mus, _, _, active, deep = rows
    vertices[r, 0], vertices[r, 1], vertices[r, 2], vertices[r, 3] = ends[e, 0], ends[e, 1], ends[f, 0], ends[f, 1]
    weights[r, 0], weights[r, 1], weights[r, 2], weights[r, 3] = 1.0 - s, s, t - 1.0, -t
    for j in range(3):
        normals[r, j] = n[j]
    offsets[r], mus[r] = gap, mu
    active[r], deep[r] = True, False


@njit(cache=True)
def find_edge_contacts(x, x_prev, pairs, near_pairs, edges, surfaces, near, first_obstacle, kind, rows):
    """Find which edges touch now, and fill in their rows. Returns the smallest distance of those that do not [m].

    Parameters
    ----------
    x, x_prev : (n, 3) at the end and at the beginning of the substep [m]
    pairs : first (k,), second (k,) edges, and their rows (k,); near_pairs : numbers of those that are looked at
    edges : ends (e, 2), opposite (e, 2): see `SurfaceEdges`
    surfaces : point_piece (n,), closed (p,), gaps (p, p), friction (p, p), apart (p, p): which pieces did not cross
        when the frame began, so that nothing of them may pass through each other
    near : distances above this are not reported [m]
    first_obstacle : the first point of an obstacle; kind : 0 for pairs of bodies only, 1 for those with an obstacle
    rows : see `find_contacts`
    """
    first, second, numbers = pairs
    ends = edges[0]
    point_piece, closed, gaps, friction, apart = surfaces
    forces = rows[5]
    smallest = np.inf
    for i in near_pairs:
        e, f, r = first[i], second[i], numbers[i]
        mine, its = point_piece[ends[e, 0]], point_piece[ends[f, 0]]
        pushed = forces[r, 0] != 0.0 or forces[r, 1] != 0.0 or forces[r, 2] != 0.0
        held = pushed and apart[mine, its]
        if (ends[f, 0] >= first_obstacle) != (kind == 1) or (mine == its and not held):
            continue
        gap, mu = max(gaps[mine, its], gaps[its, mine]), friction[mine, its]
        found, s, t, n, distance = _edge_contact(x, x_prev, edges, e, f, closed[mine], closed[its], held)
        if not found:
            continue
        if distance >= gap:
            if distance < near:
                smallest = min(smallest, distance)
            if not pushed:
                continue
        c = (1.0 - s, s, t - 1.0, -t)
        before = 0.0
        for k in range(4):
            end = ends[e, k] if k < 2 else ends[f, k - 2]
            before += c[k] * dot(row(x_prev, end), n)
        # Edges far below each other's faces are in line by chance, in the hollow of a dented surface.
        if before <= 0.0 and not pushed and apart[mine, its]:
            continue
        _enter(rows, r, ends, e, f, s, t, n, gap, mu)
    return smallest


@njit(cache=True)
def find_edge_passages(x, x_prev, pairs, near_pairs, ends, surfaces, first_obstacle, kind, rows):
    """Activate the rows of the edges that have passed through each other; returns how many. For arguments see above."""
    first, second, numbers = pairs
    point_piece, _, gaps, friction, apart = surfaces
    count = 0
    for i in near_pairs:
        e, f = first[i], second[i]
        mine, its = point_piece[ends[e, 0]], point_piece[ends[f, 0]]
        if (ends[f, 0] >= first_obstacle) != (kind == 1) or not apart[mine, its]:
            continue
        passed, s, t, n = _passage(x, x_prev, ends, e, f)
        if passed:
            gap = max(gaps[mine, its], gaps[its, mine])
            _enter(rows, numbers[i], ends, e, f, s, t, n, gap, friction[mine, its])
            count += 1
    return count


@njit(cache=True)
def note_edge_passages(x, x_prev, pairs, near_pairs, ends, surfaces, passed):
    """Set passed[k, l] for the pieces k and l whose edges have passed through each other. For arguments see above."""
    first, second, _ = pairs
    point_piece, _, _, _, apart = surfaces
    for i in near_pairs:
        e, f = first[i], second[i]
        mine, its = point_piece[ends[e, 0]], point_piece[ends[f, 0]]
        if apart[mine, its] and not passed[mine, its]:
            passed[mine, its] = _passage(x, x_prev, ends, e, f)[0]
