"""The pairs of edges that may touch: a sweep along one axis over the boxes of edges near other pieces.

Source: Ericson, "Real-Time Collision Detection" (2005), section 7.5.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.contact.search.surfaces import ContactSurfaces
from supple.numerics.adjacency import in_list
from supple.numerics.kernel_cache import njit
from supple.xpbd.contact.detection.piece_runs import EDGE_EDGE, key_of
from supple.xpbd.contact.detection.surface_edges import SurfaceEdges

_EDGE_BITS = (1 << 31) - 1


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


@njit(cache=True)
def boxes_of_edges(x, ends, margin, pieces, together, boxes, piece_boxes):
    """Write the boxes of edges, with their margins. Returns which of them meet the box of another piece they may touch.

    Parameters
    ----------
    x : (n, 3) points; ends : (e, 2); margin : (e,) [m]; pieces : (e,)
    together : (p, p) whether two different pieces may touch, either way
    boxes : low, high (e, 3) out; piece_boxes : low, high (p, 3) out [m]
    """
    low, high = boxes
    piece_low, piece_high = piece_boxes
    piece_low[:] = np.inf
    piece_high[:] = -np.inf
    for e in range(len(ends)):
        k = pieces[e]
        for j in range(3):
            a, b = x[ends[e, 0], j], x[ends[e, 1], j]
            low[e, j], high[e, j] = min(a, b) - margin[e], max(a, b) + margin[e]
            piece_low[k, j], piece_high[k, j] = min(piece_low[k, j], low[e, j]), max(piece_high[k, j], high[e, j])
    meets = np.zeros(len(ends), dtype=np.bool_)
    for e in range(len(ends)):
        for k in range(len(together)):
            if together[pieces[e], k] and not meets[e]:
                inside = True
                for j in range(3):
                    inside = inside and low[e, j] <= piece_high[k, j] and high[e, j] >= piece_low[k, j]
                meets[e] = inside
    return meets


@njit(cache=True)
def sweep_boxes(order, boxes, pieces, together, ends, triangles, stitched, out):
    """Keys of the pairs of edges whose boxes overlap. Writes as many as fit; returns their number.

    Parameters
    ----------
    order : (k,) edges in the order of the lower ends of their boxes along x
    boxes, pieces, together, ends : see `boxes_of_edges`
    triangles : (e, 2) beside each edge, -1 for none; stitched : starts (t + 1,) and points stitched to each triangle
    out : (c,) int64
    """
    low, high = boxes
    count = 0
    for i in range(len(order)):
        e = order[i]
        for k in range(i + 1, len(order)):
            f = order[k]
            if low[f, 0] > high[e, 0]:
                break
            if (
                low[f, 1] > high[e, 1]
                or high[f, 1] < low[e, 1]
                or low[f, 2] > high[e, 2]
                or high[f, 2] < low[e, 2]
                or not together[pieces[e], pieces[f]]
                or _is_stitched(ends, f, triangles, e, stitched)
                or _is_stitched(ends, e, triangles, f, stitched)
            ):
                continue
            if count < len(out):
                out[count] = key_of(EDGE_EDGE, min(e, f), max(e, f))
            count += 1
    return count


class EdgePairs:
    """Pairs of edges that may touch.

    Attributes
    ----------
    keys : (k,) of the pairs, ascending
    """

    def __init__(
        self,
        edges: SurfaceEdges,
        surfaces: ContactSurfaces,
        stitched: tuple[NDArray[np.int64], NDArray[np.int32]],
    ) -> None:
        e, p = len(edges.ends), len(surfaces.closed)
        self.edges = edges
        self.arrays = (edges.ends, edges.opposite)
        self.keys = np.zeros(0, dtype=np.int64)
        self.smallest = np.zeros(0)
        self._pieces = surfaces.point_piece[edges.ends[:, 0]]
        self._together = (surfaces.allowed | surfaces.allowed.T) & ~np.eye(p, dtype=np.bool_)
        self._stitched = stitched
        self._boxes = np.zeros((e, 3)), np.zeros((e, 3))
        self._piece_boxes = np.zeros((p, 3)), np.zeros((p, 3))
        self._found = np.zeros(1024, dtype=np.int64)
        self._first = self._second = np.zeros(0, dtype=np.int32)

    def __len__(self) -> int:
        return len(self.edges.ends)

    def renew(self, x: NDArray[np.float64], motions: NDArray[np.float64], gaps: NDArray[np.float64]) -> None:
        """List the pairs that may touch before a point has moved too far.

        Parameters
        ----------
        x : (n, 3); motions : (n,) how far each point may move; gaps : (n,) the largest gap that it keeps [m]
        """
        a, b = self.edges.ends.T
        margin = np.maximum(motions[a], motions[b]) + 0.5 * gaps[a]
        meets = boxes_of_edges(x, self.edges.ends, margin, self._pieces, self._together, self._boxes, self._piece_boxes)
        near = np.flatnonzero(meets & np.isfinite(self._boxes[0]).all(axis=1))
        order = near[np.argsort(self._boxes[0][near, 0], kind="stable")]
        described = (self._pieces, self._together, self.edges.ends, self.edges.triangles, self._stitched)
        while True:
            count = sweep_boxes(order, self._boxes, *described, self._found)
            if count <= len(self._found):
                break
            self._found = np.zeros(2 * count, dtype=np.int64)
        self.keys = np.sort(self._found[:count])
        self._first = ((self.keys >> 31) & _EDGE_BITS).astype(np.int32)
        self._second = (self.keys & _EDGE_BITS).astype(np.int32)
        self.smallest = np.full(len(self.keys), np.inf)

    def numbered(self, rows: NDArray[np.int64]) -> tuple:
        """The argument `pairs` of `find_edge_contacts`, for these rows."""
        return self._first, self._second, rows
