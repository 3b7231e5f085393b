"""The loops over vertices of a cycle of damping. All sums run over one group of vertices after the other.

Each loop gets the groups' `start`, `rows` and `fields` (`VertexGroups`) and `frames` (g, 3, 3). Arrays named after rows
have one line per row of the groups; `motion` and `viscous` one per vertex.
"""

import numpy as np

from supple.runtime.kernel_cache import njit


@njit
def _turn(frame, a):
    return (
        frame[0, 0] * a[0] + frame[0, 1] * a[1] + frame[0, 2] * a[2],
        frame[1, 0] * a[0] + frame[1, 1] * a[1] + frame[1, 2] * a[2],
        frame[2, 0] * a[0] + frame[2, 1] * a[1] + frame[2, 2] * a[2],
    )


@njit
def _turn_back(frame, x, y, z):
    return (
        frame[0, 0] * x + frame[1, 0] * y + frame[2, 0] * z,
        frame[0, 1] * x + frame[1, 1] * y + frame[2, 1] * z,
        frame[0, 2] * x + frame[1, 2] * y + frame[2, 2] * z,
    )


@njit(cache=True)
def place(points, velocities, anchor_velocities, h, motion):
    """Velocities, and the positions in the middle of the last substep, at which a rotation has no rate of strain."""
    n = len(velocities)
    for i in range(len(motion)):
        for j in range(3):
            v = velocities[i, j] if i < n else anchor_velocities[i - n, j]
            motion[i, j] = points[i, j] - 0.5 * h * v
            motion[i, 3 + j] = v


@njit(cache=True)
def extrapolate(start, rows, fields, frames, motion, forces, local_forces, local_velocities, ratio):
    """f <- R f_1, and v <- v + ratio (v - R v_1) in `motion`."""
    for g in range(len(frames)):
        for k in range(start[g], start[g + 1]):
            f, v = _turn(frames[g], local_forces[k]), _turn(frames[g], local_velocities[k])
            for j in range(3):
                forces[k, j] = f[j]
                now = motion[rows[k], 3 + j]
                motion[rows[k], 3 + j] = now + ratio * (now - v[j])


@njit(cache=True)
def forget(start, rows, blocks, fast, velocities, forces, motion):
    """Begin from f = 0 and v_e = v_0 in the bodies that are `fast` (b,)."""
    for b in range(len(blocks) - 1):
        if fast[b]:
            for k in range(start[blocks[b]], start[blocks[b + 1]]):
                for j in range(3):
                    forces[k, j] = 0.0
                    motion[rows[k], 3 + j] = velocities[rows[k], j]


@njit(cache=True)
def restrict(start, rows, fields, frames, H, forces, viscous, coarse):
    """coarse <- Z^T r with r = -H (f + K v)."""
    coarse[:] = 0.0
    for g in range(len(frames)):
        for k in range(start[g], start[g + 1]):
            i = rows[k]
            local = _turn_back(
                frames[g], forces[k, 0] + viscous[i, 0], forces[k, 1] + viscous[i, 1], forces[k, 2] + viscous[i, 2]
            )
            for a in range(4):
                for j in range(3):
                    coarse[12 * g + 3 * a + j] -= H * fields[k, a] * local[j]


@njit(cache=True)
def correct(start, rows, fields, frames, blocks, H, masses, placed, forces, viscous, coarse, motion, products):
    """z <- P^-1 r with r = -H (f + K v) in `motion`, and r . z and z . M z of each group.

    `coarse` is the solution of the coarse system. The last column of `viscous` is the diagonal of
    K, `placed` (r,) that in the placed shape. Where the former is larger, the coarse part is divided by the ratio of
    their sums over the body.
    """
    local = np.empty(3)
    for b in range(len(blocks) - 1):
        now = before = 0.0
        for k in range(start[blocks[b]], start[blocks[b + 1]]):
            now += viscous[rows[k], 3]
            before += placed[k]
        share = before / now if now > before else 1.0
        for g in range(blocks[b], blocks[b + 1]):
            rz = zMz = 0.0
            for k in range(start[g], start[g + 1]):
                i = rows[k]
                for j in range(3):
                    local[j] = 0.0
                    for a in range(4):
                        local[j] += fields[k, a] * coarse[12 * g + 3 * a + j]
                z = _turn(frames[g], local)
                inverse = 1.0 / (masses[i] + H * viscous[i, 3])
                for j in range(3):
                    r = -H * (forces[k, j] + viscous[i, j])
                    value = share * z[j] + r * inverse
                    motion[i, 3 + j] = value
                    rz += r * value
                    zMz += masses[i] * value * value
            products[g, 0], products[g, 1] = rz, zMz


@njit(cache=True)
def step(start, rows, blocks, H, longest, masses, motion, products, powers, forces):
    """f += alpha M z / H with alpha = r . z / z . (M + H K) z of each body, at most `longest`.

    `powers` (b,) are z . K z, and `products` (g, 2) r . z and z . M z.
    """
    for b in range(len(blocks) - 1):
        rz = zMz = 0.0
        for g in range(blocks[b], blocks[b + 1]):
            rz += products[g, 0]
            zMz += products[g, 1]
        curvature = zMz + H * powers[b]
        if not curvature > 0.0:
            continue
        alpha = min(rz / curvature, longest)
        for k in range(start[blocks[b]], start[blocks[b + 1]]):
            factor = alpha * masses[rows[k]] / H
            for j in range(3):
                forces[k, j] += factor * motion[rows[k], 3 + j]


@njit(cache=True)
def keep(start, rows, fields, frames, velocities, forces, local_forces, local_velocities):
    """f_1 <- R^T f, v_1 <- R^T v."""
    for g in range(len(frames)):
        for k in range(start[g], start[g + 1]):
            i = rows[k]
            f = _turn_back(frames[g], forces[k, 0], forces[k, 1], forces[k, 2])
            v = _turn_back(frames[g], velocities[i, 0], velocities[i, 1], velocities[i, 2])
            for j in range(3):
                local_forces[k, j], local_velocities[k, j] = f[j], v[j]


@njit(cache=True)
def push(rows, points, forces, h):
    """x += h^2 w f."""
    for k in range(len(rows)):
        i = rows[k]
        factor = h * h * points[i, 3]
        for j in range(3):
            points[i, j] += factor * forces[k, j]
