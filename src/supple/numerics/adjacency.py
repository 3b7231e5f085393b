"""Lists of neighbors: for each of n things, the numbers of those that belong to it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.runtime.kernel_cache import njit


class Adjacency(NamedTuple):
    """The lists of n things one after another; kernels take it as it is.

    Attributes
    ----------
    start : (n + 1,) int32; items : (start[-1],) int32, those of thing k ascending at start[k] .. start[k + 1]
    """

    start: NDArray[np.int32]
    items: NDArray[np.int32]


def adjacency(rows: NDArray[np.integer], items: NDArray[np.integer], count: int) -> Adjacency:
    """From pairs rows (k,), items (k,) of `count` things; each pair counts once."""
    width = int(items.max(initial=0)) + 1
    codes = np.unique(rows.astype(np.int64) * width + items)
    of, found = np.divmod(codes, width)
    start = np.searchsorted(of, np.arange(count + 1))
    return Adjacency(start.astype(np.int32), found.astype(np.int32))


def only(lists: Adjacency, kept: NDArray[np.bool_]) -> Adjacency:
    """The lists with the items that are kept."""
    stays = kept[lists.items]
    start = np.concatenate([[0], np.cumsum(stays)])[lists.start]
    return Adjacency(start.astype(np.int32), lists.items[stays])


def no_lists(count: int) -> Adjacency:
    """Empty lists of `count` things."""
    return Adjacency(np.zeros(count + 1, dtype=np.int32), np.zeros(0, dtype=np.int32))


def joined_lists(one: Adjacency, other: Adjacency) -> Adjacency:
    """The items of two lists of each thing."""
    count = len(one.start) - 1
    rows = [np.repeat(np.arange(count), np.diff(lists.start)) for lists in (one, other)]
    return adjacency(np.concatenate(rows), np.concatenate([one.items, other.items]), count)


@njit
def in_list(lists, k, item):
    """Whether an item is in the list of thing k; `lists` are an `Adjacency` or its two arrays."""
    for i in range(lists[0][k], lists[0][k + 1]):  # noqa: SIM110
        if lists[1][i] == item:
            return True
    return False
