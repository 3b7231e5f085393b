"""Overlaps of axis-aligned boxes: a binary tree of boxes over primitives in Morton order.

The tree is complete: node k has the children 2 k and 2 k + 1, and the primitives are its leaves, in the order of their
centers' Morton codes.

A node also has the label that all primitives below it share, or -1. Searches use it to leave out whole branches.
Primitives of one label are therefore next to each other in the order, and the labels in that of their boxes' centers.

Kernels search with a stack of nodes:

    top = after_leaf(nodes, leaf, box, stack)
    while top > 0:
        leaf, top = next_leaf(nodes, labels, box, label, same, stack, top)
        if leaf >= 0:
            ...                                         # the box of primitive order[leaf] overlaps

Source: Lauterbach et al., "Fast BVH Construction on GPUs" (2009), for the order along the Morton curve.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.runtime.kernel_cache import njit

# Entries of a search's stack: a tree over 2^31 primitives has 32 levels, and a search begins with one node of each.
STACK = 80
# Boxes that are compared with one node at once.
GROUP = 16


@dataclass(eq=False)
class BoxTree:
    """A tree over m boxes with labels.

    Attributes
    ----------
    order : (m,) the primitive of each leaf
    nodes : (2 p, 6) lowest and highest corner of each node, p the power of two that is at least m; node 1 is the root
    labels : (2 p,) of the nodes
    """

    order: NDArray[np.int32]
    nodes: NDArray[np.float64]
    labels: NDArray[np.int32]

    @classmethod
    def over(cls, boxes: NDArray[np.float64], labels: NDArray[np.int32] | None = None) -> BoxTree:
        """A tree over boxes (m, 6), lowest and highest corner of each, with labels (m,) >= 0 (default: all 0)."""
        leaves = 1
        while leaves < len(boxes):
            leaves *= 2
        own = np.zeros(len(boxes), dtype=np.int32) if labels is None else labels
        order = np.lexsort((morton_codes(boxes), _places_of_labels(boxes, own)[own])).astype(np.int32)
        nodes = np.empty((2 * leaves, 6))
        _fill(boxes, order, nodes)
        return cls(order, nodes, _labels_of_nodes(own, order, leaves))


def boxes_of_triangles(
    x: NDArray[np.float64], triangles: NDArray[np.int32], moves: NDArray[np.float64] | None = None
) -> NDArray[np.float64]:
    """(t, 6) lowest and highest corner of triangles (t, 3) of points (n, 3), each enlarged by the largest of the
    distances (n,) that its corners may move [m]; default: 0."""
    out = np.empty((len(triangles), 6))
    _boxes_of_triangles(x, triangles, np.zeros(len(x)) if moves is None else np.ascontiguousarray(moves), out)
    return out


@njit(cache=True)
def _boxes_of_triangles(x, triangles, moves, out):
    """NumPy takes fifty times as long."""
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        margin = max(moves[a], moves[b], moves[c])
        for j in range(3):
            out[t, j] = min(x[a, j], x[b, j], x[c, j]) - margin
            out[t, 3 + j] = max(x[a, j], x[b, j], x[c, j]) + margin


def _places_of_labels(boxes: NDArray[np.float64], labels: NDArray[np.int32]) -> NDArray[np.int64]:
    """The place of each label (p,) in the order of the Morton codes of the boxes of all that has it."""
    together = boxes_of_labels(boxes, labels, labels.max(initial=-1) + 1)
    return np.argsort(np.argsort(morton_codes(together), kind="stable"))


def boxes_of_labels(boxes: NDArray[np.float64], labels: NDArray[np.int32], count: int) -> NDArray[np.float64]:
    """(count, 6) the box of all boxes (m, 6) that have a label (m,); from infinity to minus infinity where none has."""
    out = np.empty((count, 6))
    out[:, :3], out[:, 3:] = np.inf, -np.inf
    _extend_boxes(boxes, labels, out)
    return out


@njit(cache=True)
def _extend_boxes(boxes, labels, out):
    for i in range(len(boxes)):
        k = labels[i]
        for j in range(3):
            out[k, j], out[k, 3 + j] = min(out[k, j], boxes[i, j]), max(out[k, 3 + j], boxes[i, 3 + j])


@njit
def overlap(nodes, i, box):
    """Whether node i overlaps a box of six numbers; touching counts."""
    # Without branches: which of the comparisons fails first cannot be predicted.
    return (
        (nodes[i, 0] <= box[3])
        & (nodes[i, 3] >= box[0])
        & (nodes[i, 1] <= box[4])
        & (nodes[i, 4] >= box[1])
        & (nodes[i, 2] <= box[5])
        & (nodes[i, 5] >= box[2])
    )


@njit
def which_overlap(nodes, i, boxes):
    """The boxes (6, GROUP) that node i overlaps, as bits of a number. Without branches, this is vector code."""
    found = 0
    for k in range(GROUP):
        found |= (
            (boxes[0, k] <= nodes[i, 3])
            & (boxes[3, k] >= nodes[i, 0])
            & (boxes[1, k] <= nodes[i, 4])
            & (boxes[4, k] >= nodes[i, 1])
            & (boxes[2, k] <= nodes[i, 5])
            & (boxes[5, k] >= nodes[i, 2])
        ) << k
    return found


@njit
def after_leaf(nodes, leaf, box, stack):
    """Begin a search of the leaves after this one: pairs of one set of primitives are then found once."""
    i = len(nodes) // 2 + leaf
    top = 0
    while i > 1:
        if i % 2 == 0 and overlap(nodes, i + 1, box):
            stack[top] = i + 1
            top += 1
        i //= 2
    return top


@njit
def next_leaf(nodes, labels, box, label, same, stack, top):
    """The next leaf that overlaps, or -1, and the height of the stack.

    Parameters
    ----------
    label, same : where `same`, branches of other labels are left out; otherwise branches of this label. -1 and False:
        nothing is left out
    """
    leaves = len(nodes) // 2
    while top > 0:
        top -= 1
        i = stack[top]
        if labels[i] >= 0 and (labels[i] == label) != same:
            continue
        if i >= leaves:
            return i - leaves, top
        if overlap(nodes, 2 * i + 1, box):
            stack[top] = 2 * i + 1
            top += 1
        if overlap(nodes, 2 * i, box):
            stack[top] = 2 * i
            top += 1
    return -1, 0


@njit(cache=True)
def morton_codes(boxes):
    """(m,) 63 bits: those of the three coordinates of each center in turn."""
    low = np.empty(3)
    size = 0.0
    for j in range(3):
        a, b = np.inf, -np.inf
        for i in range(len(boxes)):
            c = boxes[i, j] + boxes[i, 3 + j]
            a, b = min(a, c), max(b, c)
        low[j] = a
        size = max(size, b - a)
    scale = 2097151.0 / size if 0.0 < size < np.inf else 0.0
    codes = np.empty(len(boxes), dtype=np.int64)
    for i in range(len(boxes)):
        code = np.int64(0)
        for j in range(3):
            v = np.int64((boxes[i, j] + boxes[i, 3 + j] - low[j]) * scale)
            v = (v | (v << 32)) & 0x1F00000000FFFF
            v = (v | (v << 16)) & 0x1F0000FF0000FF
            v = (v | (v << 8)) & 0x100F00F00F00F00F
            v = (v | (v << 4)) & 0x10C30C30C30C30C3
            v = (v | (v << 2)) & 0x1249249249249249
            code |= v << j
        codes[i] = code
    return codes


@njit(cache=True)
def _fill(boxes, order, nodes):
    """Compute all nodes."""
    leaves = len(nodes) // 2
    for k in range(leaves):
        if k < len(order):
            for j in range(6):
                nodes[leaves + k, j] = boxes[order[k], j]
        else:
            for j in range(3):
                nodes[leaves + k, j] = np.inf
                nodes[leaves + k, 3 + j] = -np.inf
    for i in range(leaves - 1, 0, -1):
        for j in range(3):
            nodes[i, j] = min(nodes[2 * i, j], nodes[2 * i + 1, j])
            nodes[i, 3 + j] = max(nodes[2 * i, 3 + j], nodes[2 * i + 1, 3 + j])


@njit(cache=True)
def _labels_of_nodes(labels, order, leaves):
    out = np.full(2 * leaves, -2, dtype=np.int32)  # -2 without a primitive
    for k in range(len(order)):
        out[leaves + k] = labels[order[k]]
    for i in range(leaves - 1, 0, -1):
        a, b = out[2 * i], out[2 * i + 1]
        if a == b or b == -2:
            out[i] = a
        else:
            out[i] = b if a == -2 else -1
    return out


def near_boxes(boxes: NDArray[np.float64], together: NDArray[np.bool_]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """For each of a few boxes (p, 6) the others that overlap it, of those that are `together` (p, p): starts, found.

    The box of nothing has its lowest corner above its highest one.
    """
    starts = np.zeros(len(boxes) + 1, dtype=np.int64)
    found = starts[:0]
    if np.count_nonzero(boxes[:, 0] <= boxes[:, 3]) > 1:
        # Side by side in memory: most pairs are apart along the first axis.
        arrays = boxes, boxes[:, 0].copy(), boxes[:, 3].copy(), together, starts
        _near_boxes(*arrays, found)
        np.cumsum(starts, out=starts)
        found = np.empty(starts[-1], dtype=np.int64)
        if len(found):
            _near_boxes(*arrays, found)
    return starts, found


@njit(cache=True)
def _near_boxes(boxes, low, high, together, starts, found):
    """Count what is near box k in starts[k + 1]; where `found` has capacity for that, write it instead."""
    count = len(boxes)
    for k in range(count):
        total = 0
        for other in range(count):
            if low[other] > high[k] or high[other] < low[k] or other == k or not together[k, other]:
                continue
            if overlap(boxes, other, boxes[k]):
                if len(found) > 0:
                    found[starts[k] + total] = other
                total += 1
        if len(found) == 0:
            starts[k + 1] = total
