"""Which of the listed pairs come near each other in a substep.

The distance of each pair is measured at reference positions. While the corners of one part move by at most r relative
to those of the other, the distance changes by at most r, since all places of the parts are means of their corners. In
most substeps this shows of most pairs that they do not come near. The others are measured again, and where these are
many, all of them, at new reference positions.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from supple.contact.mesh.distances import edge_edge_square, point_triangle_square
from supple.contact.search.reach import left_ways
from supple.runtime.kernel_cache import njit

# By which factor, and by which number, the pairs that may be near exceed those after the last measurement when all are
# measured again.
MORE, SOME = 1.25, 50


@njit(forceinline=True)
def _relative(ways, i, j, most):
    """The larger of `most` and the squares of how far i has moved relative to j: at the beginning, and at the end."""
    begin = end = 0.0
    for k in range(3):
        begin += (ways[i, k] - ways[j, k]) ** 2
        end += (ways[i, 3 + k] - ways[j, 3 + k]) ** 2
    return max(most, begin, end)


@njit(cache=True)
def set_ways(points, reference, begun, x, ways):
    """Write how far points (k,) are from their references when the substep begins and ends to ways (n, 6)."""
    for i in points:
        for k in range(3):
            ways[i, k] = begun[i, k] - reference[i, k]
            ways[i, 3 + k] = x[i, k] - reference[i, k]


@njit(forceinline=True)
def _triangle_apart(ways, triangles, t, p, free):
    """Whether point p moves by less than `free` [m] relative to the corners of triangle t."""
    if not free > 0.0:
        return False
    a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
    return _relative(ways, p, c, _relative(ways, p, b, _relative(ways, p, a, 0.0))) < free * free


@njit(forceinline=True)
def _edges_apart(ways, ends, e, f, free):
    """The same of two edges."""
    if not free > 0.0:
        return False
    a, b, c, d = ends[e, 0], ends[e, 1], ends[f, 0], ends[f, 1]
    moved = _relative(ways, a, d, _relative(ways, a, c, 0.0))
    return _relative(ways, b, d, _relative(ways, b, c, moved)) < free * free


@njit(cache=True)
def near_points(ways, lists, triangles, distances, margin, forces, depth, entered):
    """Those of the lists of `find_contacts` that count in a substep.

    All triangles of a piece count that holds the point, or that it is inside of or behind; otherwise the near ones.

    Parameters
    ----------
    ways : (n, 6), see `set_ways`; lists : see `find_contacts`
    distances : of the listed triangles at the reference [m]; margin : [m]
    forces : (k, 3) of the rows; depth : (2, n); entered : (n,)

    Returns
    -------
    lists : the same, shorter; near : (k, 3) the points, rows and triangles
    """
    n_active, points, run_ranges, run_starts, run_rows, listed = lists
    runs = run_ranges[n_active]
    out_points, out_ranges = np.empty(n_active, points.dtype), np.empty(n_active + 1, run_ranges.dtype)
    out_starts, out_rows = np.empty(runs + 1, run_starts.dtype), np.empty(runs, run_rows.dtype)
    out_listed = np.empty(run_starts[runs], listed.dtype)
    near = np.empty((run_starts[runs], 3), dtype=np.int64)
    n, r, count = 0, 0, 0
    out_ranges[0] = out_starts[0] = 0
    for index in range(n_active):
        p = points[index]
        whole = depth[0, p] > 0.0 or depth[1, p] > 0.0 or entered[p] >= 0
        for run in range(run_ranges[index], run_ranges[index + 1]):
            e = run_rows[run]
            every = whole or forces[e, 0] != 0.0 or forces[e, 1] != 0.0 or forces[e, 2] != 0.0
            for i in range(run_starts[run], run_starts[run + 1]):
                if every or not _triangle_apart(ways, triangles, listed[i], p, distances[i] - margin):
                    near[count, 0], near[count, 1], near[count, 2] = p, e, listed[i]
                    out_listed[count] = listed[i]
                    count += 1
            if count > out_starts[r]:
                out_rows[r] = e
                r += 1
                out_starts[r] = count
        if r > out_ranges[n]:
            out_points[n] = p
            n += 1
            out_ranges[n] = r
    return (n, out_points, out_ranges, out_starts, out_rows, out_listed), near[:count]


@njit(cache=True)
def near_edges(ways, pairs, ends, distances, margin, forces):
    """The numbers of the pairs of edges that may come as near as the margin [m] or hold a force.

    pairs : see `find_edge_contacts`; distances : (k,) of the pairs at the reference [m]; for the others see above
    """
    first, second, rows = pairs
    out = np.empty(len(first), dtype=np.int64)
    count = 0
    for i in range(len(first)):
        r = rows[i]
        pushes = forces[r, 0] != 0.0 or forces[r, 1] != 0.0 or forces[r, 2] != 0.0
        out[count] = i
        count += pushes or not _edges_apart(ways, ends, first[i], second[i], distances[i] - margin)
    return out[:count].copy()


@njit(cache=True)
def measure(x, lists, triangles, of_points, pairs, ends, of_edges):
    """Write the distances of all listed points and triangles, and of all pairs of edges, at x (n, 3) [m]."""
    n_active, points, run_ranges, run_starts, _, listed = lists
    for index in range(n_active):
        for i in range(run_starts[run_ranges[index]], run_starts[run_ranges[index + 1]]):
            of_points[i] = math.sqrt(point_triangle_square(x, points[index], triangles, listed[i]))
    first, second, _ = pairs
    for i in range(len(first)):
        of_edges[i] = math.sqrt(edge_edge_square(x, ends, first[i], second[i]))


@njit(cache=True)
def taking_part(n, lists, triangles, pairs, ends):
    """(n,) the points that take part in any pair."""
    taking = np.zeros(n, dtype=np.bool_)
    n_active, points, _, _, _, listed = lists
    for index in range(n_active):
        taking[points[index]] = True
    for t in listed:
        for j in range(3):
            taking[triangles[t, j]] = True
    first, second, _ = pairs
    for i in range(len(first)):
        for e in (first[i], second[i]):
            taking[ends[e, 0]] = taking[ends[e, 1]] = True
    return taking


class NearPairs:
    """The pairs of points and triangles, and of edges, that come near each other in a substep.

    Parameters
    ----------
    n : number of points; triangles : (t, 3); ends : (e, 2) of edges

    Attributes
    ----------
    lists : as `find_contacts` takes them; points : (k, 3) the same, as points, rows and triangles
    edges : numbers of the pairs of edges
    """

    def __init__(self, n: int, triangles: NDArray[np.int32], ends: NDArray[np.int32]) -> None:
        self._triangles, self._ends = triangles, ends
        self._reference, self._ways = np.zeros((n, 3)), np.zeros((n, 6))
        # The points of all pairs, and where they were in the substep that was looked at last.
        self._points = np.zeros(0, dtype=np.int64)
        self._begin, self._end = np.zeros((n, 3)), np.zeros((n, 3))
        self._distances = np.zeros(0), np.zeros(0)
        self._all: tuple = ()
        self._most = -1.0  # the number of near pairs from which all are measured again
        self.points, self.edges = np.zeros((0, 3), dtype=np.int64), np.zeros(0, dtype=np.int64)
        self.lists: tuple = (0,)

    def __bool__(self) -> bool:
        """Whether any pair was chosen."""
        return len(self.points) + len(self.edges) > 0

    def renew(self, lists: tuple, pairs: tuple) -> None:
        """Choose from these from now on; see `find_contacts` and `find_edge_contacts`."""
        self._all = lists, pairs
        self._distances = np.zeros(len(lists[-1])), np.zeros(len(pairs[0]))
        self._most = -1.0
        self.points, self.edges, self.lists = self.points[:0], self.edges[:0], (0,)
        any_pair = len(lists[-1]) or len(pairs[0])
        self._points = self._points[:0]
        if any_pair:
            self._points = np.flatnonzero(taking_part(len(self._ways), lists, self._triangles, pairs, self._ends))

    def look(
        self,
        begun: NDArray[np.float64],
        x: NDArray[np.float64],
        margin: float,
        forces: NDArray[np.float64],
        memory: tuple[NDArray[np.float64], NDArray[np.int32]],
    ) -> None:
        """Choose what comes as near as the margin [m] on the ways from begun to x (n, 3) [m].

        forces : (k, 3) of the rows; memory : depth (2, n) and entered (n,), see `ContactMemory`
        """
        if not len(self._points):
            return
        self._begin[:], self._end[:] = begun, x
        self._choose(margin, forces, memory)
        if len(self.points) + len(self.edges) > self._most:
            self._reference[:] = begun
            lists, pairs = self._all
            measure(begun, lists, self._triangles, self._distances[0], pairs, self._ends, self._distances[1])
            self._choose(margin, forces, memory)
            self._most = MORE * (len(self.points) + len(self.edges)) + SOME

    def _choose(self, margin: float, forces: NDArray[np.float64], memory: tuple) -> None:
        set_ways(self._points, self._reference, self._begin, self._end, self._ways)
        lists, pairs = self._all
        of_points, of_edges = self._distances
        self.lists, self.points = near_points(self._ways, lists, self._triangles, of_points, margin, forces, *memory)
        self.edges = near_edges(self._ways, pairs, self._ends, of_edges, margin, forces)

    def left(self, x: NDArray[np.float64], distance: float) -> bool:
        """Whether a point of any pair, at x (n, 3), is farther than a distance [m] from its way."""
        return len(self._points) > 0 and left_ways(self._points, self._begin, self._end, x, distance)
