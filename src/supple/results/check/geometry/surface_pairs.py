"""All pairs of triangles that meet, and the closest pair of those that do not: over a tree of boxes."""

import numpy as np

from supple.results.check.geometry.box_tree import boxes_apart, boxes_meet
from supple.results.check.geometry.triangle_distance import triangles_apart
from supple.results.check.geometry.triangle_pairs import triangles_meet
from supple.runtime.kernel_cache import njit


@njit(forceinline=False)
def counts(a, b, owners, allowed, ignored, total):
    """Whether a pair of triangles is looked at: its owners may touch each other, and it is not ignored itself."""
    if not allowed[owners[a], owners[b]]:
        return False
    if len(ignored) == 0:
        return True
    key = min(a, b) * total + max(a, b)
    k = np.searchsorted(ignored, key)
    return not (k < len(ignored) and ignored[k] == key)


@njit(forceinline=False)
def push(stack, top, i, j):
    if top == len(stack):
        larger = np.empty((2 * len(stack), 2), dtype=np.int64)
        larger[:top] = stack
        stack = larger
    stack[top, 0], stack[top, 1] = i, j
    return stack, top + 1


@njit(forceinline=False)
def push_children(stack, top, nodes, i, j):
    """Put the pairs below a pair of nodes of a tree, not both leaves, on a stack; returns the stack and its top."""
    leaf_i, leaf_j = nodes[i, 2] < 0, nodes[j, 2] < 0
    if i == j:
        stack, top = push(stack, top, nodes[i, 2], nodes[i, 2])
        stack, top = push(stack, top, nodes[i, 3], nodes[i, 3])
        return push(stack, top, nodes[i, 2], nodes[i, 3])
    if leaf_j or (not leaf_i and nodes[i, 1] - nodes[i, 0] >= nodes[j, 1] - nodes[j, 0]):
        stack, top = push(stack, top, nodes[i, 2], j)
        return push(stack, top, nodes[i, 3], j)
    stack, top = push(stack, top, i, nodes[j, 2])
    return push(stack, top, i, nodes[j, 3])


@njit(cache=True)
def meeting_pairs(x, triangles, owners, allowed, ignored, low, high, order, nodes, node_low, node_high, out):
    """How many pairs of triangles meet; the first ones are written to out (k, 2).

    Parameters
    ----------
    x : (n, 3); triangles : (t, 3); owners : (t,); allowed : (p, p) which owners may touch each other
    ignored : sorted keys a t + b, a < b, of pairs of triangles that are left out
    low, high, order, nodes, node_low, node_high : the triangles' boxes, and the tree over them
    """
    found = 0
    stack, top = np.zeros((256, 2), dtype=np.int64), 1
    while top > 0:
        top -= 1
        i, j = stack[top, 0], stack[top, 1]
        if i != j and not boxes_meet(node_low, node_high, node_low, node_high, i, j):
            continue
        leaf_i, leaf_j = nodes[i, 2] < 0, nodes[j, 2] < 0
        if leaf_i and leaf_j:
            for p in range(nodes[i, 0], nodes[i, 1]):
                a = order[p]
                for q in range(p + 1 if i == j else nodes[j, 0], nodes[j, 1]):
                    b = order[q]
                    if not boxes_meet(low, high, low, high, a, b):
                        continue
                    if counts(a, b, owners, allowed, ignored, len(triangles)) and triangles_meet(
                        x, triangles[a], triangles[b]
                    ):
                        if found < len(out):
                            out[found, 0], out[found, 1] = a, b
                        found += 1
        else:
            stack, top = push_children(stack, top, nodes, i, j)
    return found


@njit(cache=True)
def closest_pair(x, triangles, owners, allowed, ignored, low, high, order, nodes, node_low, node_high, best):
    """The squared distance of the closest triangles without a common corner, and which they are; -1 where none is
    closer than sqrt(best). Parameters as of `meeting_pairs`."""
    first, second = -1, -1
    stack, top = np.zeros((256, 2), dtype=np.int64), 1
    while top > 0:
        top -= 1
        i, j = stack[top, 0], stack[top, 1]
        if i != j and boxes_apart(node_low, node_high, node_low, node_high, i, j) >= best:
            continue
        leaf_i, leaf_j = nodes[i, 2] < 0, nodes[j, 2] < 0
        if leaf_i and leaf_j:
            for p in range(nodes[i, 0], nodes[i, 1]):
                a = order[p]
                for q in range(p + 1 if i == j else nodes[j, 0], nodes[j, 1]):
                    b = order[q]
                    if boxes_apart(low, high, low, high, a, b) >= best:
                        continue
                    if _neighbours(triangles[a], triangles[b]):
                        continue
                    if not counts(a, b, owners, allowed, ignored, len(triangles)):
                        continue
                    apart = triangles_apart(x, triangles[a], triangles[b])
                    if apart < best:
                        best, first, second = apart, a, b
        elif i == j:
            stack, top = push(stack, top, nodes[i, 2], nodes[i, 3])
            stack, top = push(stack, top, nodes[i, 2], nodes[i, 2])
            stack, top = push(stack, top, nodes[i, 3], nodes[i, 3])
        else:
            split_i = leaf_j or (not leaf_i and nodes[i, 1] - nodes[i, 0] >= nodes[j, 1] - nodes[j, 0])
            far, near = (
                (nodes[i, 2], j) if split_i else (i, nodes[j, 2]),
                ((nodes[i, 3], j) if split_i else (i, nodes[j, 3])),
            )
            if boxes_apart(node_low, node_high, node_low, node_high, far[0], far[1]) < boxes_apart(
                node_low, node_high, node_low, node_high, near[0], near[1]
            ):
                far, near = near, far
            stack, top = push(stack, top, far[0], far[1])
            stack, top = push(stack, top, near[0], near[1])
    return best, first, second


@njit(forceinline=False)
def _neighbours(s, t):
    for i in range(3):
        for j in range(3):
            if s[i] == t[j]:
                return True
    return False
