"""The lists of triangles near points, divided into runs: one for each piece near a point, with one contact at most."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.contact.search.point_lists import PairFinder

# Keys of rows: the kind of contact, the first and the second thing, 31 bits each for the latter two.
POINT_PIECE, EDGE_EDGE = 0, 1


def keys_of(kind: int, first: NDArray[np.integer], second: NDArray[np.integer]) -> NDArray[np.int64]:
    """Numbers that identify pairs in every scene with the same bodies."""
    return (np.int64(kind) << 62) | (first.astype(np.int64) << 31) | second.astype(np.int64)


class PieceRuns:
    """The runs of a `PairFinder`, renewed after every search.

    Attributes
    ----------
    n_active : number of points that have any; keys : (runs,) ascending
    """

    def __init__(self, finder: PairFinder, triangle_piece: NDArray[np.int32]) -> None:
        self._finder, self._triangle_piece = finder, triangle_piece
        self._ranges = self._starts = np.zeros(1, dtype=np.int64)
        self.n_active = 0
        self.keys = self._ranges[:0]

    def renew(self) -> None:
        """Read the lists of the finder."""
        f = self._finder
        points = np.repeat(f.active, np.diff(f.starts)[f.active])
        pieces = self._triangle_piece[f.triangles]
        begins = np.flatnonzero((np.diff(points, prepend=-1) != 0) | (np.diff(pieces, prepend=-1) != 0))
        self._starts = np.append(begins, f.count)
        self._ranges = np.append(np.searchsorted(points[begins], f.active), len(begins))
        self.n_active = f.n_active
        self.keys = keys_of(POINT_PIECE, points[begins], pieces[begins])

    def lists(self, rows: NDArray[np.int64]) -> tuple:
        """The argument `lists` of `find_contacts`, for these rows (runs,)."""
        return self.n_active, self._finder.active, self._ranges, self._starts, rows, self._finder.triangles
