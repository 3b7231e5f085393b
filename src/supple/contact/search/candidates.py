"""Pairs of parts of a surface that may be near each other, and the trees by which they are found."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.contact.mesh.contact_mesh import ContactMesh
from supple.contact.mesh.distances import edges_nearer, points_nearer
from supple.contact.search.pair_kernels import (
    RUNS,
    boxes_of_owners,
    find_edges,
    find_points,
    partner_lists,
    sort_pairs,
    swept_boxes,
)
from supple.numerics.adjacency import Adjacency
from supple.numerics.geometry.box_tree import BoxTree, morton_codes


class Room:
    """Where each run of a search writes its pairs; grows as needed and is kept from search to search.

    Attributes
    ----------
    start : (RUNS + 1,) where the rows of each run begin; pairs : (start[-1], 2) int32
    counts : (RUNS,) what each run found, which may be more than fits
    """

    def __init__(self) -> None:
        self.start = np.zeros(RUNS + 1, dtype=np.int64)
        self.counts = np.zeros(RUNS, dtype=np.int64)
        self.pairs = np.zeros((0, 2), dtype=np.int32)

    def sorted(self, size: int) -> NDArray[np.int32]:
        """The pairs of all runs (k, 2) in ascending order; the first are below `size`."""
        found = self.counts.any()
        return sort_pairs(self.pairs, self.start, self.counts, size) if found else np.zeros((0, 2), dtype=np.int32)

    def is_too_small(self) -> bool:
        """Whether some run found more than fits; then there is room for that, and more, for the next attempt."""
        if (self.counts <= np.diff(self.start)).all():
            return False
        np.cumsum(self.counts + self.counts // 2 + 64, out=self.start[1:])
        self.pairs = np.empty((self.start[-1], 2), dtype=np.int32)
        return True


@dataclass(frozen=True, eq=False)
class Candidates:
    """Pairs in an order that depends on the input alone.

    Attributes
    ----------
    vertex_triangle : (k, 2) int32 points and triangles, ascending
    edge_edge : (l, 2) int32 edges, the lower first, ascending
    """

    vertex_triangle: NDArray[np.int32]
    edge_edge: NDArray[np.int32]

    def __len__(self) -> int:
        return len(self.vertex_triangle) + len(self.edge_edge)

    def nearer_than(self, mesh: ContactMesh, points: NDArray[np.float64], reach: float) -> Candidates:
        """The pairs whose distance at `points` (s, 3) is below `reach` [m]."""
        of_points = points_nearer(points, mesh.triangles, self.vertex_triangle, reach)
        of_edges = edges_nearer(points, mesh.edges, self.edge_edge, reach)
        return Candidates(self.vertex_triangle[of_points], self.edge_edge[of_edges])

    def joined(self, other: Candidates) -> Candidates:
        """These pairs, then others."""
        if len(other) == 0:
            return self
        return Candidates(
            np.concatenate([self.vertex_triangle, other.vertex_triangle]),
            np.concatenate([self.edge_edge, other.edge_edge]),
        )


class Rule(NamedTuple):
    """Which pairs a search looks for.

    Attributes
    ----------
    allowed : (p, p) the owners of a pair; same : whether these are all of one owner, or all of two
    """

    allowed: NDArray[np.bool_]
    same: bool


class SurfaceTrees:
    """Searches a surface that moves. The trees are refitted, and sorted again where that makes them bad."""

    def __init__(self, mesh: ContactMesh) -> None:
        self._mesh = mesh
        self._points = np.arange(len(mesh.points), dtype=np.int32)[:, None]
        self._boxes = np.empty((len(mesh.triangles), 6)), np.empty((len(mesh.edges), 6))
        self._trees: tuple[BoxTree, BoxTree] | None = None
        self._queries = np.zeros(0, dtype=np.int32)
        # Obstacles never touch each other, so they have one label.
        self._label = np.minimum(np.arange(len(mesh.collide)), mesh.body_count).astype(np.int32)
        self._rooms: dict[bool, tuple[Room, Room]] = {True: (Room(), Room()), False: (Room(), Room())}
        none = np.zeros(max(len(mesh.points), len(mesh.edges)) + 1, dtype=np.int32)
        nothing = Adjacency(none, none[:0])
        stitched = mesh.stitched
        self._excluded = (
            (nothing, nothing) if stitched is None else (stitched.triangles_of_point, stitched.edges_of_edge)
        )

    def find(self, rule: Rule, begin: NDArray[np.float64], way: NDArray[np.float64], reach: float) -> Candidates:
        """Pairs that may come nearer than `reach` [m] while points move straight from `begin` (s, 3) along `way`."""
        mesh = self._mesh
        simplices = mesh.triangles, mesh.edges
        for part, boxes in zip(simplices, self._boxes, strict=True):
            swept_boxes(begin, way, part, boxes)
        triangle_tree, edge_tree = self._sorted(begin, way)
        owner_boxes = np.empty((len(mesh.collide), 6))
        boxes_of_owners(begin, way, mesh.owner, owner_boxes)
        partners = Adjacency(np.empty(len(rule.allowed) + 1, np.int32), np.empty(rule.allowed.size, np.int32))
        if not partner_lists(_enlarged(owner_boxes, reach), owner_boxes, rule.allowed, *partners):
            return Candidates(np.zeros((0, 2), np.int32), np.zeros((0, 2), np.int32))
        motion = way, np.sqrt(np.einsum("ij,ij->i", way, way))
        of_points, of_edges = self._rooms[rule.same]
        for kernel, room, part, tree, excluded in (
            (find_points, of_points, mesh.triangles, triangle_tree, self._excluded[0]),
            (find_edges, of_edges, mesh.edges, edge_tree, self._excluded[1]),
        ):
            shape = begin, part, mesh.owner
            pairs_of = rule.allowed, self._label, rule.same, partners, owner_boxes, excluded
            within = self._queries, tree.nodes, tree.labels, tree.order
            while True:
                kernel(shape, motion, pairs_of, within, reach, room.start, room.counts, room.pairs)
                if not room.is_too_small():
                    break
        return Candidates(
            of_points.sorted(len(mesh.points)),
            of_edges.sorted(len(mesh.edges)),
        )

    def _sorted(self, begin: NDArray[np.float64], way: NDArray[np.float64]) -> tuple[BoxTree, BoxTree]:
        """The trees with the present boxes."""
        if self._trees is not None:
            suit = [tree.refit(boxes) for tree, boxes in zip(self._trees, self._boxes, strict=True)]
            if all(suit):
                return self._trees
        mesh = self._mesh
        labels = [self._label[mesh.owner[part[:, 0]]] for part in (mesh.triangles, mesh.edges)]
        of_triangles, of_edges = (BoxTree.over(*pair) for pair in zip(self._boxes, labels, strict=True))
        boxes = np.empty((len(self._points), 6))
        swept_boxes(begin, way, self._points, boxes)
        self._queries = np.argsort(morton_codes(boxes), kind="stable").astype(np.int32)
        self._trees = of_triangles, of_edges
        return self._trees


def _enlarged(boxes: NDArray[np.float64], margin: float) -> NDArray[np.float64]:
    """Boxes (m, 6) with a margin [m] on all sides."""
    return boxes + np.repeat([-margin, margin], 3)
