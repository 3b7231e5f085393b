"""The lists of triangles near points, divided into runs: one for each piece near a point, with one contact at most."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.contact.search.point_lists import PairFinder
from supple.runtime.kernel_cache import njit

# Keys of rows: the kind of contact, the first and the second thing, 31 bits each for the latter two.
POINT_PIECE, EDGE_EDGE = 0, 1


@njit
def key_of(kind, first, second):
    """A number that identifies a pair in every scene with the same bodies."""
    return (np.int64(kind) << 62) | (np.int64(first) << 31) | np.int64(second)


@njit(cache=True)
def find_runs(lists, triangle_piece, run_ranges, run_starts, keys):
    """Divide the lists of all active points into runs. Returns the number of runs.

    Parameters
    ----------
    lists : n_active, active, starts, triangles of `PairFinder`
    run_ranges : (n_active + 1,) out: the runs of each active point
    run_starts : (count + 1,) out: where each run begins in the list of triangles
    keys : (count,) out: (point, piece) of each run
    """
    n_active, active, starts, listed = lists
    runs = 0
    run_ranges[0] = 0
    run_starts[0] = 0
    for index in range(n_active):
        p = active[index]
        i, end = starts[p], starts[p + 1]
        while i < end:
            its = triangle_piece[listed[i]]
            run_starts[runs] = i
            keys[runs] = key_of(POINT_PIECE, p, its)
            while i < end and triangle_piece[listed[i]] == its:
                i += 1
            runs += 1
            run_starts[runs] = i
        run_ranges[index + 1] = runs
    return runs


class PieceRuns:
    """The runs of a `PairFinder`, renewed after every search.

    Attributes
    ----------
    n_active : number of points that have any; keys : (runs,) ascending
    """

    def __init__(self, finder: PairFinder, n_points: int, triangle_piece: NDArray[np.int32]) -> None:
        self._finder, self._triangle_piece = finder, triangle_piece
        self._ranges = np.zeros(n_points + 1, dtype=np.int64)
        self._starts = np.zeros(1, dtype=np.int64)
        self._keys = np.zeros(0, dtype=np.int64)
        self.n_active = 0
        self.keys = self._keys

    def renew(self) -> None:
        """Read the lists of the finder."""
        f = self._finder
        if len(self._keys) < f.count:
            self._keys, self._starts = np.zeros(2 * f.count, dtype=np.int64), np.zeros(2 * f.count + 1, dtype=np.int64)
        lists = (f.n_active, f.active, f.starts, f.triangles)
        runs = find_runs(lists, self._triangle_piece, self._ranges, self._starts, self._keys)
        self.n_active = f.n_active
        self.keys = self._keys[:runs]

    def lists(self, rows: NDArray[np.int64]) -> tuple:
        """The argument `lists` of `find_contacts`, for these rows (runs,)."""
        return self.n_active, self._finder.active, self._ranges, self._starts, rows, self._finder.triangles
