"""How rows act on what they push: on nodes that move freely, and on rigid bodies.

A row with weights c_i has one mover for each node, or one for all of its nodes on the same rigid body. Such a mover has
the share c = sum c_i and the arm a = sum c_i r_i: with its twist (u, th) the row's vector changes by c u + th x a, and
an impulse f of the row changes the twist by w c f and J (a x f).
"""

from __future__ import annotations

from supple.numerics.mat3 import cross, dot, row
from supple.runtime.kernel_cache import njit
from supple.solvers.xpbd.contact.bodies import has_body, turn_body

# The movers of a row's nodes that are not the numbers of bodies: the node itself, and none.
NODE, NONE = -1, -2


@njit
def set_levers(bodies, rows, e):
    """Set the movers and levers of row e by its nodes and weights."""
    rows.rigid[e] = has_body(bodies, rows.nodes, e)
    if not rows.rigid[e]:
        return
    for i in range(4):
        b = bodies.body[rows.nodes[e, i]]
        rows.movers[e, i] = b if b >= 0 else NODE
        for j in range(4):
            rows.levers[e, i, j] = 0.0
        if b < 0:
            continue
        first = i
        for k in range(i - 1, -1, -1):
            first = k if bodies.body[rows.nodes[e, k]] == b else first
        if first < i:
            rows.movers[e, i] = NONE
        c = rows.weights[e, i]
        rows.levers[e, first, 0] += c
        for j in range(3):
            rows.levers[e, first, 1 + j] += c * bodies.arms[rows.nodes[e, i], j]


@njit(inline="always")
def _arm(rows, e, i):
    return (rows.levers[e, i, 1], rows.levers[e, i, 2], rows.levers[e, i, 3])


@njit
def softness(points, bodies, rows, e, n):
    """How far n . r of row e changes by a unit of impulse along n [1/kg]."""
    total = 0.0
    for i in range(4):
        b = rows.movers[e, i] if rows.rigid[e] else NODE
        if b == NODE:
            total += points[rows.nodes[e, i], 3] * rows.weights[e, i] ** 2
        elif b >= 0:
            m, J = cross(_arm(rows, e, i), n), bodies.J
            turned = (
                J[b, 0, 0] * m[0] + J[b, 0, 1] * m[1] + J[b, 0, 2] * m[2],
                J[b, 1, 0] * m[0] + J[b, 1, 1] * m[1] + J[b, 1, 2] * m[2],
                J[b, 2, 0] * m[0] + J[b, 2, 1] * m[1] + J[b, 2, 2] * m[2],
            )
            total += bodies.w[b] * rows.levers[e, i, 0] ** 2 + dot(m, turned)
    return total


@njit(cache=True)
def hold_bodies(x, bodies, rows, count):
    """Note the part of each row's vector that nodes on bodies have before their twists: x (N, >= 3)."""
    for e in range(count):
        if not rows.rigid[e]:
            continue
        for j in range(3):
            rows.fixed[e, j] = -rows.places[e, j]
        for i in range(4):
            v, c = rows.nodes[e, i], rows.weights[e, i]
            if bodies.body[v] >= 0:
                for j in range(3):
                    rows.fixed[e, j] += c * x[v, j]


@njit
def vector(x, bodies, rows, e):
    """r of a row at places x and the twists of bodies; see `hold_bodies`."""
    if not rows.rigid[e]:
        a, b, c, d = rows.weights[e, 0], rows.weights[e, 1], rows.weights[e, 2], rows.weights[e, 3]
        p, q = row(x, rows.nodes[e, 0]), row(x, rows.nodes[e, 1])
        r, s = row(x, rows.nodes[e, 2]), row(x, rows.nodes[e, 3])
        o = row(rows.places, e)
        return (
            a * p[0] + b * q[0] + c * r[0] + d * s[0] - o[0],
            a * p[1] + b * q[1] + c * r[1] + d * s[1] - o[1],
            a * p[2] + b * q[2] + c * r[2] + d * s[2] - o[2],
        )
    out = row(rows.fixed, e)
    for i in range(4):
        b = rows.movers[e, i]
        if b >= 0:
            c, t = rows.levers[e, i, 0], bodies.twists
            turned = cross((t[b, 3], t[b, 4], t[b, 5]), _arm(rows, e, i))
            out = (
                out[0] + c * t[b, 0] + turned[0],
                out[1] + c * t[b, 1] + turned[1],
                out[2] + c * t[b, 2] + turned[2],
            )
        elif b == NODE and rows.weights[e, i] != 0.0:
            c, p = rows.weights[e, i], row(x, rows.nodes[e, i])
            out = (out[0] + c * p[0], out[1] + c * p[1], out[2] + c * p[2])
    return out


@njit
def push_row(points, bodies, rows, e, f):
    """Move what a row pushes by the impulse f on its first side and its opposite on the second."""
    for i in range(4):
        b = rows.movers[e, i] if rows.rigid[e] else NODE
        if b == NODE:
            c, v = rows.weights[e, i], rows.nodes[e, i]
            if c != 0.0:
                for j in range(3):
                    points[v, j] += points[v, 3] * (c * f[j])
        elif b >= 0 and bodies.w[b] > 0.0:
            c = bodies.w[b] * rows.levers[e, i, 0]
            for j in range(3):
                bodies.twists[b, j] += c * f[j]
            turn_body(bodies, b, cross(_arm(rows, e, i), f))
