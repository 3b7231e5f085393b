"""Points against triangles: of other bodies, of the same body, of triangle obstacles.

Of all triangles of a piece that are near a point, one is selected (`_select_triangle`):

1. One that the point has passed through during the substep, from outside to inside; for an open sheet, from either
   side. This detects fast points, however thin the piece is.
2. Otherwise the nearest one. The side of this triangle tells whether the point is inside a closed piece. Where several
   are equally near (at an edge or a corner), the one whose normal is closest to the direction of the point is used.
3. A point may be behind a nearby triangle of its own piece without contact: it is on the other face of a thin part. So
   within one piece, only triangles count that the point was outside of when the substep began, or has passed through.

The point and the triangle are then moved apart along the line between them, according to their inverse masses. Linear
momentum is conserved exactly; angular momentum up to the rotation of the contact within one substep.
"""

import math

from supple.numerics.adjacency import in_list
from supple.numerics.geometry.closest_point import area_normal, between, closest_on_triangle, combine
from supple.numerics.kernel_cache import njit
from supple.numerics.mat3 import dot, row, subtract
from supple.xpbd.contact.friction import friction_correction
from supple.xpbd.contact.overlap import split_overlap

# Squared distances with a relative difference below this are equal: the point is nearest to a common edge or corner.
TIE = 1e-9


@njit
def _corners(x, triangles, t):
    return row(x, triangles[t, 0]), row(x, triangles[t, 1]), row(x, triangles[t, 2])


@njit
def _passage(p, p0, corners, corners0, both_ways):
    """The time in the substep (0..1) at which the point passed through the triangle, otherwise 2; the side; the place.

    The point and the corners move on straight lines; the heights above the triangle at both ends give the time.
    """
    a, b, c = corners
    a0, b0, c0 = corners0
    n, n0 = area_normal(a, b, c), area_normal(a0, b0, c0)
    d, d0 = dot(subtract(p, a), n), dot(subtract(p0, a0), n0)
    nowhere = (1.0, 0.0, 0.0)
    if d0 * d > 0.0 or d == 0.0 or (d0 < 0.0 and not both_ways) or (d0 == 0.0 and (both_ways or d > 0.0)):
        return 2.0, 1.0, nowhere
    length, length0 = math.sqrt(dot(n, n)), math.sqrt(dot(n0, n0))
    if length == 0.0 or length0 == 0.0:
        return 2.0, 1.0, nowhere
    height0, height = d0 / length0, d / length
    t = height0 / (height0 - height)
    q = between(p0, p, t)
    u, v, w = between(a0, a, t), between(b0, b, t), between(c0, c, t)
    where = closest_on_triangle(q, u, v, w)
    off = subtract(q, combine(where, u, v, w))
    m = area_normal(u, v, w)
    aside = dot(off, off) - dot(off, m) ** 2 / max(dot(m, m), 1e-300)
    # On the triangle up to round-off. A larger tolerance would include what passes beside an edge of a sheet.
    if aside > 1e-10 * max(length, length0):
        return 2.0, 1.0, nowhere
    return t, (1.0 if d0 >= 0.0 else -1.0), where


@njit
def _select_triangle(x, x_prev, p, triangles, near, same, closed, entered, reach):
    """The triangle for the contact of point p, the barycentric point on it, the side of p, and the distance.

    Parameters
    ----------
    near : triangles of one piece; same : whether p is a point of that piece; closed : whether it has an inside
    entered : the triangle of the same piece that p has passed through and is still behind, or -1
    reach : `near` contains all triangles up to this distance [m]

    Returns
    -------
    triangle : -1 for none
    where : barycentric coordinates
    side : 1 where the point is outside now, -1 where it is inside or behind
    distance : [m], or inf where the point has passed through the triangle
    """
    q, q0 = row(x, p), row(x_prev, p)
    first, best, side, best_alignment, least = 2.0, -1, 1.0, -1.0, math.inf
    where = (1.0, 0.0, 0.0)
    for t in near:
        corners, corners0 = _corners(x, triangles, t), _corners(x_prev, triangles, t)
        time, from_side, place = _passage(q, q0, corners, corners0, not closed)
        if time < first:
            first, best, side, where = time, t, from_side, place
        if first <= 1.0:
            continue
        a, b, c = corners
        n = area_normal(a, b, c)
        height = dot(subtract(q, a), n)
        length = math.sqrt(dot(n, n))
        if length == 0.0:
            continue
        if same:
            if entered >= 0:
                # Only triangles that face in the same direction as the one that the point is behind.
                u, v, w = _corners(x, triangles, entered)
                if dot(area_normal(u, v, w), n) <= 0.0:
                    continue
            else:
                a0, b0, c0 = corners0
                outside_before = dot(subtract(q0, a0), area_normal(a0, b0, c0)) >= 0.0
                if height <= 0.0 or not outside_before or height > reach * length:
                    continue
        place = closest_on_triangle(q, a, b, c)
        off = subtract(q, combine(place, a, b, c))
        square = dot(off, off)
        alignment = abs(height) / (length * math.sqrt(square)) if square > 0.0 else 1.0
        nearer = square < least * (1.0 - TIE)
        tie = not nearer and square <= least * (1.0 + TIE) and alignment > best_alignment
        if nearer or tie:
            best, where, best_alignment = t, place, alignment
            least = min(least, square)
            side = -1.0 if height < 0.0 else 1.0
    if first <= 1.0:
        return best, where, side, math.inf
    return best, where, side, math.sqrt(least)


@njit
def _place_at_start(x_prev, p, corners, where):
    """The place on a triangle's face that was below the point when the substep began, otherwise `where`.

    The lever arms of impulses are these positions, so an impulse there, along the normal, does not change the angular
    momentum. Along a face the gap is the same everywhere.
    """
    if min(where[0], where[1], where[2]) <= 0.0:
        return where
    before = closest_on_triangle(row(x_prev, p), corners[0], corners[1], corners[2])
    if min(before[0], before[1], before[2]) <= 0.0:
        return where
    return before


@njit
def _direction(x, p, triangle, where, passed, side, open_sheet):
    """The unit normal of the contact, out of the piece."""
    a, b, c = triangle
    n = area_normal(a, b, c)
    length = math.sqrt(dot(n, n))
    off = subtract(row(x, p), combine(where, a, b, c))
    distance = math.sqrt(dot(off, off))
    if not passed and distance > 1e-6 * math.sqrt(length):
        f = (1.0 if open_sheet else side) / distance
        return (f * off[0], f * off[1], f * off[2])
    f = (side if passed or open_sheet else 1.0) / length
    return (f * n[0], f * n[1], f * n[2])


@njit
def _relative(x, p, corners, where):
    """The point relative to the place on the triangle [m]."""
    return subtract(row(x, p), combine(where, corners[0], corners[1], corners[2]))


@njit
def _move(x, w, p, t, triangles, where, d):
    """Change the relative position by d times the sum of the weighted inverse masses."""
    for j in range(3):
        x[p, j] += w[p] * d[j]
        for i in range(3):
            k = triangles[t, i]
            x[k, j] -= w[k] * where[i] * d[j]


@njit
def _resolve(x, x_prev, w, p, t, triangles, where, n, gap, mu, limit):
    """Push point and triangle apart to the gap, with friction. Returns their distance when the substep began [m]."""
    now = _relative(x, p, _corners(x, triangles, t), where)
    before = _relative(x_prev, p, _corners(x_prev, triangles, t), where)
    impulse, shift = split_overlap(dot(now, n) - gap, dot(before, n) - gap, limit)
    total = w[p]
    for i in range(3):
        total += w[triangles[t, i]] * where[i] * where[i]
    if impulse + shift > 0.0 and total > 0.0:
        back = friction_correction(subtract(now, before), n, mu, impulse)
        both, s = (impulse + shift) / total, shift / total
        change = (both * n[0] + back[0] / total, both * n[1] + back[1] / total, both * n[2] + back[2] / total)
        _move(x, w, p, t, triangles, where, change)
        if shift > 0.0:
            _move(x_prev, w, p, t, triangles, where, (s * n[0], s * n[1], s * n[2]))
    return dot(before, n)


@njit(cache=True)
def project_surfaces(x, x_prev, lists, surfaces, memory, scales, part, stitched):
    """Keep points and triangles apart, in place. Returns the number of contacts and the smallest previous gap (or inf).

    Parameters
    ----------
    x, x_prev : (n, 3) at the end and at the beginning of the substep [m]
    lists : n_active, active points, starts (n + 1,), triangles: see `PairFinder`
    surfaces : inverse_masses (n,), point_piece (n,), triangles (t, 3), triangle_piece (t,), closed (p,), gaps (p, p),
        friction (p, p): see `ContactSurfaces`
    memory : depth (n,) [m], how deep a point is inside a piece of this part; entered (n,), see `ContactMemory`;
        complete (n,) [m], the distance up to which its list of triangles is complete
    scales : limit, see `split_overlap`; near, gaps above this are not reported [m]
    part : (first, end) of the triangles to be considered: those of bodies, or those of obstacles
    stitched : starts (t + 1,) and points: those stitched to each triangle. A triangle that a point is stitched to can
        be selected as any other, but does not push the point.
    """
    n_active, active, starts, listed = lists
    w, point_piece, triangles, triangle_piece, closed, gaps, friction = surfaces
    depth, entered, complete = memory
    limit, near = scales
    contacts, smallest = 0, math.inf
    for index in range(n_active):
        p = active[index]
        mine = point_piece[p]
        i, end = starts[p], starts[p + 1]
        was_inside, depth[p] = depth[p], 0.0
        while i < end:
            its = triangle_piece[listed[i]]
            begin = i
            while i < end and triangle_piece[listed[i]] == its:
                i += 1
            if not part[0] <= listed[begin] < part[1]:
                continue
            same = mine == its
            gap = gaps[mine, its]
            held = entered[p] if same else -1
            t, where, side, distance = _select_triangle(
                x, x_prev, p, triangles, listed[begin:i], same, closed[its], held, complete[p]
            )
            if same and held >= 0 and (t < 0 or side > 0.0):
                entered[p] = -1
            if t < 0 or in_list(stitched, t, p):
                continue
            passed = distance == math.inf
            inside = closed[its] and side < 0.0 and not passed
            if inside and distance > complete[p]:
                # At this distance the sign is not reliable, unless the point was inside before.
                if was_inside > 0.0 and not same:
                    depth[p] = max(depth[p], distance)
                continue
            if not passed and not inside and distance >= gap:
                if distance < near:
                    smallest = min(smallest, distance)
                continue
            n = _direction(x, p, _corners(x, triangles, t), where, passed, side, not closed[its])
            where = _place_at_start(x_prev, p, _corners(x_prev, triangles, t), where)
            if passed and same:
                entered[p] = t
            before = _resolve(x, x_prev, w, p, t, triangles, where, n, gap, friction[mine, its], limit)
            left = dot(_relative(x, p, _corners(x, triangles, t), where), n)
            if not same and closed[its]:
                depth[p] = max(depth[p], -left)
            contacts += 1
            smallest = min(smallest, before)
    return contacts, smallest
