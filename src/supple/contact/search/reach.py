"""How far vertices may move before the lists of what is near them must be renewed."""

import math

import numpy as np

from supple.numerics.kernel_cache import njit


@njit(cache=True)
def any_beyond_reach(x, x_gathered, reach):
    """Whether some vertex is farther than its reach (n,) from where it was."""
    for i in range(len(x)):
        a, b, c = x[i, 0] - x_gathered[i, 0], x[i, 1] - x_gathered[i, 1], x[i, 2] - x_gathered[i, 2]
        # The negated form is also true for positions that are not finite.
        if not a * a + b * b + c * c <= reach[i] * reach[i]:
            return True
    return False


@njit(cache=True)
def mean_motions(motions, pieces, all_share, out):
    """Mean of the motions (n, 3) of each piece; the last row is the mean of all points, or zero unless `all_share`."""
    out[:] = 0.0
    counts = np.zeros(len(out))
    for i in range(len(motions)):
        counts[pieces[i]] += 1.0
        for j in range(3):
            out[pieces[i], j] += motions[i, j]
    if all_share:
        for k in range(len(out) - 1):
            counts[-1] += counts[k]
            for j in range(3):
                out[-1, j] += out[k, j]
    for k in range(len(out)):
        for j in range(3):
            out[k, j] /= max(1.0, counts[k])


@njit(cache=True)
def search_radii(motions, moved, excursions, pieces, drifts, scales, far, near):
    """How far points may move, from their velocities: the arguments `far` and `near` of `PairFinder.gather`.

    Parameters
    ----------
    motions : (n, 3) expected motion: velocity times the time ahead [m]
    moved : (n, 3) motion since the beginning of the substep [m]
    excursions : (n,) largest motion of a point in a substep before contact stopped it [m]
    pieces : (n,)
    drifts : (p + 1, 3) common motion of each piece; in the last row the common motion of all points [m]
    scales : least [m], most (n,) [m]
    far, near : (n, 3) the search radius of a point, without the gap; how far it may move a triangle; and how far it may
        move before the search must be repeated. `near` is relative to the motion of its piece [m]
    """
    least, most = scales
    for i in range(len(motions)):
        k = pieces[i]
        absolute = relative = path = 0.0
        for j in range(3):
            absolute += (motions[i, j] - drifts[-1, j]) ** 2
            relative += (motions[i, j] - drifts[k, j]) ** 2
            path += moved[i, j] ** 2
        path = math.sqrt(path)
        strain = min(2.0 * most[i], excursions[i])
        a = strain + min(most[i], least + 1.2 * math.sqrt(absolute))
        b = strain + min(most[i], least + 1.2 * math.sqrt(relative))
        far[i, 0], far[i, 1], far[i, 2] = a + path, a + path, a
        near[i, 0], near[i, 1], near[i, 2] = b + path, b + path, b


@njit(cache=True)
def any_beyond_radii(x, x_prev, x_gathered, far, near, pieces, all_share, drifts, excursions):
    """Whether some point has moved farther than `search_radii` allowed, absolutely or relative to its piece.

    Parameters
    ----------
    x, x_prev, x_gathered : (n, 3) now, at the beginning of the substep, and when lists were made [m]
    far, near : from `search_radii`; pieces : (n,); all_share : see `mean_motions`
    drifts : (p + 1, 3) scratch memory, see `mean_motions`
    excursions : (n,) increased to the motion of each point within this substep, where that is larger [m]
    """
    for i in range(len(x)):
        square = 0.0
        for j in range(3):
            square += (x[i, j] - x_prev[i, j]) ** 2
        excursions[i] = max(excursions[i], math.sqrt(square))
    moved = x - x_gathered
    mean_motions(moved, pieces, all_share, drifts)
    for i in range(len(x)):
        k = pieces[i]
        absolute = relative = 0.0
        for j in range(3):
            absolute += (moved[i, j] - drifts[-1, j]) ** 2
            relative += (moved[i, j] - drifts[k, j]) ** 2
        # The negated form is also true for positions that are not finite.
        if not (absolute <= far[i, 2] ** 2 and relative <= near[i, 2] ** 2):
            return True
    return False


@njit(cache=True)
def left_ways(begin, end, points, distance):
    """Whether some of the points (n, 3) is farther than a distance from its way, straight from begin to end (n, 3)."""
    for i in range(len(points)):
        along = length = 0.0
        for j in range(3):
            way = end[i, j] - begin[i, j]
            along += (points[i, j] - begin[i, j]) * way
            length += way * way
        share = min(1.0, max(0.0, along / length)) if length > 0.0 else 0.0
        square = 0.0
        for j in range(3):
            square += (points[i, j] - begin[i, j] - share * (end[i, j] - begin[i, j])) ** 2
        if not square <= distance * distance:
            return True
    return False
