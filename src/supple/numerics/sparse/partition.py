"""Groups of neighbouring rows of about equal size: blocks of a smoother, and the supports of its coarse space."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def bisected_groups(points: NDArray[np.float64], labels: NDArray[np.int32], count: int) -> list[NDArray[np.int64]]:
    """Split points into about `count` groups by recursive coordinate bisection; no group holds two labels.

    Parameters
    ----------
    points : (n, 3); labels : (n,) connected component of each; count : how many groups to aim at.

    Returns
    -------
    the indices of each group, none empty.

    Source: Berger, Bokhari, "A partitioning strategy for nonuniform problems on multiprocessors" (1987).
    """
    groups: list[NDArray[np.int64]] = []
    order = np.argsort(labels, kind="stable")
    pieces = np.split(order, np.flatnonzero(np.diff(labels[order])) + 1)
    for piece in pieces:
        if len(piece) == 0:
            continue
        share = max(1, round(count * len(piece) / len(points)))
        waiting = [(piece, share)]
        while waiting:
            members, parts = waiting.pop()
            if parts == 1 or len(members) < 2:
                groups.append(members)
                continue
            extent = np.ptp(points[members], axis=0)
            along = np.argsort(points[members, int(np.argmax(extent))], kind="stable")
            left = parts // 2
            cut = min(max(1, len(members) * left // parts), len(members) - 1)
            waiting.append((members[along[cut:]], parts - left))
            waiting.append((members[along[:cut]], left))
    return groups
