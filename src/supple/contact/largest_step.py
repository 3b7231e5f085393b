"""How far the points of a surface may move before anything touches."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.contact.additive_ccd import KEEP, ROUND_OFF, edge_edge_time, point_triangle_time
from supple.contact.mesh.contact_mesh import ContactMesh
from supple.contact.search.candidates import Candidates
from supple.contact.search.finder import CandidateFinder
from supple.runtime.kernel_cache import njit, prange

# What a long way sweeps overlaps everything, and most of a long way is not taken: it is divided into pieces of this
# many mean edges, which are examined one after another.
_PIECE = 1.0
_MOST_PIECES = 128
# Pairs are divided into this many runs, whatever the number of threads.
_RUNS = 64
# Boxes that stay this share of a pair's distance apart need no closer look.
_CLEAR = 2.0 * KEEP


class Limit(NamedTuple):
    """A step, and the pair that allows no more.

    Attributes
    ----------
    step : in [0, 1]
    kind : "vertex-triangle" or "edge-edge", or "" where nothing limits the step
    pair : point and triangle, or two edges; (-1, -1) for none
    """

    step: float
    kind: str = ""
    pair: tuple[int, int] = (-1, -1)


def largest_step(
    mesh: ContactMesh, points: NDArray[np.float64], way: NDArray[np.float64], candidates: Candidates
) -> Limit:
    """How far along `way` (s, 3) from `points` (s, 3), at most 1, every candidate keeps a tenth of its distance.

    The points may be moved by step * way in rounded numbers. The pair is the first of those with the least step.
    """
    limit = Limit(1.0)
    if len(candidates.vertex_triangle):
        step, k = _first_point(points, way, mesh.triangles, candidates.vertex_triangle)
        limit = Limit(step, "vertex-triangle", _pair(candidates.vertex_triangle[k])) if k >= 0 else limit
    if len(candidates.edge_edge):
        step, k = _first_edge(points, way, mesh.edges, candidates.edge_edge, limit.step)
        limit = Limit(step, "edge-edge", _pair(candidates.edge_edge[k])) if k >= 0 else limit
    return limit


def largest_step_in_pieces(finder: CandidateFinder, points: NDArray[np.float64], way: NDArray[np.float64]) -> Limit:
    """As `largest_step`, with candidates from `finder`; a step of zero where the way is not finite."""
    mesh = finder.mesh
    longest = float(np.sqrt(np.einsum("ij,ij->i", way, way).max(initial=0.0)))
    if not np.isfinite(longest):
        return Limit(0.0)
    piece = _PIECE * float(mesh.edge_lengths.mean()) if len(mesh.edges) else np.inf
    count = max(1, int(np.ceil(min(longest / piece, _MOST_PIECES))))
    share = min(1.0, piece * count / longest) / count if longest > 0.0 else 1.0
    for k in range(count):
        begin = points if k == 0 else points + (k * share) * way
        part = share * way
        limit = largest_step(mesh, begin, part, finder.find(begin, begin + part))
        if limit.kind:
            return limit._replace(step=(k + limit.step) * share)
    # A complete way must give exactly 1: count * (1 / count) can be slightly less.
    return Limit(1.0 if longest <= count * piece else count * share)


def _pair(row: NDArray[np.int32]) -> tuple[int, int]:
    return int(row[0]), int(row[1])


@njit
def _clear(x, way, a, b, c, d, ends):
    """Whether the boxes of two parts stay so far apart along one axis that the pair certainly keeps its distance.

    The parts are the points a, and b, c, d for ends = 1; and a, b, and c, d for ends = 2.
    """
    square = 0.0
    for m in range(3):
        square += (x[a, m] - x[c, m]) ** 2
    for m in range(3):
        a0, b0, c0, d0 = x[a, m], x[b, m], x[c, m], x[d, m]
        a1, b1, c1, d1 = a0 + way[a, m], b0 + way[b, m], c0 + way[c, m], d0 + way[d, m]
        if ends == 1:
            low0, high0, low1, high1 = a0, a0, a1, a1
            low2, high2 = min(b0, c0, d0), max(b0, c0, d0)
            low3, high3 = min(b1, c1, d1), max(b1, c1, d1)
        else:
            low0, high0, low1, high1 = min(a0, b0), max(a0, b0), min(a1, b1), max(a1, b1)
            low2, high2, low3, high3 = min(c0, d0), max(c0, d0), min(c1, d1), max(c1, d1)
        gap = max(min(low0 - high2, low1 - high3), min(low2 - high0, low3 - high1))
        if gap > 0.0 and gap * gap > _CLEAR * _CLEAR * square:
            size = max(abs(low0), abs(low1), abs(low2), abs(low3), abs(high0), abs(high1), abs(high2), abs(high3))
            return gap > ROUND_OFF * size
    return False


@njit(cache=True, parallel=True)
def _first_point(x, way, triangles, pairs):
    """The least step of pairs (k, 2) of points and triangles, and the pair's row; 1 and -1 for a full step."""
    steps, rows = np.ones(_RUNS), np.full(_RUNS, -1, dtype=np.int64)
    for r in prange(_RUNS):
        least, at = 1.0, np.int64(-1)
        for k in range(r, len(pairs), _RUNS):
            v, t = pairs[k, 0], pairs[k, 1]
            if not _clear(x, way, v, triangles[t, 0], triangles[t, 1], triangles[t, 2], 1):
                step = point_triangle_time(x, way, v, triangles[t], least)
                if step < least:
                    least, at = step, k
        steps[r], rows[r] = least, at
    return _least(steps, rows, 1.0)


@njit(cache=True, parallel=True)
def _first_edge(x, way, edges, pairs, limit):
    """The same for pairs of edges, of those with a step below `limit`."""
    steps, rows = np.full(_RUNS, limit), np.full(_RUNS, -1, dtype=np.int64)
    for r in prange(_RUNS):
        least, at = limit, np.int64(-1)
        for k in range(r, len(pairs), _RUNS):
            e, f = pairs[k, 0], pairs[k, 1]
            if not _clear(x, way, edges[e, 0], edges[e, 1], edges[f, 0], edges[f, 1], 2):
                step = edge_edge_time(x, way, edges[e], edges[f], least)
                if step < least:
                    least, at = step, k
        steps[r], rows[r] = least, at
    return _least(steps, rows, limit)


@njit
def _least(steps, rows, limit):
    """The least step, and the first row that has it."""
    least, at = limit, np.int64(-1)
    for r in range(len(steps)):
        if rows[r] >= 0 and (at < 0 or steps[r] < least or (steps[r] == least and rows[r] < at)):
            least, at = steps[r], rows[r]
    return least, at
