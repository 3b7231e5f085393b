"""The pairs of edges that may touch: a tree over the boxes of edges near other pieces, or their own."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.contact.mesh.distances import edge_edge_square
from supple.contact.search.candidates import Room
from supple.contact.search.pair_kernels import RUNS
from supple.contact.search.surfaces import ContactSurfaces
from supple.numerics.adjacency import in_list
from supple.numerics.geometry.box_tree import (
    STACK,
    BoxTree,
    after_leaf,
    boxes_of_labels,
    near_boxes,
    next_leaf,
    overlap,
)
from supple.runtime.kernel_cache import njit, prange
from supple.solvers.xpbd.contact.detection.piece_runs import EDGE_EDGE, keys_of
from supple.solvers.xpbd.contact.detection.surface_edges import SurfaceEdges

# Edges of one piece are compared only where the surface is compressed, where it can cross itself within one fold, and
# where folds meet: where a point is near a triangle that it is not near at rest.
SQUEEZED = 0.75


@njit
def _is_stitched(ends, f, triangles, e, stitched):
    """Whether an end of edge f is stitched to a triangle of edge e."""
    for k in range(2):
        t = triangles[e, k]
        if t >= 0:
            for i in range(2):
                if in_list(stitched, t, ends[f, i]):
                    return True
    return False


@njit
def _share_an_end(ends, e, f):
    return ends[e, 0] == ends[f, 0] or ends[e, 0] == ends[f, 1] or ends[e, 1] == ends[f, 0] or ends[e, 1] == ends[f, 1]


@np.errstate(invalid="ignore", over="ignore")
def folded_edges(
    x: NDArray[np.float64],
    ends: NDArray[np.int32],
    lengths: NDArray[np.float64],
    pieces: NDArray[np.int32],
    together: NDArray[np.bool_],
    near: tuple,
    surfaces: tuple,
) -> NDArray[np.bool_]:
    """The edges (e,) that have an end where the surface may cross itself; see `SQUEEZED`.

    Only edges of pieces that may touch themselves.

    Parameters
    ----------
    x : (n, 3) points; ends : (e, 2); lengths : (e,) of the edges at rest [m]; pieces : (e,)
    together : (p, p) whether two pieces may touch, either way
    near : starts (n + 1,) and triangles: those near each point, see `PairFinder`
    surfaces : point_piece (n,), triangles (t, 3), triangle_piece (t,)
    """
    marked = np.zeros(len(x), dtype=np.bool_)
    starts, listed = near
    point_piece, triangles, triangle_piece = surfaces
    point = np.repeat(np.arange(len(x)), np.diff(starts))
    own = triangle_piece[listed] == point_piece[point]
    marked[point[own]] = True
    marked[triangles[listed[own]]] = True
    a, b = ends.T
    u, v, w = (x[a] - x[b]).T
    marked[ends[together.diagonal()[pieces] & (u * u + v * v + w * w < (SQUEEZED * lengths) ** 2)]] = True
    return marked[a] | marked[b]


@njit(cache=True)
def _boxes_of_edges(x, ends, margin, boxes):
    """Write the boxes of edges (e, 2) of points (n, 3), with their margins (e,), to boxes (e, 6) [m]."""
    for e in range(len(ends)):
        for j in range(3):
            a, b = x[ends[e, 0], j], x[ends[e, 1], j]
            boxes[e, j], boxes[e, 3 + j] = min(a, b) - margin[e], max(a, b) + margin[e]


@njit(cache=True)
def _meet_pieces(boxes, pieces, piece_boxes, starts, near, meets):
    """Note which boxes of edges meet the box of another piece; starts, near : see `near_boxes`."""
    for e in range(len(boxes)):
        for i in range(starts[pieces[e]], starts[pieces[e] + 1]):
            if overlap(piece_boxes, near[i], boxes[e]):
                meets[e] = True
                break


@njit(cache=True, parallel=True, rows=0)
def pairs_within_margins(
    x,
    margin,
    own_margin,
    boxes,
    folded,
    near,
    nodes,
    labels,
    order,
    pieces,
    together,
    ends,
    triangles,
    starts,
    points,
    room,
    counts,
    out,
):
    """Write the pairs of edges that are nearer than both margins, each once, to the room of each run; see `Room`.

    Parameters
    ----------
    x, pieces, together, ends : see `folded_edges`; margin, boxes : see `_boxes_of_edges`
    own_margin : (e,) for pairs of one piece [m]
    folded : (e,) those that are also compared with edges of their own piece
    near : (k,) the edges of the tree; nodes, labels, order : of the tree over their boxes, labelled with pieces
    triangles : (e, 2) beside each edge, -1 for none; starts (t + 1,), points : those stitched to each triangle
    """
    for r in prange(RUNS):
        stack = np.empty(STACK, dtype=np.int64)
        count = 0
        for q in range(r, len(order), RUNS):
            e = near[order[q]]
            box = boxes[e]
            for same in (False, True):
                if same and not folded[e]:
                    continue
                top = after_leaf(nodes, q, box, stack)
                while top > 0:
                    leaf, top = next_leaf(nodes, labels, box, pieces[e], same, stack, top)
                    if leaf < 0:
                        continue
                    f = near[order[leaf]]
                    reach = own_margin[e] + own_margin[f] if same else margin[e] + margin[f]
                    if (
                        not together[pieces[e], pieces[f]]
                        or (same and not folded[f])
                        or _share_an_end(ends, e, f)
                        or edge_edge_square(x, ends, e, f) > reach * reach
                        or _is_stitched(ends, f, triangles, e, (starts, points))
                        or _is_stitched(ends, e, triangles, f, (starts, points))
                    ):
                        continue
                    if room[r] + count < room[r + 1]:
                        out[room[r] + count, 0] = min(e, f)
                        out[room[r] + count, 1] = max(e, f)
                    count += 1
        counts[r] = count


class EdgePairs:
    """Pairs of edges that may touch.

    Parameters
    ----------
    rest : (n, 3) points at rest [m]
    stitched : starts (t + 1,) and points: those stitched to each triangle

    Attributes
    ----------
    keys : (k,) of the pairs, ascending
    """

    def __init__(
        self,
        edges: SurfaceEdges,
        surfaces: ContactSurfaces,
        rest: NDArray[np.float64],
        stitched: tuple[NDArray[np.int64], NDArray[np.int32]],
    ) -> None:
        e = len(edges.ends)
        self.edges = edges
        self.arrays = (edges.ends, edges.opposite)
        self.keys = np.zeros(0, dtype=np.int64)
        self._surfaces = (surfaces.point_piece, surfaces.triangles, surfaces.triangle_piece)
        self._pieces = surfaces.point_piece[edges.ends[:, 0]]
        self._together = surfaces.allowed | surfaces.allowed.T
        self._stitched = stitched
        self._lengths = np.linalg.norm(rest[edges.ends[:, 0]] - rest[edges.ends[:, 1]], axis=1)
        self._boxes = np.zeros((e, 6))
        self._room = Room()
        self._first = self._second = np.zeros(0, dtype=np.int32)

    def __len__(self) -> int:
        return len(self.edges.ends)

    def choose(self, allowed: NDArray[np.bool_]) -> None:
        """List pairs of pieces (p, p) that may touch in one direction only."""
        self._together[:] = allowed | allowed.T

    def renew(self, x: NDArray[np.float64], motions: tuple, gaps: NDArray[np.float64], near: tuple) -> None:
        """List the pairs that may touch before a point has moved too far.

        Parameters
        ----------
        x : (n, 3) [m]; motions : two (n,), how far each point may move, absolutely and relative to its piece [m]
        gaps : (n,) the largest gap that each point keeps [m]; near : see `folded_edges`
        """
        a, b = self.edges.ends.T
        margin, own = (np.maximum(each[a], each[b]) + 0.5 * gaps[a] for each in motions)
        # A point may move more relative to a piece that turns than absolutely.
        _boxes_of_edges(x, self.edges.ends, np.maximum(margin, own), self._boxes)
        piece_boxes = boxes_of_labels(self._boxes, self._pieces, len(self._together))
        starts, others = near_boxes(piece_boxes, self._together)
        meets = np.zeros(len(self._boxes), dtype=np.bool_)
        if len(others):
            _meet_pieces(self._boxes, self._pieces, piece_boxes, starts, others, meets)
        rest = (self._lengths, self._pieces, self._together)
        folded = folded_edges(x, self.edges.ends, *rest, near, self._surfaces)
        taking_part = np.flatnonzero((meets | folded) & np.isfinite(self._boxes).all(axis=1))
        pairs = np.zeros((0, 2), dtype=np.int32)
        if len(taking_part):
            tree = BoxTree.over(self._boxes[taking_part], self._pieces[taking_part])
            nodes = (taking_part, tree.nodes, tree.labels, tree.order)
            rules = (self._pieces, self._together, self.edges.ends, self.edges.triangles, *self._stitched)
            room = self._room
            while True:
                pairs_within_margins(
                    x, margin, own, self._boxes, folded, *nodes, *rules, room.start, room.counts, room.pairs
                )
                if not room.is_too_small():
                    break
            pairs = room.sorted(len(self.edges.ends))
        self._first, self._second = np.ascontiguousarray(pairs[:, 0]), np.ascontiguousarray(pairs[:, 1])
        self.keys = keys_of(EDGE_EDGE, self._first, self._second)

    def numbered(self, rows: NDArray[np.int64]) -> tuple:
        """The argument `pairs` of `find_edge_contacts`, for these rows."""
        return self._first, self._second, rows
