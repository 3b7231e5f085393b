"""The parts of motions that cuts remove, and how velocities change with them; see `admit`."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.numerics.mat3 import cross, dot, row, subtract
from supple.runtime.kernel_cache import njit
from supple.solvers.xpbd.contact.bodies import has_body, push_node
from supple.solvers.xpbd.contact.levers import softness
from supple.solvers.xpbd.rigid.motion import solve_symmetric


class Cuts(NamedTuple):
    """Room for what was cut: nodes (c, 4) of pairs and tets, their rows or -1, and the shares of motion left."""

    nodes: NDArray[np.int32]
    rows: NDArray[np.int64]
    shares: NDArray[np.float64]

    @classmethod
    def room(cls, c: int) -> Cuts:
        """For c cuts."""
        return cls(np.zeros((c, 4), np.int32), np.zeros(c, np.int64), np.zeros(c))


@njit(cache=True)
def share_motion(points, movers, rows, begin, velocities, cuts, count):
    """Give back what the cuts took: the velocities of the four nodes go over to those of their common rigid motion.

    By the share that was cut. In the metric of the masses, the rigid motion is the projection of the motion, so that
    the kinetic energy does not rise; both momenta, about the places x_n, remain. Kinematic nodes give their own
    velocity to the others.
    """
    for e in range(count):
        part = 1.0 - cuts.shares[e]
        if has_body(movers.bodies, cuts.nodes, e):
            if cuts.rows[e] >= 0:
                _stop_approach(points, movers.bodies, rows, cuts.rows[e], velocities, part)
            continue
        total = cx = cy = cz = px = py = pz = 0.0
        kinematic = 0
        for i in range(4):
            v = cuts.nodes[e, i]
            kinematic += points[v, 3] == 0.0
        for i in range(4):
            v = cuts.nodes[e, i]
            if kinematic:
                m = 1.0 if points[v, 3] == 0.0 else 0.0
            else:
                m = 1.0 / points[v, 3]
            total += m
            cx, cy, cz = cx + m * begin[v, 0], cy + m * begin[v, 1], cz + m * begin[v, 2]
            px, py, pz = px + m * velocities[v, 0], py + m * velocities[v, 1], pz + m * velocities[v, 2]
        cx, cy, cz = cx / total, cy / total, cz / total
        mean = (px / total, py / total, pz / total)
        spin = (0.0, 0.0, 0.0)
        if not kinematic:
            spin = _spin(points, begin, velocities, cuts.nodes, e, (cx, cy, cz))
        for i in range(4):
            v = cuts.nodes[e, i]
            if points[v, 3] == 0.0:
                continue
            turned = cross(spin, (begin[v, 0] - cx, begin[v, 1] - cy, begin[v, 2] - cz))
            for j in range(3):
                velocities[v, j] += part * (mean[j] + turned[j] - velocities[v, j])


@njit
def keep_spin(begin, points, velocities, h, masses, labels, free, sums):
    """Give back the angular momentum that places took that have moved without a velocity, to free components.

    Velocities keep sum m x_n x v. With x = x_n + h v + e, sum m x x v differs from it by sum m e x v, which a rotation
    of the component about its center takes back.

    Parameters
    ----------
    begin, points, velocities : (n, >= 3) x_n, x and v; masses, labels : (n,) of the components (c,), `free` (c,)
    sums : (c, 13) scratch memory
    """
    sums[:] = 0.0
    for i in range(len(masses)):
        a, m = labels[i], masses[i]
        if m == 0.0 or not free[a]:
            continue
        x, v = row(points, i), row(velocities, i)
        r = subtract(x, row(begin, i))
        e = cross((r[0] - h * v[0], r[1] - h * v[1], r[2] - h * v[2]), v)
        sums[a, 0] += m
        for j in range(3):
            sums[a, 1 + j] += m * x[j]
            sums[a, 4 + j] -= m * e[j]
        sums[a, 7] += m * (x[1] * x[1] + x[2] * x[2])
        sums[a, 8] += m * (x[2] * x[2] + x[0] * x[0])
        sums[a, 9] += m * (x[0] * x[0] + x[1] * x[1])
        sums[a, 10] -= m * x[0] * x[1]
        sums[a, 11] -= m * x[1] * x[2]
        sums[a, 12] -= m * x[2] * x[0]
    for a in range(len(free)):
        M = sums[a, 0]
        if M == 0.0:
            continue
        c = (sums[a, 1] / M, sums[a, 2] / M, sums[a, 3] / M)
        S = (
            sums[a, 7] - M * (c[1] * c[1] + c[2] * c[2]),
            sums[a, 8] - M * (c[2] * c[2] + c[0] * c[0]),
            sums[a, 9] - M * (c[0] * c[0] + c[1] * c[1]),
            sums[a, 10] + M * c[0] * c[1],
            sums[a, 11] + M * c[1] * c[2],
            sums[a, 12] + M * c[2] * c[0],
        )
        spin = solve_symmetric(S, (sums[a, 4], sums[a, 5], sums[a, 6]))
        for j in range(3):
            sums[a, 1 + j], sums[a, 4 + j] = c[j], spin[j]
    for i in range(len(masses)):
        a = labels[i]
        if masses[i] > 0.0 and free[a]:
            turned = cross(
                (sums[a, 4], sums[a, 5], sums[a, 6]),
                (points[i, 0] - sums[a, 1], points[i, 1] - sums[a, 2], points[i, 2] - sums[a, 3]),
            )
            for j in range(3):
                velocities[i, j] += turned[j]


@njit
def _stop_approach(points, bodies, rows, e, velocities, part):
    """Take back a part of the approach of a row by opposite impulses; those on bodies go to their twists.

    What does not approach where the substep begins met as it turned: then a part of all relative motion is taken back.
    """
    n, relative = row(rows.normals, e), (0.0, 0.0, 0.0)
    for i in range(4):
        v = rows.nodes[e, i]
        b = bodies.body[v]
        u = row(velocities, v)
        if b >= 0:
            t = bodies.twists
            turned = cross((t[b, 3], t[b, 4], t[b, 5]), row(bodies.arms, v))
            u = (u[0] + t[b, 0] + turned[0], u[1] + t[b, 1] + turned[1], u[2] + t[b, 2] + turned[2])
        c = rows.weights[e, i]
        relative = (relative[0] + c * u[0], relative[1] + c * u[1], relative[2] + c * u[2])
    speed = dot(n, relative)
    if speed >= 0.0:
        length = math.sqrt(dot(relative, relative))
        if length > 0.0:
            n, speed = (relative[0] / length, relative[1] / length, relative[2] / length), length
            n, speed = (-n[0], -n[1], -n[2]), -speed
    soft = softness(points, bodies, rows, e, n)
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
