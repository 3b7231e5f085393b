"""How far vertices may move before the lists of what is near them must be renewed."""

import math

import numpy as np

from supple.numerics.mat3 import mat_mul_transposed, row, subtract
from supple.numerics.svd3 import svd3
from supple.runtime.kernel_cache import njit


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
def common_motions(points, motions, pieces, all_share, each, common):
    """The motion of each piece as a rigid body, nearest to the motions (n, 3) of its points (n, 3).

    Parameters
    ----------
    pieces : (n,); each : only every so many of the points are asked
    all_share : whether the mean motion of all points is common to them; otherwise it counts as zero
    common : drifts (p + 1, 3), centers (p, 3) and turns (p, 3, 3), set here: point X of piece k moves by
        drifts[k] + turns[k] (X - centers[k]); drifts[-1] is the mean motion of all points
    """
    drifts, centers, turns = common
    counts = np.zeros(len(drifts))
    for k in range(len(drifts)):
        for j in range(3):
            drifts[k, j] = 0.0
            if k < len(centers):
                centers[k, j] = 0.0
    for i in range(0, len(motions), each):
        k = pieces[i]
        counts[k] += 1.0
        for j in range(3):
            drifts[k, j] += motions[i, j]
            centers[k, j] += points[i, j]
    if all_share:
        for k in range(len(drifts) - 1):
            counts[-1] += counts[k]
            for j in range(3):
                drifts[-1, j] += drifts[k, j]
    for k in range(len(drifts)):
        for j in range(3):
            drifts[k, j] /= max(1.0, counts[k])
            if k < len(centers):
                centers[k, j] /= max(1.0, counts[k])
    _turn(points, motions, pieces, each, drifts, centers, turns)


@njit
def _turn(points, motions, pieces, each, drifts, centers, turns):
    """Set each turn to Q - 1, with Q the polar factor of sum (X + u - mean) (X - center)^T."""
    for k in range(len(turns)):
        for r in range(3):
            for c in range(3):
                turns[k, r, c] = 0.0
    for i in range(0, len(motions), each):
        k = pieces[i]
        X = subtract(row(points, i), row(centers, k))
        for r in range(3):
            moved = X[r] + motions[i, r] - drifts[k, r]
            for c in range(3):
                turns[k, r, c] += moved * X[c]
    for k in range(len(turns)):
        A = turns[k]
        U, _, V = svd3((A[0, 0], A[0, 1], A[0, 2], A[1, 0], A[1, 1], A[1, 2], A[2, 0], A[2, 1], A[2, 2]))
        Q = mat_mul_transposed(U, V)
        for r in range(3):
            for c in range(3):
                turns[k, r, c] = Q[3 * r + c] - (r == c)


@njit
def _relative_squares(points, motions, i, k, common):
    """The squares of the motion of point i of piece k, less that common to all, and less that of the piece."""
    drifts, centers, turns = common
    X = subtract(row(points, i), row(centers, k))
    absolute = relative = 0.0
    for r in range(3):
        turned = turns[k, r, 0] * X[0] + turns[k, r, 1] * X[1] + turns[k, r, 2] * X[2]
        absolute += (motions[i, r] - drifts[-1, r]) ** 2
        relative += (motions[i, r] - drifts[k, r] - turned) ** 2
    return absolute, relative


@njit(cache=True)
def search_radii(points, motions, moved, excursions, pieces, common, scales, far, near):
    """How far points may move, from their velocities: the arguments `far` and `near` of `PairFinder.gather`.

    Parameters
    ----------
    points : (n, 3) [m]; motions : (n, 3) expected motion: velocity times the time ahead [m]
    moved : (n, 3) motion since the beginning of the substep [m]
    excursions : (n,) largest motion of a point in a substep before contact stopped it [m]
    pieces : (n,); common : of these motions, see `common_motions`
    scales : least [m], most (n,) [m]
    far, near : (n, 3) the search radius of a point, without the gap; how far it may move a triangle; and how far it may
        move before the search must be repeated. `near` is relative to the motion of its piece as a rigid body, which
        changes no distance in it [m]
    """
    least, most = scales
    for i in range(len(motions)):
        absolute, relative = _relative_squares(points, motions, i, pieces[i], common)
        path = math.sqrt(moved[i, 0] ** 2 + moved[i, 1] ** 2 + moved[i, 2] ** 2)
        strain = min(2.0 * most[i], excursions[i])
        a = strain + min(most[i], least + 1.2 * math.sqrt(absolute))
        b = strain + min(most[i], least + 1.2 * math.sqrt(relative))
        far[i, 0], far[i, 1], far[i, 2] = a + path, a + path, a
        near[i, 0], near[i, 1], near[i, 2] = b + path, b + path, b


def any_beyond_radii(x, x_prev, x_gathered, far, near, pieces, all_share, each, common, excursions) -> bool:
    """Whether some point has moved farther than `search_radii` allowed, absolutely or relative to its piece.

    Parameters
    ----------
    x, x_prev, x_gathered : (n, 3) now, at the beginning of the substep, and when lists were made [m]
    far, near : from `search_radii`; pieces : (n,); all_share, each : see `common_motions`
    common : scratch memory, see `common_motions`
    excursions : (n,) increased to the motion of each point within this substep, where that is larger [m]
    """
    # What moves less than its radii allow does so relative to anything that is at rest, too.
    if not _any_beyond(x, x_prev, x_gathered, far, near, excursions):
        return False
    moved = x - x_gathered
    # No distance depends on which motions are taken for common.
    common_motions(x_gathered, moved, pieces, all_share, each, common)
    return _any_beyond_relative(x_gathered, moved, far, near, pieces, common)


@njit(cache=True)
def _any_beyond(x, x_prev, x_gathered, far, near, excursions):
    far_enough = False
    for i in range(len(x)):
        square = total = 0.0
        for j in range(3):
            square += (x[i, j] - x_prev[i, j]) ** 2
            total += (x[i, j] - x_gathered[i, j]) ** 2
        if square > excursions[i] ** 2:
            excursions[i] = math.sqrt(square)
        if not (total <= far[i, 2] ** 2 and total <= near[i, 2] ** 2):
            far_enough = True
    return far_enough


@njit(cache=True)
def _any_beyond_relative(x_gathered, moved, far, near, pieces, common):
    for i in range(len(moved)):
        absolute, relative = _relative_squares(x_gathered, moved, i, pieces[i], common)
        # The negated form is also true for positions that are not finite.
        if not (absolute <= far[i, 2] ** 2 and relative <= near[i, 2] ** 2):
            return True
    return False


@njit(cache=True)
def left_ways(which, begin, end, points, distance):
    """Whether one of some points (k,), now at points (n, 3), is farther than a distance from its way.

    The ways are straight, from begin to end (n, 3).
    """
    for i in which:
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
