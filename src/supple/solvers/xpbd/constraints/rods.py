"""The constraints of rods: the stretch and the cross section of each edge, and the three strains of each joint.

See `supple.materials.rods.elements` for the energies. A projection of an edge goes through its parts one after another:
its length, the place of the middle of its material points, their angle to it, and their distance. A joint is one block:
with the gradients J of its strains k, the stiffness K, and the inverse masses W of its seven vertices,

    (J W J^T + K^-1/h^2) l = -k,    dx = W J^T l.

A turn f of the second frame against the first one changes k by (1 + [k/2]x + k k^T/4) f in the first frame's axes. The
frame of an edge e with the direction u to its first material point turns by t x de/|e| across it, and about it by
d_2 . (du - (u . t) dt)/|u - (u . t) t|.

Damping. A force tau times the rate of a strain is added, against what the projections of the substep before have left:
see `constraints.shells`.

Source: Macklin, Müller, Chentanez, "XPBD" (2016), sections 3.4 and 3.5.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod

import numpy as np
from numpy.typing import NDArray

from supple.materials.rods.elements import RodElements
from supple.model.system import System
from supple.numerics.mat3 import cross, dot
from supple.runtime.kernel_cache import njit
from supple.solvers.xpbd.sweeps.groups import FLAGS, WIDTH, make_groups, put_twelve, twelve
from supple.solvers.xpbd.sweeps.ordering import Layout
from supple.solvers.xpbd.sweeps.sweep import Sweep

Floats = NDArray[np.float64]

# 1 + tr R of two frames, which is zero where two edges fold back: below this, strains are those of this.
LEAST_TRACE = 1e-2


class RodConstraints(ABC):
    """What both kinds of constraints share: strains that the next substep must know, from row `known` on."""

    sweep: Sweep
    count: int
    known: tuple[int, int]

    @abstractmethod
    def strains(self, x: Floats) -> Floats:
        """(m, k) at places x (n, 3)."""

    def begin_frame(self, x: Floats, known: Floats | None) -> None:
        """See `ElementStage`; (m, k) strains."""
        first, width = self.known
        if known is None or known.shape != (self.count, width):
            known = self.strains(x[:, :3])
        self.sweep.write(first, known)

    def begin(self, x: Floats, v: Floats, h: float) -> None:
        """See `ElementStage`."""
        return

    def memory(self) -> Floats:
        """See `ElementStage`."""
        return self.sweep.read(*self.known)

    def project(self, points: Floats, h: float) -> None:
        """See `ConstraintSet.project`."""
        self.sweep.run(points, h)


class EdgeConstraints(RodConstraints):
    """The edges of all rods; system, layout : in the solver's numbering."""

    known = 8, 1

    def __init__(self, system: System, rods: RodElements, layout: Layout) -> None:
        w = system.inverse_masses[rods.nodes]
        self._rods, self._rows = rods, np.flatnonzero((w > 0.0).any(axis=1))
        nodes, self.count = rods.nodes[self._rows], len(self._rows)
        self.work = 4 * self.count
        law = np.column_stack([rods.lengths, rods.section, rods.radius, rods.damping])
        constants = np.hstack([w, law, np.zeros((len(w), 1))])[self._rows]
        self.sweep = Sweep(_project_edges, nodes, constants, make_groups(layout, nodes))

    def strains(self, x: Floats) -> Floats:
        return self._rods.stretches(x)[self._rows, None]


class JointConstraints(RodConstraints):
    """The joints of all rods, see `EdgeConstraints`."""

    known = 31, 3

    def __init__(self, system: System, rods: RodElements, layout: Layout) -> None:
        nodes, signs = rods.joint_nodes
        w = system.inverse_masses[nodes]
        self._rods = rods
        self._rows = np.flatnonzero((w > 0.0).any(axis=1) & (rods.stiffness[:, 0] > 0.0))
        self.count = len(self._rows)
        self.work = 8 * self.count
        if self.count:
            turns = rods.turns.reshape(len(nodes), 18)
            constants = np.hstack([w, signs, turns, rods.stiffness, rods.joint_damping[:, None], 0.0 * rods.stiffness])
            nodes = np.ascontiguousarray(nodes[self._rows])
            self.sweep = Sweep(_project_joints, nodes, constants[self._rows], make_groups(layout, nodes))

    def strains(self, x: Floats) -> Floats:
        return self._rods.bends(x)[self._rows]


def rod_constraints(system: System, layout: Layout) -> list[EdgeConstraints | JointConstraints]:
    """The constraints that the rods of a system need, in the solver's numbering."""
    if system.rods is None:
        return []
    made = [kind(system, system.rods, layout) for kind in (EdgeConstraints, JointConstraints)]
    return [constraints for constraints in made if constraints.count]


@njit(fastmath=FLAGS, forceinline=True)
def _relaxed(tau, h, stiffness, metric):
    """tau/h of what a substep does not keep rigid; `metric` : sum w |grad|^2."""
    return max(tau - h, 0.0) / h / (1.0 + h * h * stiffness * metric) ** 2


@njit(fastmath=FLAGS, forceinline=True)
def _project_edges(X, data, g, h):
    """The rows of `data`: 4 inverse masses, length, stiffness of the section, radius, tau, stretch: a new one then."""
    for i in range(WIDTH):
        x0, y0, z0, x1, y1, z1, x2, y2, z2, x3, y3, z3 = twelve(X, i)
        wa, wb, wc, wd = data[g, 0, i], data[g, 1, i], data[g, 2, i], data[g, 3, i]
        rest, k, r = data[g, 4, i], data[g, 5, i], data[g, 6, i]
        soft = 1.0 / (k * h * h)
        # The length.
        ex, ey, ez = x1 - x0, y1 - y0, z1 - z0
        length = math.sqrt(ex * ex + ey * ey + ez * ez) + 1e-300
        beta, w = _relaxed(data[g, 7, i], h, k, wa + wb), wa + wb
        off = length - rest + beta * (length - rest - rest * data[g, 8, i])
        change = -off / (w * (1.0 + beta) + soft)
        data[g, 8, i] = (length + w * change) / rest - 1.0
        change /= length
        x0, y0, z0 = x0 - wa * change * ex, y0 - wa * change * ey, z0 - wa * change * ez
        x1, y1, z1 = x1 + wb * change * ex, y1 + wb * change * ey, z1 + wb * change * ez
        # The middle of the material points.
        change = -0.5 / (0.25 * (wa + wb + wc + wd) + soft)
        mx, my, mz = 0.5 * (x2 + x3 - x0 - x1), 0.5 * (y2 + y3 - y0 - y1), 0.5 * (z2 + z3 - z0 - z1)
        mx, my, mz = change * mx, change * my, change * mz
        x0, y0, z0, x1, y1, z1 = x0 - wa * mx, y0 - wa * my, z0 - wa * mz, x1 - wb * mx, y1 - wb * my, z1 - wb * mz
        x2, y2, z2, x3, y3, z3 = x2 + wc * mx, y2 + wc * my, z2 + wc * mz, x3 + wd * mx, y3 + wd * my, z3 + wd * mz
        # Their angle to the edge: a = u . t.
        ex, ey, ez = x1 - x0, y1 - y0, z1 - z0
        length = math.sqrt(ex * ex + ey * ey + ez * ez) + 1e-300
        tx, ty, tz = ex / length, ey / length, ez / length
        ux, uy, uz = 0.5 * (x2 - x3), 0.5 * (y2 - y3), 0.5 * (z2 - z3)
        a = ux * tx + uy * ty + uz * tz
        px, py, pz = (ux - a * tx) / length, (uy - a * ty) / length, (uz - a * tz) / length
        slope = (wa + wb) * (px * px + py * py + pz * pz) + 0.25 * (wc + wd)
        change = -a / (slope + soft)
        x0, y0, z0 = x0 - wa * change * px, y0 - wa * change * py, z0 - wa * change * pz
        x1, y1, z1 = x1 + wb * change * px, y1 + wb * change * py, z1 + wb * change * pz
        change *= 0.5
        x2, y2, z2 = x2 + wc * change * tx, y2 + wc * change * ty, z2 + wc * change * tz
        x3, y3, z3 = x3 - wd * change * tx, y3 - wd * change * ty, z3 - wd * change * tz
        # Their distance.
        ux, uy, uz = 0.5 * (x2 - x3), 0.5 * (y2 - y3), 0.5 * (z2 - z3)
        square = ux * ux + uy * uy + uz * uz
        change = -0.5 * (square - r * r) / (2.0 * r * r) / (0.25 * (wc + wd) * square / (r * r) + soft)
        x2, y2, z2 = x2 + wc * change * ux, y2 + wc * change * uy, z2 + wc * change * uz
        x3, y3, z3 = x3 - wd * change * ux, y3 - wd * change * uy, z3 - wd * change * uz
        put_twelve(X, i, (x0, y0, z0, x1, y1, z1, x2, y2, z2, x3, y3, z3))


@njit(fastmath=FLAGS, forceinline=True)
def _frame(e, u):
    """d_1, d_2 and t of an edge, 1/|e|, u . t and 1/|u - (u . t) t|."""
    inverse = 1.0 / (math.sqrt(dot(e, e)) + 1e-300)
    t = (e[0] * inverse, e[1] * inverse, e[2] * inverse)
    a = dot(u, t)
    n = (u[0] - a * t[0], u[1] - a * t[1], u[2] - a * t[2])
    other = 1.0 / (math.sqrt(dot(n, n)) + 1e-300)
    d = (n[0] * other, n[1] * other, n[2] * other)
    return d, cross(t, d), t, inverse, a, other


@njit(fastmath=FLAGS, forceinline=True)
def _combined(a, b, c, p, q, r):
    return (p * a[0] + q * b[0] + r * c[0], p * a[1] + q * b[1] + r * c[1], p * a[2] + q * b[2] + r * c[2])


@njit(fastmath=FLAGS, forceinline=True)
def _slopes(z, frame):
    """The derivatives by e and u of z . f, f the turn of a frame."""
    _, d, t, inverse, a, other = frame
    along = dot(z, t)
    side, s = cross(z, t), along * a * other
    of_e = ((side[0] - s * d[0]) * inverse, (side[1] - s * d[1]) * inverse, (side[2] - s * d[2]) * inverse)
    s = along * other
    return of_e, (s * d[0], s * d[1], s * d[2])


@njit(fastmath=FLAGS, forceinline=True)
def _project_joints(X, data, g, h):
    """The rows of `data`: 7 inverse masses, 2 signs, 18 of both turns, 3 stiffnesses, tau, 3 strains: new ones then.

    The vertices: the far end of the first edge, the common point, the far end of the second edge, the material points
    of the first edge, those of the second one. Signs: 1 where the first edge ends, and the second begins, at the point.
    """
    for i in range(WIDTH):
        o = (X[3, i], X[4, i], X[5, i])
        s, t = data[g, 7, i], data[g, 8, i]
        e = (s * (o[0] - X[0, i]), s * (o[1] - X[1, i]), s * (o[2] - X[2, i]))
        f = (t * (X[6, i] - o[0]), t * (X[7, i] - o[1]), t * (X[8, i] - o[2]))
        u = (0.5 * (X[9, i] - X[12, i]), 0.5 * (X[10, i] - X[13, i]), 0.5 * (X[11, i] - X[14, i]))
        v = (0.5 * (X[15, i] - X[18, i]), 0.5 * (X[16, i] - X[19, i]), 0.5 * (X[17, i] - X[20, i]))
        one, other = _frame(e, u), _frame(f, v)
        # Both frames as turned to their middle.
        a0 = _combined(one[0], one[1], one[2], data[g, 9, i], data[g, 12, i], data[g, 15, i])
        a1 = _combined(one[0], one[1], one[2], data[g, 10, i], data[g, 13, i], data[g, 16, i])
        a2 = _combined(one[0], one[1], one[2], data[g, 11, i], data[g, 14, i], data[g, 17, i])
        b0 = _combined(other[0], other[1], other[2], data[g, 18, i], data[g, 21, i], data[g, 24, i])
        b1 = _combined(other[0], other[1], other[2], data[g, 19, i], data[g, 22, i], data[g, 25, i])
        b2 = _combined(other[0], other[1], other[2], data[g, 20, i], data[g, 23, i], data[g, 26, i])
        q = 1.0 / max(1.0 + dot(a0, b0) + dot(a1, b1) + dot(a2, b2), LEAST_TRACE)
        # Half of the strains.
        k0 = q * (dot(a2, b1) - dot(a1, b2))
        k1 = q * (dot(a0, b2) - dot(a2, b0))
        k2 = q * (dot(a1, b0) - dot(a0, b1))
        # The rows of 1 + [k]x + k k^T, in space.
        z0 = _combined(a0, a1, a2, 1.0 + k0 * k0, k0 * k1 + k2, k0 * k2 - k1)
        z1 = _combined(a0, a1, a2, k0 * k1 - k2, 1.0 + k1 * k1, k1 * k2 + k0)
        z2 = _combined(a0, a1, a2, k0 * k2 + k1, k1 * k2 - k0, 1.0 + k2 * k2)
        (e0, u0), (e1, u1), (e2, u2) = _slopes(z0, one), _slopes(z1, one), _slopes(z2, one)
        (f0, v0), (f1, v1), (f2, v2) = _slopes(z0, other), _slopes(z1, other), _slopes(z2, other)
        # At the common point: -s e + -t f for the turn of the second frame less that of the first.
        p0 = (-s * e0[0] - t * f0[0], -s * e0[1] - t * f0[1], -s * e0[2] - t * f0[2])
        p1 = (-s * e1[0] - t * f1[0], -s * e1[1] - t * f1[1], -s * e1[2] - t * f1[2])
        p2 = (-s * e2[0] - t * f2[0], -s * e2[1] - t * f2[1], -s * e2[2] - t * f2[2])
        wa, wo, wb = data[g, 0, i], data[g, 1, i], data[g, 2, i]
        wu, wv = 0.25 * (data[g, 3, i] + data[g, 4, i]), 0.25 * (data[g, 5, i] + data[g, 6, i])
        m00 = wa * dot(e0, e0) + wo * dot(p0, p0) + wb * dot(f0, f0) + wu * dot(u0, u0) + wv * dot(v0, v0)
        m11 = wa * dot(e1, e1) + wo * dot(p1, p1) + wb * dot(f1, f1) + wu * dot(u1, u1) + wv * dot(v1, v1)
        m22 = wa * dot(e2, e2) + wo * dot(p2, p2) + wb * dot(f2, f2) + wu * dot(u2, u2) + wv * dot(v2, v2)
        m01 = wa * dot(e0, e1) + wo * dot(p0, p1) + wb * dot(f0, f1) + wu * dot(u0, u1) + wv * dot(v0, v1)
        m02 = wa * dot(e0, e2) + wo * dot(p0, p2) + wb * dot(f0, f2) + wu * dot(u0, u2) + wv * dot(v0, v2)
        m12 = wa * dot(e1, e2) + wo * dot(p1, p2) + wb * dot(f1, f2) + wu * dot(u1, u2) + wv * dot(v1, v2)
        B, C, tau = data[g, 27, i], data[g, 29, i], data[g, 30, i]
        beta = _relaxed(tau, h, B, max(m00, max(m11, m22)))
        r0 = 2.0 * k0 + beta * (2.0 * k0 - data[g, 31, i])
        r1 = 2.0 * k1 + beta * (2.0 * k1 - data[g, 32, i])
        r2 = 2.0 * k2 + beta * (2.0 * k2 - data[g, 33, i])
        more, soft, softer = 1.0 + beta, 1.0 / (B * h * h), 1.0 / (C * h * h)
        n00, n11, n22 = more * m00 + soft, more * m11 + soft, more * m22 + softer
        n01, n02, n12 = more * m01, more * m02, more * m12
        # By the adjugate.
        c00, c01, c02 = n11 * n22 - n12 * n12, n02 * n12 - n01 * n22, n01 * n12 - n02 * n11
        c11, c12, c22 = n00 * n22 - n02 * n02, n01 * n02 - n00 * n12, n00 * n11 - n01 * n01
        det = -1.0 / (n00 * c00 + n01 * c01 + n02 * c02)
        l0 = det * (c00 * r0 + c01 * r1 + c02 * r2)
        l1 = det * (c01 * r0 + c11 * r1 + c12 * r2)
        l2 = det * (c02 * r0 + c12 * r1 + c22 * r2)
        data[g, 31, i] = 2.0 * k0 + m00 * l0 + m01 * l1 + m02 * l2
        data[g, 32, i] = 2.0 * k1 + m01 * l0 + m11 * l1 + m12 * l2
        data[g, 33, i] = 2.0 * k2 + m02 * l0 + m12 * l1 + m22 * l2
        e, f, o = (
            _combined(e0, e1, e2, l0, l1, l2),
            _combined(f0, f1, f2, l0, l1, l2),
            _combined(p0, p1, p2, l0, l1, l2),
        )
        u, v = _combined(u0, u1, u2, l0, l1, l2), _combined(v0, v1, v2, l0, l1, l2)
        for c in range(3):
            X[c, i] += wa * s * e[c]
            X[3 + c, i] += wo * o[c]
            X[6 + c, i] += wb * t * f[c]
            X[9 + c, i] -= 0.5 * data[g, 3, i] * u[c]
            X[12 + c, i] += 0.5 * data[g, 4, i] * u[c]
            X[15 + c, i] += 0.5 * data[g, 5, i] * v[c]
            X[18 + c, i] -= 0.5 * data[g, 6, i] * v[c]
