"""Lists of the triangles near each point, with search radii that differ from point to point.

A pair of a point and a triangle is listed where their distance is at most the search radius of the point and the
largest possible motion of a corner of the triangle. Both are smaller for pairs of one piece, whose motion is that
relative to the piece.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.contact.mesh.distances import point_triangle_square
from supple.contact.search.candidates import Room
from supple.contact.search.pair_kernels import RUNS, meets_partner
from supple.numerics.adjacency import in_list
from supple.numerics.geometry.box_tree import (
    GROUP,
    STACK,
    BoxTree,
    boxes_of_labels,
    boxes_of_triangles,
    from_root,
    morton_codes,
    near_boxes,
    next_leaf,
    which_overlap,
)
from supple.runtime.kernel_cache import njit, prange


@njit
def _near_group(group, shapes, radii, rules, same, tree, pieces, found, count, scratch):
    """Append the triangles near the points of a group, of their own piece or of others; returns the number of all.

    One walk through the tree serves all points of the group; see docs/theory/contact.md.

    Parameters
    ----------
    group : the points, of one piece; for the other arguments see `_list_pairs`
    pieces : for each piece those that the search looks for, and their boxes
    found : (first, last, out): rows of `out` that may be written; where they are full, pairs are only counted
    scratch : (STACK,), (6,) and (6, GROUP)
    """
    points, point_piece, triangles, triangle_piece = shapes
    allowed, excluded = rules
    nodes, labels, order = tree
    first, last, out = found
    stack, box, boxes = scratch
    mine = point_piece[group[0]]
    box[:3], box[3:] = np.inf, -np.inf
    boxes[:3], boxes[3:] = np.inf, -np.inf
    for i in range(len(group)):
        p = group[i]
        for j in range(3):
            boxes[j, i], boxes[3 + j, i] = points[p, j] - radii[p, 0], points[p, j] + radii[p, 0]
            box[j], box[3 + j] = min(box[j], boxes[j, i]), max(box[3 + j], boxes[3 + j, i])
    if not meets_partner(box, mine, pieces[0], pieces[1]):
        return count
    leaves = len(nodes) // 2
    top = from_root(nodes, box, stack)
    while top > 0:
        leaf, top = next_leaf(nodes, labels, box, mine, same, stack, top)
        if leaf < 0:
            continue
        t = order[leaf]
        meets = which_overlap(nodes, leaves + leaf, boxes)
        if meets == 0 or not allowed[mine, triangle_piece[t]]:
            continue
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        moves = max(radii[a, 1], radii[b, 1], radii[c, 1])
        for i in range(len(group)):
            p = group[i]
            if not (meets >> i) & 1 or p in (a, b, c) or in_list(excluded, t, p):
                continue
            r = radii[p, 0] + moves
            if point_triangle_square(points, p, triangles, t) > r * r:
                continue
            if first + count < last:
                out[first + count, 0] = p
                out[first + count, 1] = t
            count += 1
    return count


@njit(cache=True, parallel=True, rows=0)
def _list_pairs(shapes, groups, radii, rules, partners, boxes, far_tree, near_tree, room, counts, out):
    """Write the pairs of each run of groups to its room of `out`, and their number to `counts`.

    Parameters
    ----------
    shapes, radii, rules : see `PairFinder.gather`; groups : see `_groups_of`
    partners : for each piece the others that its points may come near, and itself where that is allowed: two lists, as
        starts (p + 1,) and pieces, see `near_boxes`
    boxes : (p, 6) of the pieces' triangles, enlarged as in `far_tree`
    far_tree, near_tree : nodes, labels and order of trees of triangles, for pairs of two pieces and of one
    """
    points, point_piece, triangles, triangle_piece = shapes
    order, starts = groups
    far, near = radii
    allowed, excluded_starts, excluded_points = rules
    (other_starts, others), (own_starts, own) = partners
    far_nodes, far_labels, far_order = far_tree
    near_nodes, near_labels, near_order = near_tree
    for r in prange(RUNS):
        its_shapes = (points, point_piece, triangles, triangle_piece)
        its_rules = (allowed, (excluded_starts, excluded_points))
        found = (room[r], room[r + 1], out)
        scratch = np.empty(STACK, dtype=np.int64), np.empty(6), np.empty((6, GROUP))
        count = 0
        for g in range(r, len(starts) - 1, RUNS):
            group = order[starts[g] : starts[g + 1]]
            # One call for both: what is inlined twice is compiled twice.
            for same in (False, True):
                tree = (near_nodes, near_labels, near_order) if same else (far_nodes, far_labels, far_order)
                pieces = ((own_starts, own), boxes) if same else ((other_starts, others), boxes)
                radii_of = near if same else far
                count = _near_group(group, its_shapes, radii_of, its_rules, same, tree, pieces, found, count, scratch)
        counts[r] = count


def _groups_of(
    points: NDArray[np.float64], pieces: NDArray[np.int32], wanted: NDArray[np.bool_]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Groups of at most `GROUP` of the wanted points (n, 3), of one piece (n,), that are near each other: the points in
    order (k,), and where each group begins (g + 1,)."""
    order = np.lexsort((morton_codes(np.concatenate([points, points], axis=1)), pieces))
    order = order[wanted[order]]
    ordered = pieces[order]
    place = np.arange(len(order)) - np.searchsorted(ordered, ordered)
    return order, np.append(np.flatnonzero(place % GROUP == 0), len(order))


class PairFinder:
    """Lists of triangles near each of n points, of which some are wanted (n,). Every search reuses the same memory.

    After `gather`, the triangles near point p are `triangles[starts[p]:starts[p + 1]]` in ascending order, and
    `active[:n_active]` are the points that have any.
    """

    def __init__(self, wanted: NDArray[np.bool_]) -> None:
        self._wanted = wanted
        self._room = Room()
        self._trees: list[BoxTree] = []
        self._groups = np.zeros(0, dtype=np.int64), np.zeros(1, dtype=np.int64)
        self.starts = np.zeros(len(wanted) + 1, dtype=np.int64)
        self.active = np.zeros(0, dtype=np.int32)
        self.triangles = np.zeros(0, dtype=np.int32)
        self.n_active = 0
        self.count = 0

    def gather(self, shapes: tuple, radii: tuple, rules: tuple) -> None:
        """Find all pairs that may touch; none where something is not finite.

        Parameters
        ----------
        shapes : points (n, 3), point_piece (n,), triangles (t, 3), triangle_piece (t,)
        radii : two (n, >= 2) arrays, for pairs of different pieces and for pairs of one piece: the search radius of a
            point (with its own motion), and how far its motion may move a corner of a triangle [m]
        rules : allowed (p, p), whether points of the first may touch triangles of the second; and the excluded points
            of each triangle as starts (t + 1,) and points
        """
        points: NDArray[np.float64] = shapes[0]
        pairs = np.zeros((0, 2), dtype=np.int32)
        if np.isfinite(points).all() and len(shapes[2]):
            pairs = self._pairs(shapes, radii, rules)
        self.starts[:] = np.searchsorted(pairs[:, 0], np.arange(len(self.starts)))
        self.active = np.flatnonzero(np.diff(self.starts)).astype(np.int32)
        self.triangles = np.ascontiguousarray(pairs[:, 1])
        self.n_active, self.count = len(self.active), len(pairs)

    def _pairs(self, shapes: tuple, radii: tuple, rules: tuple) -> NDArray[np.int32]:
        """(k, 2) points and triangles, ascending."""
        points, point_piece, _, triangle_piece = shapes
        trees, far_boxes = self._sorted(shapes, radii)
        room = self._room
        pieces = len(rules[0])
        margins = radii[0][:, :1]
        of_points = boxes_of_labels(np.concatenate([points - margins, points + margins], axis=1), point_piece, pieces)
        of_triangles = boxes_of_labels(far_boxes, triangle_piece, pieces)
        boxes = boxes_of_labels(
            np.concatenate([of_points, of_triangles]), np.tile(np.arange(pieces, dtype=np.int32), 2), pieces
        )
        own = np.diagonal(rules[0])
        partners = near_boxes(boxes, rules[0]), (np.append(0, np.cumsum(own)), np.flatnonzero(own))
        arrays = [(tree.nodes, tree.labels, tree.order) for tree in trees]
        while True:
            lists = (partners, of_triangles, *arrays)
            _list_pairs(shapes, self._groups, radii, rules, *lists, room.start, room.counts, room.pairs)
            if not room.is_too_small():
                break
        return room.sorted(len(points))

    def _sorted(self, shapes: tuple, radii: tuple) -> tuple[list[BoxTree], NDArray[np.float64]]:
        """The trees of triangles for pairs of different pieces and of one piece, and the boxes (t, 6) of the first."""
        points, point_piece, triangles, triangle_piece = shapes
        trees, all_boxes = [], []
        for k, each in enumerate(radii):
            boxes = boxes_of_triangles(points, triangles, each[:, 1])
            all_boxes.append(boxes)
            if k < len(self._trees) and self._trees[k].refit(boxes):
                trees.append(self._trees[k])
            else:
                trees.append(BoxTree.over(boxes, triangle_piece))
                self._groups = _groups_of(points, point_piece, self._wanted)
        self._trees = trees
        return trees, all_boxes[0]
