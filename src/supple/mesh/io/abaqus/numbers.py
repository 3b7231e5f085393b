"""Things that a deck numbers in any order."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.mesh.io.cells import FormatError


class Numbers:
    """Places, counted from 0, of things that a deck numbers in any order."""

    def __init__(self, tags: NDArray[np.int64], kind: str) -> None:
        self._order = np.argsort(tags, kind="stable")
        self._sorted, self._kind = tags[self._order], kind
        twice = np.flatnonzero(self._sorted[1:] == self._sorted[:-1])
        if len(twice):
            raise FormatError(f"{kind} {self._sorted[twice[0]]} is given twice")

    def places(self, tags: NDArray[np.int64]) -> NDArray[np.int64]:
        """Of numbers of any shape, which must all exist."""
        found, known = self._find(tags)
        if not known.all():
            raise FormatError(f"{self._kind} {tags[~known].flat[0]} is used, and does not exist")
        return self._order[found]

    def known(self, tags: NDArray[np.int64]) -> NDArray[np.int64]:
        """Of those numbers that exist."""
        found, known = self._find(tags)
        return self._order[found[known]]

    def _find(self, tags: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        if len(self._sorted) == 0:
            return np.zeros(tags.shape, dtype=np.int64), np.zeros(tags.shape, dtype=bool)
        found = np.minimum(np.searchsorted(self._sorted, tags), len(self._sorted) - 1)
        return found, self._sorted[found] == tags
