"""The loops over vertices of a cycle of damping, group after group.

`space` is (rows, start, blocks, offsets, nodes, weights) of `CoarseSpace`. Forces and f_1, v_1 have one line per row;
`motion` (n, 10) has one per vertex: positions, velocities, K v and the mean diagonal entry of K. `frames` : (g, 3, 3).
"""

from supple.numerics.mat3 import dot, load_mat, mat_mul_transposed, store_mat
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


@njit
def _frame(low, high, rows, offsets, motion):
    """The polar factor of sum x offset^T."""
    a00 = a01 = a02 = a10 = a11 = a12 = a20 = a21 = a22 = 0.0
    first = rows[low]
    for k in range(low, high):
        i = rows[k]
        x, y, z = motion[i, 0] - motion[first, 0], motion[i, 1] - motion[first, 1], motion[i, 2] - motion[first, 2]
        u, v, w = offsets[k, 0], offsets[k, 1], offsets[k, 2]
        a00, a01, a02 = a00 + x * u, a01 + x * v, a02 + x * w
        a10, a11, a12 = a10 + y * u, a11 + y * v, a12 + y * w
        a20, a21, a22 = a20 + z * u, a21 + z * v, a22 + z * w
    U, _, V = svd3((a00, a01, a02, a10, a11, a12, a20, a21, a22))
    return mat_mul_transposed(U, V)


@njit
def _strain(R, low, high, rows, offsets, velocities, before):
    """The square of how much the velocity relative to the group's has changed, per size of the group [1/s^2]."""
    x = y = z = squares = size = 0.0
    for k in range(low, high):
        v, i = _turned(R, before[k]), rows[k]
        u = velocities[i, 0] - v[0], velocities[i, 1] - v[1], velocities[i, 2] - v[2]
        x, y, z, squares = x + u[0], y + u[1], z + u[2], squares + dot(u, u)
        size += offsets[k, 0] ** 2 + offsets[k, 1] ** 2 + offsets[k, 2] ** 2
    squares -= (x * x + y * y + z * z) / (high - low)
    return squares / size if size > 0.0 else 0.0


@njit(cache=True)
def begin(space, velocities, limits, last, frames, forces, motion):
    """f <- R f_1, and v <- v_0 + ratio (v_0 - R v_1) in `motion`.

    Where rates of strain have changed so much that f_1 and v_1 are not guesses, f <- 0 and v <- v_0 in the body.

    Parameters
    ----------
    limits : the ratio, and the largest change of rates [1/s]
    last : f_1 and v_1, in the frames
    """
    rows, start, blocks, offsets, _, _ = space
    ratio, largest = limits
    for b in range(len(blocks) - 1):
        known = True
        for g in range(blocks[b], blocks[b + 1]):
            R = _frame(start[g], start[g + 1], rows, offsets, motion)
            store_mat(R, frames, g)
            if ratio > 0.0:
                known &= _strain(R, start[g], start[g + 1], rows, offsets, velocities, last[1]) < largest**2
        for g in range(blocks[b], blocks[b + 1]):
            R = load_mat(frames, g)
            for k in range(start[g], start[g + 1]):
                f, v, i = _turned(R, last[0][k]), _turned(R, last[1][k]), rows[k]
                for j in range(3):
                    forces[k, j] = f[j] if known else 0.0
                    motion[i, 3 + j] += ratio * (velocities[i, j] - v[j]) if known else 0.0


@njit(cache=True)
def restrict(space, frames, H, forces, motion, coarse):
    """coarse (3 nodes,) <- Z^T r with r = -H (f + K v)."""
    rows, start, _, _, nodes, weights = space
    coarse[:] = 0.0
    for g in range(len(frames)):
        R = load_mat(frames, g)
        for k in range(start[g], start[g + 1]):
            i = rows[k]
            x, y, z = forces[k, 0] + motion[i, 6], forces[k, 1] + motion[i, 7], forces[k, 2] + motion[i, 8]
            r = _turned_back(R, -H * x, -H * y, -H * z)
            for c in range(8):
                n, w = 3 * nodes[k, c], weights[k, c]
                coarse[n], coarse[n + 1], coarse[n + 2] = (
                    coarse[n] + w * r[0],
                    coarse[n + 1] + w * r[1],
                    coarse[n + 2] + w * r[2],
                )


@njit
def _multiply(begin, end, at, inverse, vector, out):
    """out <- A^-1 vector in the numbers `begin` to `end`; returns where the next matrix begins."""
    count, part = end - begin, out[begin:end]
    part[:] = 0.0
    for i in range(begin, end):
        row, factor = inverse[at : at + count], vector[i]
        for j in range(count):
            part[j] += factor * row[j]
        at += count
    return at


@njit(cache=True)
def correct(space, frames, H, masses, matrices, restricted, coarse, forces, motion, products):
    """v <- z_c = Z (Z^T (M + H K_0) Z)^-1 Z^T r in `motion`; products (b, 2) <- r . z_c and z_c . M z_c.

    f <- f - M z / H with the other part z = diag(m + H k)^-1 r, times `matrices[2]`, the longest step.
    K v <- 0.

    Parameters
    ----------
    matrices : first number of each body's nodes, the inverses, the longest step
    """
    rows, start, blocks, _, nodes, weights = space
    numbers, inverses, longest = matrices
    at = 0
    for b in range(len(products)):
        at = _multiply(numbers[b], numbers[b + 1], at, inverses, restricted, coarse)
        rz = zMz = 0.0
        for g in range(blocks[b], blocks[b + 1]):
            R = load_mat(frames, g)
            for k in range(start[g], start[g + 1]):
                i, x, y, z = rows[k], 0.0, 0.0, 0.0
                for c in range(8):
                    n, w = 3 * nodes[k, c], weights[k, c]
                    x, y, z = x + w * coarse[n], y + w * coarse[n + 1], z + w * coarse[n + 2]
                u = _turned(R, (x, y, z))
                factor = longest * masses[i] / (masses[i] + H * motion[i, 9])
                for j in range(3):
                    r = forces[k, j] + motion[i, 6 + j]
                    rz -= H * r * u[j]
                    zMz += masses[i] * u[j] * u[j]
                    forces[k, j] -= factor * r
                    motion[i, 3 + j], motion[i, 6 + j] = u[j], 0.0
        products[b, 0], products[b, 1] = rz, zMz


@njit(cache=True)
def step(space, frames, H, masses, longest, share, products, velocities, motion, forces, last):
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
        alpha = longest * min(products[b, 0] / curvature, 1.0) if curvature > 0.0 else 0.0
        for g in range(blocks[b], blocks[b + 1]):
            R = load_mat(frames, g)
            for k in range(start[g], start[g + 1]):
                i = rows[k]
                for j in range(3):
                    forces[k, j] += alpha * masses[i] / H * motion[i, 3 + j]
                f = _turned_back(R, forces[k, 0], forces[k, 1], forces[k, 2])
                v = _turned_back(R, velocities[i, 0], velocities[i, 1], velocities[i, 2])
                for j in range(3):
                    last[0][k, j], last[1][k, j] = f[j], v[j]


@njit(cache=True)
def push(rows, points, forces, h):
    """x += h^2 w f."""
    for k in range(len(rows)):
        factor = h * h * points[rows[k], 3]
        for j in range(3):
            points[rows[k], j] += factor * forces[k, j]
