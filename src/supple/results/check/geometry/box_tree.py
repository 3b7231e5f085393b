"""A tree of axis-aligned boxes around triangles: which may meet is found without looking at all."""

import numpy as np

from supple.runtime.kernel_cache import njit

_LEAF = 4


@njit(cache=True)
def triangle_boxes(x, triangles):
    """Lowest and highest corners, each (t, 3)."""
    low, high = np.empty((len(triangles), 3)), np.empty((len(triangles), 3))
    for t in range(len(triangles)):
        for k in range(3):
            a, b, c = x[triangles[t, 0], k], x[triangles[t, 1], k], x[triangles[t, 2], k]
            low[t, k], high[t, k] = min(a, b, c), max(a, b, c)
    return low, high


@njit(cache=True)
def build_tree(low, high):
    """A tree over boxes, split in the middle of the longest side.

    Returns
    -------
    order : (t,) boxes, those of a node next to each other
    nodes : (n, 4) begin and end in `order`, and the two children, -1 for a leaf; node 0 is the root
    node_low, node_high : (n, 3)
    """
    count = len(low)
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
    return order, nodes[:used], node_low[:used], node_high[:used]


@njit(forceinline=False)
def boxes_meet(low_a, high_a, low_b, high_b, i, j):
    """Whether two closed boxes meet."""
    return (
        low_a[i, 0] <= high_b[j, 0]
        and low_b[j, 0] <= high_a[i, 0]
        and low_a[i, 1] <= high_b[j, 1]
        and low_b[j, 1] <= high_a[i, 1]
        and low_a[i, 2] <= high_b[j, 2]
        and low_b[j, 2] <= high_a[i, 2]
    )


@njit(forceinline=False)
def boxes_apart(low_a, high_a, low_b, high_b, i, j):
    """Squared distance of two boxes."""
    total = 0.0
    for k in range(3):
        gap = max(low_a[i, k] - high_b[j, k], low_b[j, k] - high_a[i, k], 0.0)
        total += gap * gap
    return total
