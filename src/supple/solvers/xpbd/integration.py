"""The parts of a substep around the constraints: prediction, velocities, and conversion to world coordinates.

Within a frame all coordinates are relative to one origin, near the middle of the scene. Positions far from the world's
origin have few digits left for the small differences that give velocities: at 100 m, a substep of 0.2 ms turns the
round-off of a position into 7e-11 m/s.
"""

import numpy as np

from supple.runtime.kernel_cache import njit, prange

BLOCK = 4096
# Positions beyond this distance [m] are lost, finite or not: round-off is a tenth of a millimetre there.
FARTHEST = 1e12


@njit
def _predict_block(points, previous, velocities, gravity, h, low, high):
    gx, gy, gz = h * gravity[0], h * gravity[1], h * gravity[2]
    for i in range(low, high):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        previous[i, 0], previous[i, 1], previous[i, 2] = x, y, z
        if points[i, 3] > 0.0:
            vx, vy, vz = velocities[i, 0] + gx, velocities[i, 1] + gy, velocities[i, 2] + gz
            velocities[i, 0], velocities[i, 1], velocities[i, 2] = vx, vy, vz
            points[i, 0], points[i, 1], points[i, 2] = x + h * vx, y + h * vy, z + h * vz


@njit(cache=True, parallel=True, rows=0)
def predict(points, previous, velocities, gravity, h, count):
    """Begin a substep of the first `count` rows: x_n = x, v += h g, x += h v.

    Parameters
    ----------
    points : (n, 4) positions [m] and inverse masses [1/kg]; where the inverse mass is 0, a pin sets the position.
    previous, velocities : (n, 3) [m], [m/s]
    gravity : (3,) [m/s^2]
    h : length of the substep [s]
    """
    for block in prange((count + BLOCK - 1) // BLOCK):
        low = block * BLOCK
        _predict_block(points, previous, velocities, gravity, h, low, min(low + BLOCK, count))


@njit(cache=True)
def update_velocities(points, previous, velocities, h, count):
    """v = (x - x_n) / h, of the first `count` rows."""
    for i in range(count):
        for j in range(3):
            velocities[i, j] = (points[i, j] - previous[i, j]) / h


@njit(cache=True)
def first_lost(points, velocities, count):
    """The first of `count` rows whose position or velocity is not finite, or is beyond `FARTHEST`; or -1."""
    for i in range(count):
        for j in range(3):
            if not (abs(points[i, j]) <= FARTHEST and np.isfinite(velocities[i, j])):
                return i
    return -1


@njit(cache=True)
def hold(points, vertices, targets, origins):
    """Put pinned vertices (k,) at `targets` (k, 3) in world coordinates."""
    for k in range(len(vertices)):
        i = vertices[k]
        for j in range(3):
            points[i, j] = targets[k, j] - origins[i, j]


@njit(cache=True)
def to_world(points, origins, world):
    """World positions (n, 3) of points (n, 3 or 4) about origins (n, 3). Returns whether none is beyond `FARTHEST`."""
    good = True
    for i in range(len(world)):
        for j in range(3):
            world[i, j] = origins[i, j] + points[i, j]
            good = good and abs(world[i, j]) <= FARTHEST
    return good
