"""Points against triangles: of other bodies, of the same body, of triangle obstacles.

Of all triangles of a piece that are near a point, one is selected (`_select_triangle`):

1. One that the point has passed through during the substep, from outside to inside; for an open sheet, from either
   side. This detects fast points, however thin the piece is.
2. Otherwise the nearest one. The side of this triangle tells whether the point is inside a closed piece. Where several
   are equally near (at an edge or a corner), the one whose normal is closest to the direction of the point is used.
3. A point may be behind a nearby triangle of its own piece without contact: it is on the other face of a thin part. So
   within one piece, only triangles count that the point was outside of when the substep began, or has passed through.

Every point is independent of the others, so that they are distributed over the threads. The contacts that are found are
rows of `ContactRows`, which are solved afterwards in a fixed order.
"""

import math

from supple.numerics.adjacency import in_list
from supple.numerics.geometry.closest_points import area_normal, between, closest_on_triangle, combine, square_from_box
from supple.numerics.mat3 import dot, row, subtract
from supple.runtime.kernel_cache import njit, prange

# Squared distances with a relative difference below this are equal: the point is nearest to a common edge or corner.
TIE = 1e-9
# Of squared distances: the nearest place on a triangle is not looked for where its plane or its box is farther, by more
# than this, than the nearest triangle so far.
MARGIN = 1e-6


@njit
def corners_of(x, triangles, t):
    return row(x, triangles[t, 0]), row(x, triangles[t, 1]), row(x, triangles[t, 2])


@njit(forceinline=True)
def passage(p, p0, corners, corners0, both_ways):
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


@njit(forceinline=True)
def _select_triangle(x, x_prev, p, triangles, near, same, closed, entered, reach, bound):
    """The triangle for the contact of point p, the barycentric point on it, the side of p, and the distance.

    Parameters
    ----------
    near : triangles of one piece; same : whether p is a point of that piece; closed : whether it has an inside
    entered : the triangle of the same piece that p has passed through and is still behind, or -1
    reach : `near` contains all triangles up to this distance [m]; bound : farther ones are of no interest [m]

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
        most = min(bound * bound, least * (1.0 + TIE))
        corners, corners0 = corners_of(x, triangles, t), corners_of(x_prev, triangles, t)
        time, from_side, place = passage(q, q0, corners, corners0, not closed)
        if time < first:
            first, best, side, where = time, t, from_side, place
        if first <= 1.0:
            continue
        a, b, c = corners
        n = area_normal(a, b, c)
        height = dot(subtract(q, a), n)
        length = math.sqrt(dot(n, n))
        if length == 0.0 or height * height > most * length * length:
            continue
        farthest = least * (1.0 + MARGIN)
        if height * height > farthest * length * length or square_from_box(q, a, b, c) > farthest:
            continue
        if same:
            if entered >= 0:
                # Only triangles that face in the same direction as the one that the point is behind.
                u, v, w = corners_of(x, triangles, entered)
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


@njit(forceinline=True)
def direction(x, p, triangle, where, passed, side, open_sheet):
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


@njit(forceinline=True)
def enter_contact(rows, r, p, triangles, t, where, n, gap, mu):
    """Fill in the row r of a contact of point p with triangle t."""
    vertices, weights, normals, offsets, mus, _, _, active, _ = rows
    vertices[r, 0], weights[r, 0] = p, 1.0
    for i in range(3):
        vertices[r, 1 + i], weights[r, 1 + i] = triangles[t, i], -where[i]
        normals[r, i] = n[i]
    offsets[r], mus[r], active[r] = gap, mu, True


@njit(forceinline=True)
def _find_contacts_of(x, x_prev, p, runs, lists, surfaces, memory, near, part, stitched, rows):
    """The contacts of point p with the pieces near it; returns the smallest distance that is not a contact, or inf."""
    first_run, last_run = runs
    run_starts, run_rows, listed = lists
    point_piece, triangles, triangle_piece, closed, gaps, friction = surfaces
    depth, entered, complete = memory
    forces, deep = rows[5], rows[8]
    smallest = math.inf
    mine = point_piece[p]
    was_inside, depth[p] = depth[p], 0.0
    for k in range(first_run, last_run):
        begin, end = run_starts[k], run_starts[k + 1]
        if not part[0] <= listed[begin] < part[1]:
            continue
        its, e = triangle_piece[listed[begin]], run_rows[k]
        same = mine == its
        gap = gaps[mine, its]
        held = entered[p] if same else -1
        pushed = forces[e, 0] != 0.0 or forces[e, 1] != 0.0 or forces[e, 2] != 0.0
        deep[e] = False
        # Of farther triangles, only what a pair holds or has entered counts, and the smallest gap.
        bound = math.inf if pushed or same or was_inside > 0.0 else max(gap, complete[p], min(near, smallest))
        t, where, side, distance = _select_triangle(
            x, x_prev, p, triangles, listed[begin:end], same, closed[its], held, complete[p], bound
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
            if not pushed:
                continue
        n = direction(x, p, corners_of(x, triangles, t), where, passed, side, not closed[its])
        if passed and same:
            entered[p] = t
        enter_contact(rows, e, p, triangles, t, where, n, gap, friction[mine, its])
        deep[e] = not same and closed[its]
    return smallest


@njit(cache=True, parallel=True, rows=0)
def find_contacts(x, x_prev, lists, surfaces, memory, near, part, stitched, rows, smallest):
    """Find which points touch triangles now, and fill in their rows.

    Parameters
    ----------
    x, x_prev : (n, 3) at the end and at the beginning of the substep [m]
    lists : of `PieceRuns`: n_active, points, run_ranges, run_starts, run_rows, triangles
    surfaces : point_piece (n,), triangles (t, 3), triangle_piece (t,), closed (p,), gaps (p, p), friction (p, p): see
        `ContactSurfaces`
    memory : depth (n,) [m], how deep a point is inside a piece of this part; entered (n,), see `ContactMemory`;
        complete (n,) [m], the distance up to which its list of triangles is complete
    near : gaps above this are not reported [m]
    part : (first, end) of the triangles to be considered: those of bodies, or those of obstacles
    stitched : starts (t + 1,) and points: those stitched to each triangle. A triangle that a point is stitched to can
        be selected as any other, but does not push the point.
    rows : `ContactRows.described`
    smallest : (n,) out: the smallest distance without contact of each active point, or inf [m]
    """
    n_active, points, run_ranges, run_starts, run_rows, listed = lists
    for index in prange(n_active):
        runs = (run_ranges[index], run_ranges[index + 1])
        found = (run_starts, run_rows, listed)
        smallest[index] = _find_contacts_of(
            x, x_prev, points[index], runs, found, surfaces, memory, near, part, stitched, rows
        )
