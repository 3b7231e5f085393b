"""A tree of axis-aligned boxes around triangles: which may meet is found without looking at all."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.runtime.kernel_cache import njit

_LEAF = 4


class Tree(NamedTuple):
    """A tree over the boxes of t triangles.

    Attributes
    ----------
    low, high : (t, 3) lowest and highest corners of the triangles' boxes
    order : (t,) triangles, those of a node next to each other
    nodes : (n, 4) begin and end in `order`, and the two children, -1 for a leaf; node 0 is the root
    node_low, node_high : (n, 3) of the nodes' boxes
    """

    low: NDArray[np.float64]
    high: NDArray[np.float64]
    order: NDArray[np.int64]
    nodes: NDArray[np.int64]
    node_low: NDArray[np.float64]
    node_high: NDArray[np.float64]


@njit(forceinline=False)
def _boxes(x, triangles):
    low, high = np.empty((len(triangles), 3)), np.empty((len(triangles), 3))
    for t in range(len(triangles)):
        for k in range(3):
            a, b, c = x[triangles[t, 0], k], x[triangles[t, 1], k], x[triangles[t, 2], k]
            low[t, k], high[t, k] = min(a, b, c), max(a, b, c)
    return low, high


@njit(cache=True)
def tree_of(x, triangles):
    """A tree over triangles (t, 3) of points x (n, 3), split in the middle of the longest side."""
    low, high = _boxes(x, triangles)
    count = len(triangles)
    order = np.arange(count)
    nodes = np.empty((max(1, 2 * count), 4), dtype=np.int64)
    node_low, node_high = np.empty((len(nodes), 3)), np.empty((len(nodes), 3))
    nodes[0, 0], nodes[0, 1] = 0, count
    used, at = 1, 0
    while at < used:
        begin, end = nodes[at, 0], nodes[at, 1]
        nodes[at, 2] = nodes[at, 3] = -1
        for k in range(3):
            lowest, highest = np.inf, -np.inf
            for i in range(begin, end):
                lowest, highest = min(lowest, low[order[i], k]), max(highest, high[order[i], k])
            node_low[at, k], node_high[at, k] = lowest, highest
        if end - begin > _LEAF:
            axis = int(np.argmax(node_high[at] - node_low[at]))
            middle = 0.5 * node_low[at, axis] + 0.5 * node_high[at, axis]
            cut = begin
            for i in range(begin, end):
                box = order[i]
                if 0.5 * low[box, axis] + 0.5 * high[box, axis] < middle:
                    order[i], order[cut] = order[cut], box
                    cut += 1
            if cut in (begin, end):
                cut = (begin + end) // 2
            for child, first, last in ((0, begin, cut), (1, cut, end)):
                nodes[at, 2 + child] = used
                nodes[used, 0], nodes[used, 1] = first, last
                used += 1
        at += 1
    return Tree(low, high, order, nodes[:used].copy(), node_low[:used].copy(), node_high[:used].copy())


@njit(cache=True)
def refitted(tree, x, triangles):
    """The same tree with the boxes of other points x (n, 3)."""
    low, high = _boxes(x, triangles)
    nodes, node_low, node_high = tree.nodes, np.empty_like(tree.node_low), np.empty_like(tree.node_high)
    for at in range(len(nodes) - 1, -1, -1):
        node_low[at], node_high[at] = np.inf, -np.inf
        if nodes[at, 2] < 0:
            for i in tree.order[nodes[at, 0] : nodes[at, 1]]:
                _widen(node_low, node_high, at, low, high, i)
        else:
            for child in (nodes[at, 2], nodes[at, 3]):
                _widen(node_low, node_high, at, node_low, node_high, child)
    return Tree(low, high, tree.order, nodes, node_low, node_high)


@njit
def _widen(node_low, node_high, at, low, high, i):
    for k in range(3):
        node_low[at, k] = min(node_low[at, k], low[i, k])
        node_high[at, k] = max(node_high[at, k], high[i, k])


@njit(forceinline=False)
def boxes_meet(low, high, i, j):
    """Whether two closed boxes meet."""
    return (
        low[i, 0] <= high[j, 0]
        and low[j, 0] <= high[i, 0]
        and low[i, 1] <= high[j, 1]
        and low[j, 1] <= high[i, 1]
        and low[i, 2] <= high[j, 2]
        and low[j, 2] <= high[i, 2]
    )


@njit(forceinline=False)
def moving_boxes_meet(low0, high0, low1, high1, i, j):
    """Whether two boxes, whose sides move from their places at the first time to those at the second, ever meet."""
    begin, end = 0.0, 1.0
    for k in range(3):
        for side in range(2):
            if side == 0:
                a, b = high0[j, k] - low0[i, k], high1[j, k] - low1[i, k]
            else:
                a, b = high0[i, k] - low0[j, k], high1[i, k] - low1[j, k]
            # The gap is closed where a + t (b - a) >= 0, up to round-off.
            slack = 1e-12 * (abs(a) + abs(b))
            a, b = a + slack, b + slack
            if a < 0.0 and b < 0.0:
                return False
            if a < 0.0:
                begin = max(begin, a / (a - b) * (1.0 - 1e-12))
            elif b < 0.0:
                end = min(end, a / (a - b) * (1.0 + 1e-12))
    return begin <= end


@njit(forceinline=False)
def boxes_apart(low, high, i, j):
    """Squared distance of two boxes."""
    total = 0.0
    for k in range(3):
        gap = max(low[i, k] - high[j, k], low[j, k] - high[i, k], 0.0)
        total += gap * gap
    return total
