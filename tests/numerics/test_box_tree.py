"""Trees of boxes against brute force."""

import numpy as np
import pytest

from supple.numerics.geometry.box_tree import STACK, BoxTree, after_leaf, next_leaf
from supple.runtime.kernel_cache import njit


def boxes(count, seed, size=0.2):
    rng = np.random.default_rng(seed)
    low = rng.random((count, 3)) * [1.0, 0.3, 2.0]
    return np.concatenate([low, low + size * rng.random((count, 3))], axis=1)


def overlaps(first, second):
    low, high = first[:, None, :3] <= second[None, :, 3:], first[:, None, 3:] >= second[None, :, :3]
    return (low & high).all(axis=2)


@njit
def pairs_of(nodes, labels, order, label_of, same, out):
    stack = np.empty(STACK, dtype=np.int64)
    leaves = len(nodes) // 2
    count = 0
    for q in range(len(order)):
        top = after_leaf(nodes, q, nodes[leaves + q], stack)
        while top > 0:
            leaf, top = next_leaf(nodes, labels, nodes[leaves + q], label_of[order[q]], same, stack, top)
            if leaf >= 0:
                out[count, 0], out[count, 1] = min(order[q], order[leaf]), max(order[q], order[leaf])
                count += 1
    return count


@pytest.mark.parametrize("same", [True, False])
@pytest.mark.parametrize("count", [0, 1, 2, 3, 64, 65, 300])
def test_pairs_of_one_set_are_found_once_and_labels_leave_branches_out(count, same):
    item = boxes(count, 3)
    labels = (np.arange(count) // 37).astype(np.int32)
    tree = BoxTree.over(item, labels)
    out = np.empty((100_000, 2), dtype=np.int64)
    found = out[: pairs_of(tree.nodes, tree.labels, tree.order, labels, same, out)]
    wanted = np.triu(overlaps(item, item), 1) & ((labels[:, None] == labels) == same)
    assert sorted(map(tuple, found.tolist())) == list(map(tuple, np.argwhere(wanted).tolist()))
    assert len(found) > 40 or count < 300


def test_boxes_that_touch_overlap():
    out = np.empty((1, 2), dtype=np.int64)
    labels = np.zeros(2, dtype=np.int32)
    for low, count in ((1.0, 1), (np.nextafter(1.0, 2.0), 0)):
        tree = BoxTree.over(np.array([[0.0, 0.0, 0.0, 1.0, 1.0, 1.0], [low, 0.5, 0.5, 2.0, 2.0, 2.0]]))
        assert pairs_of(tree.nodes, tree.labels, tree.order, labels, True, out) == count
