"""Memory for the results of a search that is divided into runs."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.contact.search.pair_kernels import RUNS, sort_pairs


class Room:
    """Where each run of a search writes its pairs; grows as needed and is kept from search to search.

    Attributes
    ----------
    start : (RUNS + 1,) where the rows of each run begin; pairs : (start[-1], 2) int32
    counts : (RUNS,) what each run found, which may be more than fits
    """

    def __init__(self) -> None:
        self.start = np.zeros(RUNS + 1, dtype=np.int64)
        self.counts = np.zeros(RUNS, dtype=np.int64)
        self.pairs = np.zeros((0, 2), dtype=np.int32)

    def sorted(self, size: int) -> NDArray[np.int32]:
        """The pairs of all runs (k, 2) in ascending order; the first are below `size`."""
        found = self.counts.any()
        return sort_pairs(self.pairs, self.start, self.counts, size) if found else np.zeros((0, 2), dtype=np.int32)

    def is_too_small(self) -> bool:
        """Whether some run found more than fits; then there is room for that, and more, for the next attempt."""
        if (self.counts <= np.diff(self.start)).all():
            return False
        np.cumsum(self.counts + self.counts // 2 + 64, out=self.start[1:])
        self.pairs = np.empty((self.start[-1], 2), dtype=np.int32)
        return True
