"""The loops over vertices of a cycle of damping, group after group.

`space` is (rows, start, blocks, offsets, nodes, weights) of `CoarseSpace`. Arrays named after rows have one line per row;
`motion` (n, 10) has one per vertex: positions, velocities, K v and the mean diagonal entry of K. `frames` : (g, 3, 3).
"""

from supple.numerics.mat3 import load_mat
from supple.numerics.svd3 import svd3
from supple.runtime.kernel_cache import njit


@njit
def _turned(R, a):
    return (
        R[0] * a[0] + R[1] * a[1] + R[2] * a[2],
        R[3] * a[0] + R[4] * a[1] + R[5] * a[2],
        R[6] * a[0] + R[7] * a[1] + R[8] * a[2],
    )


@njit
def _turned_back(R, x, y, z):
    return R[0] * x + R[3] * y + R[6] * z, R[1] * x + R[4] * y + R[7] * z, R[2] * x + R[5] * y + R[8] * z


@njit(cache=True)
def place(points, velocities, anchor_velocities, h, motion):
    """Velocities, and the positions in the middle of the last substep, at which a rotation has no rate of strain."""
    n = len(velocities)
    for i in range(len(motion)):
        for j in range(3):
            v = velocities[i, j] if i < n else anchor_velocities[i - n, j]
            motion[i, j], motion[i, 3 + j] = points[i, j] - 0.5 * h * v, v
        motion[i, 6:] = 0.0


@njit(cache=True)
def turn_frames(space, motion, frames):
    """The polar factor of sum x offset^T of each group."""
    rows, start, _, offsets, _, _ = space
    for g in range(len(frames)):
        F = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        first = rows[start[g]]
        for k in range(start[g], start[g + 1]):
            i = rows[k]
            x, y, z = motion[i, 0] - motion[first, 0], motion[i, 1] - motion[first, 1], motion[i, 2] - motion[first, 2]
            u, v, w = offsets[k, 0], offsets[k, 1], offsets[k, 2]
            F = (
                F[0] + x * u,
                F[1] + x * v,
                F[2] + x * w,
                F[3] + y * u,
                F[4] + y * v,
                F[5] + y * w,
                F[6] + z * u,
                F[7] + z * v,
                F[8] + z * w,
            )
        U, _, V = svd3(F)
        for i in range(3):
            for j in range(3):
                frames[g, i, j] = U[3 * i] * V[3 * j] + U[3 * i + 1] * V[3 * j + 1] + U[3 * i + 2] * V[3 * j + 2]


@njit(cache=True)
def extrapolate(space, frames, known, local_forces, local_velocities, velocities, forces, motion):
    """f <- R f_1, and v <- v_0 + ratio (v_0 - R v_1) in `motion`; both for no last cycle where `known` (b,) is 0.

    Otherwise it is 1 + ratio.
    """
    rows, start, blocks, _, _, _ = space
    for b in range(len(known)):
        for g in range(blocks[b], blocks[b + 1]):
            R = load_mat(frames, g)
            for k in range(start[g], start[g + 1]):
                f, v, i = _turned(R, local_forces[k]), _turned(R, local_velocities[k]), rows[k]
                for j in range(3):
                    forces[k, j] = f[j] if known[b] > 0.0 else 0.0
                    change = velocities[i, j] - v[j]
                    motion[i, 3 + j] = velocities[i, j] + max(known[b] - 1.0, 0.0) * change
                motion[i, 6:] = 0.0


@njit(cache=True)
def restrict(space, frames, H, forces, motion, coarse):
    """coarse <- Z^T r with r = -H (f + K v)."""
    rows, start, _, _, nodes, weights = space
    coarse[:] = 0.0
    for g in range(len(frames)):
        R = load_mat(frames, g)
        for k in range(start[g], start[g + 1]):
            i = rows[k]
            r = _turned_back(R, forces[k, 0] + motion[i, 6], forces[k, 1] + motion[i, 7], forces[k, 2] + motion[i, 8])
            for c in range(8):
                for j in range(3):
                    coarse[nodes[k, c], j] -= H * weights[k, c] * r[j]


@njit(cache=True)
def multiply(start, inverse, vectors, out):
    """out <- A^-1 vectors of each body's nodes, (nodes, 3) each; see `CoarseSpace.inverse`."""
    at = 0
    for b in range(len(start) - 1):
        low, high = 3 * start[b], 3 * start[b + 1]
        out[low:high] = 0.0
        for i in range(low, high):
            for j in range(low, high):
                out[j] += inverse[at + j - low] * vectors[i]
            at += high - low


@njit(cache=True)
def correct(space, frames, H, masses, placed, forces, coarse, motion, products):
    """v <- z = P^-1 r with r = -H (f + K v); products (b, 2) <- r . z and z . M z; K v <- 0.

    Where K's diagonal has a larger sum over a body than `placed` (r,), that of the shape that the scene places, the
    coarse part is divided by the ratio.
    """
    rows, start, blocks, _, nodes, weights = space
    for b in range(len(products)):
        now = before = rz = zMz = 0.0
        for k in range(start[blocks[b]], start[blocks[b + 1]]):
            now += motion[rows[k], 9]
            before += placed[k]
        share = before / now if now > before else 1.0
        for g in range(blocks[b], blocks[b + 1]):
            R = load_mat(frames, g)
            for k in range(start[g], start[g + 1]):
                x = y = z = 0.0
                for c in range(8):
                    n, w = nodes[k, c], share * weights[k, c]
                    x, y, z = x + w * coarse[n, 0], y + w * coarse[n, 1], z + w * coarse[n, 2]
                u, i = _turned(R, (x, y, z)), rows[k]
                inverse = 1.0 / (masses[i] + H * motion[i, 9])
                for j in range(3):
                    r = -H * (forces[k, j] + motion[i, 6 + j])
                    value = u[j] + inverse * r
                    rz += r * value
                    zMz += masses[i] * value * value
                    motion[i, 3 + j] = value
                motion[i, 6:] = 0.0
        products[b, 0], products[b, 1] = rz, zMz


@njit(cache=True)
def step(space, frames, H, masses, longest, share, products, velocities, motion, forces, local_forces, local_velocities):
    """f += alpha M z / H with alpha = r . z / z . (M + H K) z of each body, at most `longest`; f_1 <- f, v_1 <- v.

    K z is the sum over so many of the elements that `share` (b,) of it is the whole.
    """
    rows, start, blocks, _, _, _ = space
    for b in range(len(products)):
        zKz = 0.0
        for k in range(start[blocks[b]], start[blocks[b + 1]]):
            i = rows[k]
            zKz += motion[i, 3] * motion[i, 6] + motion[i, 4] * motion[i, 7] + motion[i, 5] * motion[i, 8]
        curvature = products[b, 1] + H * share[b] * zKz
        alpha = min(products[b, 0] / curvature, longest) if curvature > 0.0 else 0.0
        for g in range(blocks[b], blocks[b + 1]):
            R = load_mat(frames, g)
            for k in range(start[g], start[g + 1]):
                i = rows[k]
                for j in range(3):
                    forces[k, j] += alpha * masses[i] / H * motion[i, 3 + j]
                f = _turned_back(R, forces[k, 0], forces[k, 1], forces[k, 2])
                v = _turned_back(R, velocities[i, 0], velocities[i, 1], velocities[i, 2])
                for j in range(3):
                    local_forces[k, j], local_velocities[k, j] = f[j], v[j]


@njit(cache=True)
def push(rows, points, forces, h):
    """x += h^2 w f."""
    for k in range(len(rows)):
        factor = h * h * points[rows[k], 3]
        for j in range(3):
            points[rows[k], j] += factor * forces[k, j]
