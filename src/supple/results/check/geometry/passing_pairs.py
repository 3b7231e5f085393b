"""All pairs of triangles that pass through each other between two frames: over a tree of boxes that move."""

import numpy as np

from supple.results.check.geometry.box_tree import triangle_boxes
from supple.results.check.geometry.moving_triangles import triangles_pass
from supple.results.check.geometry.surface_pairs import counts, push_children
from supple.runtime.kernel_cache import njit


@njit(forceinline=False)
def boxes_of_nodes(low, high, order, nodes):
    """The boxes (n, 3) of the nodes of a tree, around boxes (t, 3) at another time than it was built for."""
    node_low, node_high = np.empty((len(nodes), 3)), np.empty((len(nodes), 3))
    for at in range(len(nodes) - 1, -1, -1):
        if nodes[at, 2] < 0:
            node_low[at], node_high[at] = np.inf, -np.inf
            for i in range(nodes[at, 0], nodes[at, 1]):
                for k in range(3):
                    node_low[at, k] = min(node_low[at, k], low[order[i], k])
                    node_high[at, k] = max(node_high[at, k], high[order[i], k])
        else:
            for k in range(3):
                node_low[at, k] = min(node_low[nodes[at, 2], k], node_low[nodes[at, 3], k])
                node_high[at, k] = max(node_high[nodes[at, 2], k], node_high[nodes[at, 3], k])
    return node_low, node_high


@njit(forceinline=False)
def _moving_boxes_meet(low0, high0, low1, high1, i, j):
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


@njit(cache=True)
def passing_pairs(x0, x1, triangles, owners, allowed, ignored, order, nodes, out):
    """How many pairs of triangles pass through each other between x0 and x1; the first ones are written to out (k, 2).

    Parameters
    ----------
    x0, x1 : (n, 3); order, nodes : a tree over the triangles' boxes at one of the times
    triangles, owners, allowed, ignored : as of `meeting_pairs`
    """
    low0, high0 = triangle_boxes(x0, triangles)
    low1, high1 = triangle_boxes(x1, triangles)
    node_low0, node_high0 = boxes_of_nodes(low0, high0, order, nodes)
    node_low1, node_high1 = boxes_of_nodes(low1, high1, order, nodes)
    found = 0
    stack, top = np.zeros((256, 2), dtype=np.int64), 1
    while top > 0:
        top -= 1
        i, j = stack[top, 0], stack[top, 1]
        if i != j and not _moving_boxes_meet(node_low0, node_high0, node_low1, node_high1, i, j):
            continue
        leaf_i, leaf_j = nodes[i, 2] < 0, nodes[j, 2] < 0
        if leaf_i and leaf_j:
            for p in range(nodes[i, 0], nodes[i, 1]):
                a = order[p]
                for q in range(p + 1 if i == j else nodes[j, 0], nodes[j, 1]):
                    b = order[q]
                    if not _moving_boxes_meet(low0, high0, low1, high1, a, b):
                        continue
                    if counts(a, b, owners, allowed, ignored, len(triangles)) and triangles_pass(
                        x0, x1, triangles[a], triangles[b]
                    ):
                        if found < len(out):
                            out[found, 0], out[found, 1] = a, b
                        found += 1
        else:
            stack, top = push_children(stack, top, nodes, i, j)
    return found
