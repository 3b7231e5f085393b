"""The largest step over which no tet loses more than a share of its volume.

Along positions x + t p, six times the volume of a tet is a cubic in t. With edges x21, x31, x41, and p21, p31, p41:

    a3 = (p21 x p31) . p41
    a2 = (x21 x p31 + p21 x x31) . p41 + (p21 x p31) . x41
    a1 = (x21 x p31 + p21 x x31) . x41 + (x21 x x31) . p41
    a0 = (x21 x x31) . x41 = 6 V

Divided by a0, and with 1 - keep in place of the constant 1, its smallest positive root is where the volume first falls
to the share `keep`. All coefficients are lowered by the largest possible round-off, so that the computed step is never
longer than the true one.

Source: Li, Jiang, Luo, "Physics-Based Simulation", equations 23.3.1 and 23.3.2, whose closed form of the root is
replaced (see `supple.numerics.cubic`).
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import SolverError
from supple.numerics.cubic import last_positive_before_root, positive_on_unit_interval
from supple.numerics.geometry import double_double as dd
from supple.numerics.mat3 import cross, dot, row, subtract
from supple.runtime.kernel_cache import njit, prange

# The default share of its volume that a tet keeps in one step.
KEEP = 0.2

# A bound, with a margin, on the round-off of the coefficients and of the evaluation of their cubic.
_ROUND_OFF = 32.0 * 2.0**-53

# Where round-off may exceed this share of the volume, coefficients are computed with twice the precision.
_UNSURE = 1e-9

# Tets are processed in runs of this length, independent of the number of threads, so that the bits are.
_RUN = 256


@njit
def _size_of_triple(a, b, c):
    """The sum of the absolute values of the terms of (a x b) . c."""
    return (
        (abs(a[1] * b[2]) + abs(a[2] * b[1])) * abs(c[0])
        + (abs(a[2] * b[0]) + abs(a[0] * b[2])) * abs(c[1])
        + (abs(a[0] * b[1]) + abs(a[1] * b[0])) * abs(c[2])
    )


@njit
def _tet_step(x, p, tets, e, keep):
    """Largest t in [0, 1] with volume(s) >= keep volume(0) of tet e for all s in [0, t].

    0 where the tet is flat or inverted at the start, or something is not finite.
    """
    o = tets[e, 0]
    x0, p0 = row(x, o), row(p, o)
    x1, x2, x3 = (
        subtract(row(x, tets[e, 1]), x0),
        subtract(row(x, tets[e, 2]), x0),
        subtract(row(x, tets[e, 3]), x0),
    )
    p1, p2, p3 = (
        subtract(row(p, tets[e, 1]), p0),
        subtract(row(p, tets[e, 2]), p0),
        subtract(row(p, tets[e, 3]), p0),
    )
    xx = cross(x1, x2)
    xp = cross(x1, p2)
    px = cross(p1, x2)
    pp = cross(p1, p2)
    mixed = (xp[0] + px[0], xp[1] + px[1], xp[2] + px[2])
    a3 = dot(pp, p3)
    a2 = dot(mixed, p3) + dot(pp, x3)
    a1 = dot(mixed, x3) + dot(xx, p3)
    a0 = dot(xx, x3)
    e3 = _ROUND_OFF * _size_of_triple(p1, p2, p3)
    e2 = _ROUND_OFF * (_size_of_triple(x1, p2, p3) + _size_of_triple(p1, x2, p3) + _size_of_triple(p1, p2, x3))
    e1 = _ROUND_OFF * (_size_of_triple(x1, p2, x3) + _size_of_triple(p1, x2, x3) + _size_of_triple(x1, x2, p3))
    e0 = _ROUND_OFF * _size_of_triple(x1, x2, x3)
    lost = 1.0 - keep
    # Divided by a0 and lowered by the largest round-off: below the true cubic for all t >= 0.
    if a0 > e0:
        a, b, c, d = (a3 - e3) / a0, (a2 - e2) / a0, (a1 - e1) / a0, lost * (1.0 - e0 / a0)
        if positive_on_unit_interval(a, b, c, d):
            return 1.0
    if not e3 + e2 + e1 + e0 < _UNSURE * a0:
        # A sliver, or a direction far longer than the tet: rounding would decide. This is rare, and precision is slow.
        a3, a2, a1, a0 = _precise_coefficients(x, p, tets, e)
        if not a0 > 0.0:
            return 0.0
        tiny = 0.5 * _ROUND_OFF
        a = (a3 - (tiny * abs(a3) + e3 * _ROUND_OFF)) / a0
        b = (a2 - (tiny * abs(a2) + e2 * _ROUND_OFF)) / a0
        c = (a1 - (tiny * abs(a1) + e1 * _ROUND_OFF)) / a0
        d = lost * (1.0 - (tiny + e0 * _ROUND_OFF / a0))
        if positive_on_unit_interval(a, b, c, d):
            return 1.0
    if not (abs(a) < np.inf and abs(b) < np.inf and abs(c) < np.inf and 0.0 < d < np.inf):
        return 0.0
    t = last_positive_before_root(a, b, c, d, 1.0)
    return 1.0 if t < 0.0 else t


@njit
def _precise_coefficients(x, p, tets, e):
    """a3, a2, a1, a0 of tet e from double-double numbers; each has the precision of one float."""
    x1, p1 = _precise_edge(x, tets, e, 1), _precise_edge(p, tets, e, 1)
    x2, p2 = _precise_edge(x, tets, e, 2), _precise_edge(p, tets, e, 2)
    x3, p3 = _precise_edge(x, tets, e, 3), _precise_edge(p, tets, e, 3)
    a2 = dd.add(dd.add(dd.triple_product(x1, p2, p3), dd.triple_product(p1, x2, p3)), dd.triple_product(p1, p2, x3))
    a1 = dd.add(dd.add(dd.triple_product(x1, p2, x3), dd.triple_product(p1, x2, x3)), dd.triple_product(x1, x2, p3))
    return dd.triple_product(p1, p2, p3)[0], a2[0], a1[0], dd.triple_product(x1, x2, x3)[0]


@njit
def _precise_edge(x, tets, e, k):
    i, o = tets[e, k], tets[e, 0]
    return (dd.difference(x[i, 0], x[o, 0]), dd.difference(x[i, 1], x[o, 1]), dd.difference(x[i, 2], x[o, 2]))


@njit(parallel=True, cache=True)
def noninverting_step(x, direction, tets, guarded, keep):
    """The largest step in [0, 1] over which no guarded tet falls below `keep` of its volume at x; for solvers.

    Parameters
    ----------
    x, direction : (n, 3) positions and their change over a full step [m]
    tets : (m, 4) int32; guarded : (m,) bool, False for tets that are ignored
    keep : in (0, 1)

    Returns
    -------
    step, tet : the step, and the first tet that allows no more (-1 for a full step). The step is 0 where a guarded tet
        is flat or inverted at x.
    """
    m = len(tets)
    runs = (m + _RUN - 1) // _RUN
    steps = np.ones(runs)
    limiting = np.full(runs, -1, dtype=np.int64)
    for r in prange(runs):
        smallest = 1.0
        which = -1
        for e in range(r * _RUN, min(m, (r + 1) * _RUN)):
            if guarded[e]:
                t = _tet_step(x, direction, tets, e, keep)
                if t < smallest:
                    smallest = t
                    which = e
        steps[r] = smallest
        limiting[r] = which
    step, tet = 1.0, -1
    for r in range(runs):
        if steps[r] < step:
            step = steps[r]
            tet = limiting[r]
    return step, tet


@njit(cache=True)
def volume_signs(x, tets):
    """(m,) six times the volumes, precise enough that slivers have the right sign."""
    out = np.empty(len(tets))
    for e in range(len(tets)):
        u, v, w = _precise_edge(x, tets, e, 1), _precise_edge(x, tets, e, 2), _precise_edge(x, tets, e, 3)
        out[e] = dd.triple_product(u, v, w)[0]
    return out


def largest_noninverting_step(
    vertices: ArrayLike,
    direction: ArrayLike,
    tets: ArrayLike,
    keep: float = KEEP,
    ignore: Iterable[int] = (),
) -> float:
    """The largest step along `direction`, at most 1, over which every tetrahedron keeps a share of its volume.

    Parameters
    ----------
    vertices : (n, 3) positions [m]
    direction : (n, 3) change of the positions over a full step [m]
    tets : (m, 4) indices, positive volume at `vertices`
    keep : the share of its current volume that a tet may fall to, above 0 and below 1
    ignore : tets without a limit, such as those that are inverted at the start

    Returns
    -------
    step : in (0, 1]; 1 where nothing limits it. At vertices + step * direction, rounded, every tet that is not ignored
        has a positive volume.

    Raises
    ------
    SolverError : where arrays do not fit together, a value is not finite, or a tet that is not ignored is flat or
        inverted at the start.

    Source: Li, Jiang, Luo, "Physics-Based Simulation", section 23.3.
    """
    x, p, cells, guarded = _checked(vertices, direction, tets, keep, ignore)
    volumes = volume_signs(x, cells)
    bad = np.flatnonzero(guarded & ~(volumes > 0.0))
    if len(bad):
        names = ", ".join(str(e) for e in bad[:8]) + (", ..." if len(bad) > 8 else "")
        raise SolverError(
            f"{len(bad)} of {len(cells)} tets are flat or inverted at the start (tets {names}): no step can be "
            "guarded; start un-inverted, or pass them as ignore="
        )
    step = noninverting_step(x, p, cells, guarded, float(keep))[0]
    while step > 0.0 and not (volume_signs(x + step * p, cells)[guarded] > 0.0).all():
        step *= 0.5
    if not step > 0.0:
        raise SolverError(
            "no positive step keeps every tet's volume: the tets are thinner than round-off at this scale"
        )
    return float(step)


def _checked(
    vertices: ArrayLike, direction: ArrayLike, tets: ArrayLike, keep: float, ignore: Iterable[int]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int32], NDArray[np.bool_]]:
    x = np.ascontiguousarray(vertices, dtype=np.float64)
    p = np.ascontiguousarray(direction, dtype=np.float64)
    cells = np.ascontiguousarray(tets, dtype=np.int32)
    if x.ndim != 2 or x.shape[1] != 3:
        raise SolverError(f"vertices has shape {x.shape}; give (n, 3)")
    if p.shape != x.shape:
        raise SolverError(f"direction has shape {p.shape}; the vertices have {x.shape}")
    if cells.ndim != 2 or cells.shape[1] != 4:
        raise SolverError(f"tets has shape {cells.shape}; give (m, 4)")
    if cells.size and (cells.min() < 0 or cells.max() >= len(x)):
        raise SolverError(
            f"tets name vertex {cells.max() if cells.max() >= len(x) else cells.min()}; there are {len(x)}"
        )
    if not (np.isfinite(x).all() and np.isfinite(p).all()):
        raise SolverError("vertices and direction must be finite")
    if not 0.0 < keep < 1.0:
        raise SolverError(f"keep is {keep}; give a share above 0 and below 1")
    guarded = np.ones(len(cells), dtype=np.bool_)
    ignored = np.asarray(list(ignore), dtype=np.int64)
    if ignored.size and (ignored.min() < 0 or ignored.max() >= len(cells)):
        raise SolverError(f"ignore names tet {ignored.max()}; there are {len(cells)}")
    guarded[ignored] = False
    return x, p, cells, guarded
