"""The pairs of vertices that patches couple, and what each pair adds up."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Pairs:
    """Pairs (i, j), i <= j, in ascending order.

    Attributes
    ----------
    rows, columns : (p,) the vertices i and j
    edge_start, star_start : (p + 1,) first entry of each pair in `edge_slots` and `star_slots`
    edge_slots, star_slots : (r, 2) slots of i and j in one patch
    """

    rows: NDArray[np.int32]
    columns: NDArray[np.int32]
    edge_start: NDArray[np.int32]
    edge_slots: NDArray[np.int32]
    star_start: NDArray[np.int32]
    star_slots: NDArray[np.int32]


def pairs_of(
    edges: tuple[NDArray[np.int32], NDArray[np.int32]], stars: tuple[NDArray[np.int32], NDArray[np.int32]]
) -> Pairs:
    """The pairs in the patches of edges and stars, each given by `start` and `vertices` of its slots."""
    n = int(stars[1].max()) + 1
    of_edges, of_stars = _slot_pairs(edges[0]), _slot_pairs(stars[0])
    keys = [
        part[pairs[:, 0]] * np.int64(n) + part[pairs[:, 1]]
        for (_, part), pairs in ((edges, of_edges), (stars, of_stars))
    ]
    both, number = np.unique(np.concatenate(keys), return_inverse=True)
    rows, columns = np.divmod(both, n)
    return Pairs(
        rows.astype(np.int32),
        columns.astype(np.int32),
        *_by_pair(number[: len(of_edges)], of_edges, len(both)),
        *_by_pair(number[len(of_edges) :], of_stars, len(both)),
    )


def _slot_pairs(start: NDArray[np.int32]) -> NDArray[np.int32]:
    """(r, 2) all slots b <= c of the same patch; a patch's vertices ascend with its slots."""
    ends = np.repeat(start[1:], np.diff(start))
    slots = np.arange(len(ends))
    counts = ends - slots
    first = np.repeat(slots, counts)
    begin = np.repeat(np.cumsum(counts) - counts, counts)
    return np.column_stack([first, first + np.arange(len(first)) - begin]).astype(np.int32)


def _by_pair(
    number: NDArray[np.int64], slots: NDArray[np.int32], count: int
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    order = np.argsort(number, kind="stable")
    start = np.searchsorted(number[order], np.arange(count + 1))
    return start.astype(np.int32), np.ascontiguousarray(slots[order])
