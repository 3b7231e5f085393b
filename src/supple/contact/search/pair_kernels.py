"""Kernels of the broad phase: what comes near what while points move on straight lines.

A pair is found where the boxes that its two parts sweep overlap, enlarged by `reach`, and where the distance at the
beginning is below `reach` and the lengths of both ways.

Queries are divided into runs whose number does not depend on the number of threads. Each run writes to its own room of
the result; where a room is too small, the run only counts.
"""

from __future__ import annotations

import math

import numpy as np

from supple.contact.mesh.distances import edge_edge_square, point_triangle_square
from supple.numerics.adjacency import in_list
from supple.numerics.geometry.box_tree import STACK, after_leaf, from_root, next_leaf, overlap
from supple.runtime.kernel_cache import njit, prange

RUNS = 64


@njit(cache=True, parallel=True)
def swept_boxes(begin, way, simplices, out):
    """Write the lowest and highest corner of what each simplex (m, k) of points (s, 3) sweeps to out (m, 6)."""
    for i in prange(len(simplices)):
        for j in range(3):
            low, high = np.inf, -np.inf
            for k in range(simplices.shape[1]):
                a = begin[simplices[i, k], j]
                b = a + way[simplices[i, k], j]
                low, high = min(low, a, b), max(high, a, b)
            out[i, j] = low
            out[i, 3 + j] = high


@njit(cache=True)
def boxes_of_owners(begin, way, owner, out):
    """Write the box that the points of each owner sweep to out (p, 6); inverted for owners without points."""
    out[:, :3] = np.inf
    out[:, 3:] = -np.inf
    for i in range(len(owner)):
        k = owner[i]
        for j in range(3):
            a = begin[i, j]
            b = a + way[i, j]
            out[k, j] = min(out[k, j], a, b)
            out[k, 3 + j] = max(out[k, 3 + j], a, b)


@njit
def meets_partner(box, owner, partners, owner_boxes):
    """Whether a box overlaps that of an owner that may touch its own."""
    for k in range(partners[0][owner], partners[0][owner + 1]):  # noqa: SIM110
        if overlap(owner_boxes, partners[1][k], box):
            return True
    return False


@njit(cache=True)
def partner_lists(boxes, others, allowed, start, items):
    """Lists of the owners that each may touch, where its box and that of the other overlap; returns their length.

    Parameters
    ----------
    boxes, others : (p, 6) of each owner as the first and as the second of a pair
    allowed : (p, p); start : (p + 1,) and items : (p * p,) are written
    """
    count = 0
    for a in range(len(boxes)):
        start[a] = count
        for b in range(len(boxes)):
            if allowed[a, b] and overlap(others, b, boxes[a]):
                items[count] = b
                count += 1
    start[len(boxes)] = count
    return count


@njit
def _points_of_run(r, shape, motion, rule, tree, reach, first, last, out):
    """The pairs of run r; rows `first` .. `last` of `out` are its room. Returns their number."""
    begin, triangles, owner = shape
    way, lengths = motion
    allowed, label, same, partners, owner_boxes, excluded = rule
    queries, nodes, labels, order = tree
    stack = np.empty(STACK, dtype=np.int64)
    box = np.empty(6)
    count = 0
    for q in range(r, len(queries), RUNS):
        v = queries[q]
        mine = owner[v]
        for j in range(3):
            low = begin[v, j]
            high = low + way[v, j]
            box[j] = min(low, high) - reach
            box[3 + j] = max(low, high) + reach
        if not meets_partner(box, mine, partners, owner_boxes):
            continue
        top = from_root(nodes, box, stack)
        while top > 0:
            leaf, top = next_leaf(nodes, labels, box, label[mine], same, stack, top)
            if leaf < 0:
                continue
            t = order[leaf]
            a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
            if not allowed[mine, owner[a]] or v in (a, b, c):
                continue
            far = reach + lengths[v] + max(lengths[a], lengths[b], lengths[c])
            if point_triangle_square(begin, v, triangles, t) > far * far or in_list(excluded, v, t):
                continue
            if first + count < last:
                out[first + count, 0] = v
                out[first + count, 1] = t
            count += 1
    return count


@njit
def _edges_of_run(r, shape, motion, rule, tree, reach, first, last, out):
    """The pairs of run r, each once; see `_points_of_run`."""
    begin, edges, owner = shape
    _, lengths = motion
    allowed, label, same, partners, owner_boxes, excluded = rule
    _, nodes, labels, order = tree
    leaves = len(nodes) // 2
    stack = np.empty(STACK, dtype=np.int64)
    box = np.empty(6)
    count = 0
    for q in range(r, len(order), RUNS):
        e = order[q]
        a, b = edges[e, 0], edges[e, 1]
        mine = owner[a]
        for j in range(3):
            box[j] = nodes[leaves + q, j] - reach
            box[3 + j] = nodes[leaves + q, 3 + j] + reach
        if not meets_partner(box, mine, partners, owner_boxes):
            continue
        long = reach + max(lengths[a], lengths[b])
        top = after_leaf(nodes, q, box, stack)
        while top > 0:
            leaf, top = next_leaf(nodes, labels, box, label[mine], same, stack, top)
            if leaf < 0:
                continue
            f = order[leaf]
            c, d = edges[f, 0], edges[f, 1]
            if not allowed[mine, owner[c]] or a in (c, d) or b in (c, d):
                continue
            far = long + max(lengths[c], lengths[d])
            if edge_edge_square(begin, edges, e, f) > far * far or in_list(excluded, e, f):
                continue
            if first + count < last:
                out[first + count, 0] = min(e, f)
                out[first + count, 1] = max(e, f)
            count += 1
    return count


@njit(cache=True, parallel=True)
def find_points(shape, motion, rule, tree, reach, room, counts, out):
    """All runs of the search for pairs of points and triangles."""
    begin, simplices, owner = shape
    way, lengths = motion
    allowed, label, same, partners, owner_boxes, excluded = rule
    queries, nodes, labels, order = tree
    partner_start, partner_items = partners
    excluded_start, excluded_items = excluded
    for r in prange(RUNS):
        # Numba takes no tuples of tuples into a parallel loop.
        its_rule = allowed, label, same, (partner_start, partner_items), owner_boxes, (excluded_start, excluded_items)
        its_tree = queries, nodes, labels, order
        counts[r] = _points_of_run(
            r, (begin, simplices, owner), (way, lengths), its_rule, its_tree, reach, room[r], room[r + 1], out
        )


@njit(cache=True, parallel=True)
def find_edges(shape, motion, rule, tree, reach, room, counts, out):
    """All runs of the search for pairs of edges."""
    begin, simplices, owner = shape
    way, lengths = motion
    allowed, label, same, partners, owner_boxes, excluded = rule
    queries, nodes, labels, order = tree
    partner_start, partner_items = partners
    excluded_start, excluded_items = excluded
    for r in prange(RUNS):
        # Numba takes no tuples of tuples into a parallel loop.
        its_rule = allowed, label, same, (partner_start, partner_items), owner_boxes, (excluded_start, excluded_items)
        its_tree = queries, nodes, labels, order
        counts[r] = _edges_of_run(
            r, (begin, simplices, owner), (way, lengths), its_rule, its_tree, reach, room[r], room[r + 1], out
        )


@njit(cache=True)
def sort_pairs(found, room, counts, size):
    """The pairs of all runs (k, 2) in ascending order; the first are below `size`."""
    start = np.zeros(size + 1, dtype=np.int64)
    total = 0
    for r in range(len(counts)):
        total += counts[r]
        for k in range(room[r], room[r] + counts[r]):
            start[found[k, 0] + 1] += 1
    for i in range(size):
        start[i + 1] += start[i]
    out = np.empty((total, 2), dtype=np.int32)
    fill = start[:-1].copy()
    for r in range(len(counts)):
        for k in range(room[r], room[r] + counts[r]):
            i, item = found[k, 0], found[k, 1]
            at = fill[i]
            fill[i] += 1
            while at > start[i] and out[at - 1, 1] > item:
                out[at, 1] = out[at - 1, 1]
                at -= 1
            out[at, 1] = item
    for i in range(size):
        for k in range(start[i], start[i + 1]):
            out[k, 0] = i
    return out


@njit(cache=True)
def covers(begin, end, two_ends, reference, owner, allowed, gap, limit):
    """Whether, at any moment of a straight way, pairs nearer than `gap` were nearer than `gap + limit` at `reference`.

    Parameters
    ----------
    begin, end, reference : (s, 3); two_ends : whether there is a way; otherwise `end` is not read
    owner : (s,); allowed : (p, p) which owners may touch
    """
    owners = len(allowed)
    boxes = np.empty((owners, 6))
    boxes[:, :3], boxes[:, 3:] = np.inf, -np.inf
    means, deviations = np.empty((2, owners, 3)), np.empty((2, owners))
    _motion_of_owners(begin, reference, owner, boxes, means[0], deviations[0])
    if two_ends:
        _motion_of_owners(end, reference, owner, boxes, means[1], deviations[1])
    within = _pairs_within(boxes, means[0], deviations[0], allowed, gap, limit)
    return within and (not two_ends or _pairs_within(boxes, means[1], deviations[1], allowed, gap, limit))


@njit
def _motion_of_owners(x, begin, owner, boxes, means, deviations):
    """How points moved since `begin` (s, 3): of each owner the box, the mean, and the largest deviation from the mean.

    Parameters
    ----------
    x : (s, 3) now; owner : (s,)
    boxes : (p, 6) is enlarged to hold x; means : (p, 3) and deviations : (p,) are written
    """
    counts = np.zeros(len(means))
    means[:] = 0.0
    for i in range(len(x)):
        k = owner[i]
        counts[k] += 1.0
        for j in range(3):
            means[k, j] += x[i, j] - begin[i, j]
            boxes[k, j] = min(boxes[k, j], x[i, j])
            boxes[k, 3 + j] = max(boxes[k, 3 + j], x[i, j])
    for k in range(len(means)):
        deviations[k] = 0.0
        for j in range(3):
            means[k, j] /= max(1.0, counts[k])
    for i in range(len(x)):
        k = owner[i]
        square = 0.0
        for j in range(3):
            square += (x[i, j] - begin[i, j] - means[k, j]) ** 2
        deviations[k] = max(deviations[k], square)
    for k in range(len(means)):
        deviations[k] = math.sqrt(deviations[k])


@njit
def _pairs_within(boxes, means, deviations, allowed, gap, limit):
    """Whether no two owners that may touch have moved by more than `limit` with respect to each other.

    Owners whose boxes are farther than `gap` apart may have moved by any amount. False where something is not finite.
    """
    for a in range(len(boxes)):
        for b in range(a, len(boxes)):
            if not allowed[a, b]:
                continue
            apart = False
            shift = 0.0
            for j in range(3):
                apart = apart or boxes[a, j] > boxes[b, 3 + j] + gap or boxes[b, j] > boxes[a, 3 + j] + gap
                shift += (means[a, j] - means[b, j]) ** 2
            if not apart and not deviations[a] + deviations[b] + math.sqrt(shift) <= limit:
                return False
    return True
