"""Restoring the momentum that constraint projection takes from free bodies.

The corrections of a projection have no moment about the current positions. However, the velocity is (x - x_n) / h, so
the lever arm of angular momentum is x_n. The difference is of second order in the substep, it has a sign, and it
accumulates: a sphere that is squashed and released begins to spin. More substeps make it worse.

The remedy is applied once per substep, after the internal constraints and before contacts, to every connected component
(of bodies and stitches) that has no pinned vertex and is not stitched to an obstacle. With c and c' the centers of mass
of x_n and x, r0 = x_n - c, r = x - c', and x* the predicted positions,

    P_err = sum m (x - x*),   L_err = sum m r0 x (x - x*),   A = sum m ((r0 . r) I - r r0^T),   A th = L_err,
    x  <-  x - P_err / M - th x r.

Then sum m (x - x*) = 0 and sum m r0 x (x - x*) = 0 exactly: the substep changes neither momentum (docs/theory/xpbd.md).

Sums run over blocks of vertices that depend on the mesh only, so that they have the same bits on any number of threads.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.model.system import System
from supple.numerics.mat3 import cross, subtract
from supple.runtime.kernel_cache import njit, prange

BLOCK = 2048
# Of each block: sum m x_n (3), sum m x (3), sum m d (3), sum m x_n x d (3), sum m x x_n^T (9), with d = x - x*.
_SUMS = 21


class MomentumRestore:
    """The components of a system, and which of them are free. Bodies joined by stitches are one component.

    Rigid bodies are not members: `RigidBodies.advance` keeps their momenta.
    """

    def __init__(self, system: System) -> None:
        labels = system.joined_components
        count = int(labels.max()) + 1
        self.free = np.ones(count, dtype=np.bool_)
        self.free[labels[system.inverse_masses == 0.0]] = False
        self.free[labels[system.stitching.anchored_vertices()]] = False
        soft = np.ones(len(labels), dtype=np.bool_)
        for part in system.rigid_bodies:
            soft[part.vertices] = False
        order = np.argsort(labels, kind="stable")
        self.members = order[soft[order]].astype(np.uint32)
        ends = np.cumsum(np.bincount(labels[soft], minlength=count))
        starts = np.append(0, ends[:-1])
        self.blocks = np.array(
            [(k, lo, min(lo + BLOCK, ends[k])) for k in range(count) for lo in range(starts[k], ends[k], BLOCK)],
            dtype=np.int64,
        ).reshape(-1, 3)
        # Where vertices are welded, those with which constraints see them. What a held body holds is not free.
        given = system.masses if system.effective_masses is None else system.effective_masses
        self.masses = np.where(np.isfinite(given), given, 0.0)
        # NumPy counts nothing in integers, with weights too.
        totals = np.bincount(labels[soft], weights=self.masses[soft], minlength=count)
        self.totals = totals.astype(np.float64)
        numbers = self.members, self.blocks, self.totals, self.free
        self.arrays = self.masses, *numbers, np.zeros((len(self.blocks), _SUMS)), np.zeros((count, 9))

    def apply(
        self,
        points: NDArray[np.float64],
        previous: NDArray[np.float64],
        velocities: NDArray[np.float64],
        h: float,
    ) -> None:
        """End the internal part of a substep: v = (x - x_n) / h, and both momenta of every free component restored.

        Positions and velocities are corrected separately. Velocities derived from corrected positions would contain
        their round-off divided by h, which accumulated to 4e-9 rad/s in 60 s of free motion at 80 substeps.

        Parameters
        ----------
        points : (n, 4) positions after the internal constraints [m], in the first three columns; changed in place.
        previous : (n, 3) positions at the beginning of the substep [m].
        velocities : (n, 3) in: used to predict the positions of the substep; out: at its end [m/s].
        h : length of the substep [s].
        """
        restore_momenta(points, previous, velocities, h, *self.arrays)


@njit
def _sum_block(points, previous, velocities, h, masses, members, low, high, out):
    cx = cy = cz = 0.0
    sx = sy = sz = 0.0
    px = py = pz = 0.0
    lx = ly = lz = 0.0
    a00 = a01 = a02 = a10 = a11 = a12 = a20 = a21 = a22 = 0.0
    for k in range(low, high):
        i = members[k]
        m = masses[i]
        ox, oy, oz = previous[i, 0], previous[i, 1], previous[i, 2]
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        ux, uy, uz = x - ox, y - oy, z - oz
        dx = m * (ux - h * velocities[i, 0])
        dy = m * (uy - h * velocities[i, 1])
        dz = m * (uz - h * velocities[i, 2])
        velocities[i, 0], velocities[i, 1], velocities[i, 2] = ux / h, uy / h, uz / h
        px += dx
        py += dy
        pz += dz
        lx += oy * dz - oz * dy
        ly += oz * dx - ox * dz
        lz += ox * dy - oy * dx
        ox, oy, oz = m * ox, m * oy, m * oz
        cx += ox
        cy += oy
        cz += oz
        sx += m * x
        sy += m * y
        sz += m * z
        a00 += x * ox
        a01 += x * oy
        a02 += x * oz
        a10 += y * ox
        a11 += y * oy
        a12 += y * oz
        a20 += z * ox
        a21 += z * oy
        a22 += z * oz
    out[0], out[1], out[2] = cx, cy, cz
    out[3], out[4], out[5] = sx, sy, sz
    out[6], out[7], out[8] = px, py, pz
    out[9], out[10], out[11] = lx, ly, lz
    out[12], out[13], out[14] = a00, a01, a02
    out[15], out[16], out[17] = a10, a11, a12
    out[18], out[19], out[20] = a20, a21, a22


@njit
def _rigid_corrections(blocks, totals, sums, motion):
    """The translation, rotation vector and center of rotation of every component, from the sums of its blocks."""
    for k in range(len(motion)):
        for i in range(9):
            motion[k, i] = 0.0
    R = np.empty((3, 3))
    total = np.empty(_SUMS)
    b = 0
    while b < len(blocks):
        component = blocks[b, 0]
        M = totals[component]
        for k in range(_SUMS):
            total[k] = 0.0
        while b < len(blocks) and blocks[b, 0] == component:
            for k in range(_SUMS):
                total[k] += sums[b, k]
            b += 1
        c = (total[0] / M, total[1] / M, total[2] / M)
        P = (total[6], total[7], total[8])
        L = subtract((total[9], total[10], total[11]), cross(c, P))
        # sum m r r0^T, and from it A.
        for i in range(3):
            motion[component, i] = P[i] / M
            motion[component, 6 + i] = total[3 + i] / M
            for j in range(3):
                R[i, j] = total[12 + 3 * i + j] - M * motion[component, 6 + i] * c[j]
        trace = R[0, 0] + R[1, 1] + R[2, 2]
        x = (trace - R[0, 0], -R[0, 1], -R[0, 2])
        y = (-R[1, 0], trace - R[1, 1], -R[1, 2])
        z = (-R[2, 0], -R[2, 1], trace - R[2, 2])
        # The columns of the adjugate are cross products of the rows.
        c0, c1, c2 = cross(y, z), cross(z, x), cross(x, y)
        det = x[0] * c0[0] + x[1] * c0[1] + x[2] * c0[2]
        # Where all vertices are in a line, or the body turned over within the substep, no rotation is defined.
        if abs(det) > 1e-12 * abs(trace) ** 3:
            for i in range(3):
                motion[component, 3 + i] = (c0[i] * L[0] + c1[i] * L[1] + c2[i] * L[2]) / det


@njit
def _move_block(points, velocities, h, members, low, high, motion):
    for k in range(low, high):
        i = members[k]
        rx, ry, rz = points[i, 0] - motion[6], points[i, 1] - motion[7], points[i, 2] - motion[8]
        dx = motion[0] + (motion[4] * rz - motion[5] * ry)
        dy = motion[1] + (motion[5] * rx - motion[3] * rz)
        dz = motion[2] + (motion[3] * ry - motion[4] * rx)
        points[i, 0] -= dx
        points[i, 1] -= dy
        points[i, 2] -= dz
        velocities[i, 0] -= dx / h
        velocities[i, 1] -= dy / h
        velocities[i, 2] -= dz / h


@njit(cache=True, parallel=True, rows=0)
def restore_momenta(points, previous, velocities, h, masses, members, blocks, totals, free, sums, motion):
    for b in prange(len(blocks)):
        _sum_block(points, previous, velocities, h, masses, members, blocks[b, 1], blocks[b, 2], sums[b])
    _rigid_corrections(blocks, totals, sums, motion)
    for b in prange(len(blocks)):
        component = blocks[b, 0]
        if free[component]:
            _move_block(points, velocities, h, members, blocks[b, 1], blocks[b, 2], motion[component])
