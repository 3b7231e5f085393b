"""The solution of the rows: Gauss-Seidel sweeps with accumulated impulses, until what a sweep changes is small.

Each row keeps its impulse f. A sweep sets the part along n to max(0, what makes n . r the target), and the part across
n to what takes back the slip, not longer than the friction coefficient times the first. Both sides get opposite
impulses. The part across acts at two places that are d n apart, and a couple on the nodes takes its moment back.

Source: Catto, "Iterative Dynamics with Temporal Coherence" (2005), section 6.
"""

from __future__ import annotations

import math

from supple.numerics.mat3 import cross, dot, row, subtract
from supple.runtime.kernel_cache import njit
from supple.solvers.xpbd.contact.bodies import push_node, turn_body
from supple.solvers.xpbd.contact.islands import island_of
from supple.solvers.xpbd.contact.levers import push_row, softness, vector
from supple.solvers.xpbd.contact.pairs import SHAPE, facing, is_loaded, weights_of


@njit
def _turn(out, scale, points, bodies, begin, nodes, e, moment):
    """Put a couple with this moment about x_n on a rigid body, or on the four nodes, if all of them can move.

    out : (N, >= 3) places, or velocities, that change by the displacements times `scale`
    """
    for i in range(4):
        b = bodies.body[nodes[e, i]]
        if b >= 0:
            turn_body(bodies, b, moment)
            return
    cx = cy = cz = 0.0
    for i in range(4):
        v = nodes[e, i]
        if points[v, 3] == 0.0:
            return
        cx, cy, cz = cx + 0.25 * begin[v, 0], cy + 0.25 * begin[v, 1], cz + 0.25 * begin[v, 2]
    xx = yy = zz = xy = yz = zx = 0.0
    for i in range(4):
        v = nodes[e, i]
        a, b, d = begin[v, 0] - cx, begin[v, 1] - cy, begin[v, 2] - cz
        xx += b * b + d * d
        yy += a * a + d * d
        zz += a * a + b * b
        xy -= a * b
        yz -= b * d
        zx -= d * a
    first, second, third = (xx, xy, zx), (xy, yy, yz), (zx, yz, zz)
    one, two, three = cross(second, third), cross(third, first), cross(first, second)
    det = dot(first, one)
    # Nodes in a line have no moment about it.
    if not det > 1e-9 * (0.5 * (xx + yy + zz)) ** 3:
        return
    th = (dot(one, moment) / det, dot(two, moment) / det, dot(three, moment) / det)
    for i in range(4):
        v = nodes[e, i]
        d = cross(th, (begin[v, 0] - cx, begin[v, 1] - cy, begin[v, 2] - cz))
        for j in range(3):
            out[v, j] += scale * points[v, 3] * d[j]


@njit
def solve(points, bodies, begin, rows, count, islands, tolerances, most):
    """Sweep over the rows of each active island until no sweep changes an n . r by more than its tolerance.

    tolerances : in gaps, and of rows on rigid bodies also [m]
    most : the largest number of sweeps of islands without and with rigid bodies

    Returns the number of sweeps, and the largest change in the last one of any island, in gaps.
    """
    sweeps, some, largest = 0, count > 0, 0.0
    for p in range(len(islands.swept)):
        islands.swept[p] = islands.active[p]
        islands.residual[p] = islands.changes[p] = 0.0
    while some:
        sweeps += 1
        for p in range(len(islands.swept)):
            if islands.swept[p]:
                islands.residual[p] = islands.changes[p] = 0.0
        for e in range(count):
            mass = rows.masses[e]
            if mass == 0.0:
                continue
            island = island_of(points, rows, e, islands)
            if not islands.swept[island]:
                continue
            n, f = row(rows.normals, e), row(rows.impulses, e)
            r = vector(points, bodies, rows, e)
            s, before = dot(n, r), dot(f, n)
            push = max(0.0, before + (rows.targets[e] - s) * mass)
            if push == 0.0 and before == 0.0:
                continue
            moved = abs(push - before) / mass
            islands.residual[island] = max(islands.residual[island], moved / rows.gaps[e])
            if rows.rigid[e]:
                islands.changes[island] = max(islands.changes[island], moved)
            held = (f[0] - before * n[0], f[1] - before * n[1], f[2] - before * n[2])
            slip = (r[0] - s * n[0], r[1] - s * n[1], r[2] - s * n[2])
            if rows.friction[e] > 0.0 and rows.rigid[e]:
                # A rigid body answers differently along the surface; the direction of the first slip stands for all.
                length = math.sqrt(dot(slip, slip))
                if rows.across[e] == 0.0 and length > 0.0:
                    along = (slip[0] / length, slip[1] / length, slip[2] / length)
                    rows.across[e] = 1.0 / softness(points, bodies, rows, e, along)
                mass = rows.across[e]
            t = (held[0] - slip[0] * mass, held[1] - slip[1] * mass, held[2] - slip[2] * mass)
            size, limit = math.sqrt(dot(t, t)), rows.friction[e] * push
            share = limit / size if size > limit else 1.0
            t = (share * t[0], share * t[1], share * t[2])
            new = (push * n[0] + t[0], push * n[1] + t[1], push * n[2] + t[2])
            push_row(points, bodies, rows, e, subtract(new, f))
            if rows.kinds[e] != SHAPE:
                m, d = cross(n, subtract(t, held)), rows.distances[e]
                if m[0] != 0.0 or m[1] != 0.0 or m[2] != 0.0:
                    _turn(points, 1.0, points, bodies, begin, rows.nodes, e, (-d * m[0], -d * m[1], -d * m[2]))
            for j in range(3):
                rows.impulses[e, j] = new[j]
        some, largest = False, 0.0
        for p in range(len(islands.swept)):
            stiff = islands.stiff[p]
            open_ = islands.residual[p] > tolerances[0] or (stiff and islands.changes[p] > tolerances[1])
            islands.swept[p] = islands.swept[p] and open_ and sweeps < most[1 if stiff else 0]
            some = some or islands.swept[p]
            largest = max(largest, islands.residual[p])
    return sweeps, largest


@njit
def push_kept(points, begin, bodies, velocities, near, pairs, walls, faces, h):
    """Begin a substep with the kept impulses, along the normals at x_n; impulses of pairs that do not push are zero.

    points : (N, 4), of which the inverse masses are used; begin : (N, 3) x_n
    """
    shape = len(near) - len(walls.gaps)
    for m in range(len(near)):
        k = near[m]
        if not is_loaded(pairs.impulses, k):
            continue
        if pairs.kinds[k] == SHAPE:
            d, n = walls.gaps[m - shape], row(walls.normals, m - shape)
        else:
            _, n, d = facing(begin, pairs, k, faces)
        f, old = row(pairs.impulses, k), row(pairs.normals, k)
        if d > 2.0 * pairs.gaps[k] or dot(n, old) < 0.5:
            pairs.impulses[k, :] = 0.0
            continue
        push = dot(f, old)
        t = (f[0] - push * old[0], f[1] - push * old[1], f[2] - push * old[2])
        push -= dot(t, n)
        for j in range(3):
            pairs.impulses[k, j] = push * n[j] + t[j]
            pairs.normals[k, j] = n[j]
    # Velocities change only here; the places are those of x_n throughout.
    for k in near:
        if not is_loaded(pairs.impulses, k):
            continue
        c = (1.0, 0.0, 0.0, 0.0)
        if pairs.kinds[k] != SHAPE:
            c, _ = weights_of(begin, pairs.nodes, k, pairs.kinds[k])
        for i in range(4):
            v, g = pairs.nodes[k, i], c[i]
            f = (g * pairs.impulses[k, 0], g * pairs.impulses[k, 1], g * pairs.impulses[k, 2])
            if bodies.body[v] >= 0:
                push_node(points, bodies, v, f)
                continue
            for j in range(3):
                velocities[v, j] += points[v, 3] * f[j] / h
        if pairs.kinds[k] != SHAPE:
            _, _, d = facing(begin, pairs, k, faces)
            m = cross(row(pairs.normals, k), row(pairs.impulses, k))
            if m[0] != 0.0 or m[1] != 0.0 or m[2] != 0.0:
                _turn(velocities, 1.0 / h, points, bodies, begin, pairs.nodes, k, (-d * m[0], -d * m[1], -d * m[2]))


@njit
def keep_impulses(rows, count, velocities, h, rates, near, pairs):
    """Keep what the next substep begins with: not what stopped the approach with which this one began.

    Parameters
    ----------
    velocities : (N, 3) at the beginning of the substep; rates : (N,) see `response_rates`
    """
    for k in near:
        pairs.impulses[k, :] = 0.0
    for e in range(count):
        if rows.masses[e] == 0.0:
            continue
        n, f = row(rows.normals, e), row(rows.impulses, e)
        push = dot(f, n)
        if not push > 0.0:
            continue
        speed, kappa, total = 0.0, 0.0, 0.0
        for i in range(4):
            v, c = rows.nodes[e, i], rows.weights[e, i]
            speed += c * dot(n, row(velocities, v))
            kappa += abs(c) * rates[v]
            total += abs(c)
        approach = max(0.0, -h * speed - max(0.0, rows.distances[e] - rows.targets[e]))
        share = max(0.0, 1.0 - approach * rows.masses[e] / push) / (1.0 + h * h * kappa / total)
        for j in range(3):
            pairs.impulses[rows.pairs[e], j] = share * f[j]
