"""All pairs of triangles that meet, or penetrate each other, and the closest pair of others: over trees of boxes."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.results.check.geometry.box_tree import boxes_apart, boxes_meet, moving_boxes_meet
from supple.results.check.geometry.moving_triangles import triangles_pass
from supple.results.check.geometry.triangle_distance import triangles_apart
from supple.results.check.geometry.triangle_pairs import shared_corners, triangles_meet
from supple.runtime.kernel_cache import njit


class Triangles(NamedTuple):
    """Triangles, and which pairs of them are looked at.

    Attributes
    ----------
    corners : (t, 3) rows of points; owners : (t,) the things that they belong to
    allowed : (p, p) which owners may not touch each other
    ignored : sorted keys a t + b, a < b, of pairs of triangles that are left out
    """

    corners: NDArray[np.int64]
    owners: NDArray[np.int64]
    allowed: NDArray[np.bool_]
    ignored: NDArray[np.int64]


@njit(forceinline=False)
def _counts(surface, a, b):
    """Whether a pair of triangles is looked at."""
    if not surface.allowed[surface.owners[a], surface.owners[b]]:
        return False
    key = min(a, b) * len(surface.corners) + max(a, b)
    k = np.searchsorted(surface.ignored, key)
    return not (k < len(surface.ignored) and surface.ignored[k] == key)


@njit(forceinline=False)
def _push(stack, top, i, j):
    if top == len(stack):
        larger = np.empty((2 * len(stack), 2), dtype=np.int64)
        larger[:top] = stack
        stack = larger
    stack[top, 0], stack[top, 1] = i, j
    return stack, top + 1


@njit(forceinline=False)
def _push_children(stack, top, nodes, i, j):
    """Put the pairs below a pair of nodes of a tree, not both leaves, on a stack; returns the stack and its top."""
    leaf_i, leaf_j = nodes[i, 2] < 0, nodes[j, 2] < 0
    if i == j:
        stack, top = _push(stack, top, nodes[i, 2], nodes[i, 3])
        stack, top = _push(stack, top, nodes[i, 2], nodes[i, 2])
        return _push(stack, top, nodes[i, 3], nodes[i, 3])
    if leaf_j or (not leaf_i and nodes[i, 1] - nodes[i, 0] >= nodes[j, 1] - nodes[j, 0]):
        stack, top = _push(stack, top, nodes[i, 2], j)
        return _push(stack, top, nodes[i, 3], j)
    stack, top = _push(stack, top, i, nodes[j, 2])
    return _push(stack, top, i, nodes[j, 3])


@njit(cache=True)
def touching_pairs(surface, x0, x1, tree, later, moving, out):
    """How many pairs of triangles meet, or penetrate each other between x0 and x1; the first are in out (k, 2).

    Parameters
    ----------
    surface : `Triangles`; x0, x1 : (n, 3) points, the same where nothing moves
    tree, later : the tree over the triangles, with the boxes of x0 and with those of x1
    moving : whether pairs that penetrate each other are wanted
    """
    found, nodes, order = 0, tree.nodes, tree.order
    stack, top = np.zeros((256, 2), dtype=np.int64), 1
    while top > 0:
        top -= 1
        i, j = stack[top, 0], stack[top, 1]
        if moving:
            near = i == j or moving_boxes_meet(tree.node_low, tree.node_high, later.node_low, later.node_high, i, j)
        else:
            near = i == j or boxes_meet(tree.node_low, tree.node_high, i, j)
        if not near:
            continue
        if nodes[i, 2] >= 0 or nodes[j, 2] >= 0:
            stack, top = _push_children(stack, top, nodes, i, j)
            continue
        for p in range(nodes[i, 0], nodes[i, 1]):
            for q in range(p + 1 if i == j else nodes[j, 0], nodes[j, 1]):
                a, b = order[p], order[q]
                if moving:
                    near = moving_boxes_meet(tree.low, tree.high, later.low, later.high, a, b)
                else:
                    near = boxes_meet(tree.low, tree.high, a, b)
                if not near or not _counts(surface, a, b):
                    continue
                s, t = surface.corners[a], surface.corners[b]
                if triangles_pass(x0, x1, s, t) if moving else triangles_meet(x0, s, t):
                    if found < len(out):
                        out[found, 0], out[found, 1] = a, b
                    found += 1
    return found


@njit(cache=True)
def closest_pair(surface, x, tree, best):
    """The squared distance of the closest triangles without a common corner, and which they are; -1 where none is
    closer than sqrt(best). Parameters as of `touching_pairs`."""
    first, second, nodes, low, high = -1, -1, tree.nodes, tree.node_low, tree.node_high
    stack, top = np.zeros((256, 2), dtype=np.int64), 1
    while top > 0:
        top -= 1
        i, j = stack[top, 0], stack[top, 1]
        if i != j and boxes_apart(low, high, i, j) >= best:
            continue
        if nodes[i, 2] >= 0 or nodes[j, 2] >= 0:
            stack, top = _push_children(stack, top, nodes, i, j)
            far, near = stack[top - 2].copy(), stack[top - 1].copy()
            if i != j and boxes_apart(low, high, far[0], far[1]) < boxes_apart(low, high, near[0], near[1]):
                stack[top - 2], stack[top - 1] = near, far
            continue
        for p in range(nodes[i, 0], nodes[i, 1]):
            for q in range(p + 1 if i == j else nodes[j, 0], nodes[j, 1]):
                a, b = tree.order[p], tree.order[q]
                if boxes_apart(tree.low, tree.high, a, b) >= best:
                    continue
                s, t = surface.corners[a], surface.corners[b]
                if shared_corners(s, t) or not _counts(surface, a, b):
                    continue
                apart = triangles_apart(x, s, t)
                if apart < best:
                    best, first, second = apart, a, b
    return best, first, second
