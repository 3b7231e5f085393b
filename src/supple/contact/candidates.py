"""Candidates for contact, kept from one search to the next while no new ones are possible."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.contact.mesh.contact_mesh import ContactMesh
from supple.contact.search.distances import edges_nearer, points_nearer
from supple.contact.search.patch_search import PatchSearch
from supple.runtime.kernel_cache import njit

# Margins are this share of the present motion, between these shares of dhat and of the mean edge: what moves by little
# needs no new search for several steps, and what moves by much needs one anyway.
_SHARE, _LEAST, _MOST = 0.5, 0.5, 0.1
# Points that are nearer to a straight way than this share of the margin are on it.
_ON_WAY = 0.25


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


class CandidateFinder:
    """Finds what is near what on a surface that moves.

    Contacts within one owner and between two owners are kept apart: the first do not change where a body moves as a
    whole.

    Parameters
    ----------
    dhat : [m] candidates are pairs that may be nearer than this

    Attributes
    ----------
    mesh : the surface
    """

    def __init__(self, mesh: ContactMesh, dhat: float) -> None:
        self.mesh = mesh
        one = np.eye(len(mesh.collide), dtype=np.bool_)
        self._lists = [
            _KeptList(mesh, dhat, mesh.collide & one, True),
            _KeptList(mesh, dhat, mesh.collide & ~one, False),
        ]
        self._parts: list[Candidates] = []
        self._joined: Candidates | None = None

    def find(self, begin: NDArray[np.float64], end: NDArray[np.float64]) -> Candidates:
        """Every pair that may come nearer than dhat while points move straight from `begin` (s, 3) to `end`, and more.

        The pairs with a common point, pairs that may not touch, and stitched pairs are left out.
        """
        return self._together([kept.find(begin, end) for kept in self._lists])

    def at(self, points: NDArray[np.float64]) -> Candidates:
        """Every pair that is nearer than dhat at `points` (s, 3), and more; see `find`."""
        return self._together([kept.at(points) for kept in self._lists])

    def _together(self, parts: list[Candidates]) -> Candidates:
        if self._joined is None or any(a is not b for a, b in zip(parts, self._parts, strict=True)):
            self._parts, self._joined = parts, parts[0].joined(parts[1])
        return self._joined


class _KeptList:
    """The candidates of some pairs of owners.

    `_near` holds all pairs that come nearer than dhat while no two owners move by more than 2 * `_margin` with respect
    to each other, counted from `_reference`. `_wide` holds those that come nearer than dhat + 2 * `_wide_margin` along
    the latest way.
    """

    def __init__(self, mesh: ContactMesh, dhat: float, allowed: NDArray[np.bool_], same: bool) -> None:
        self._mesh, self._dhat, self._allowed, self._same = mesh, dhat, allowed, same
        self._patches = PatchSearch(mesh.parts._replace(collide=allowed), mesh.patches)
        edge = float(mesh.edge_lengths.mean()) if len(mesh.edge_lengths) else 0.0
        self._margins = _LEAST * dhat, max(_LEAST * dhat, _MOST * edge)
        self._near: Candidates | None = None
        self._reference = np.zeros((0, 3))
        self._margin = 0.0
        self._wide: Candidates | None = None
        self._begin = self._way = np.zeros((0, 3))
        self._wide_margin = 0.0
        self._owners = len(mesh.collide)
        with_points = np.bincount(mesh.owner, minlength=self._owners) > 0  # half-spaces have none
        self._possible = bool(allowed[with_points][:, with_points].any()) and len(mesh.triangles) > 0
        self._nothing = Candidates(np.zeros((0, 2), np.int32), np.zeros((0, 2), np.int32))

    def find(self, begin: NDArray[np.float64], end: NDArray[np.float64]) -> Candidates:
        if not self._possible:
            return self._nothing
        if self._near is not None and self._covers(begin, end):
            return self._near
        return self._search(begin, end - begin)

    def at(self, points: NDArray[np.float64]) -> Candidates:
        if not self._possible:
            return self._nothing
        if self._near is not None and self._covers(points):
            return self._near
        if self._wide is not None:
            off = _distance_from_way(points, self._begin, self._way)
            if off <= _ON_WAY * self._wide_margin:
                self._keep_near(points, self._wide_margin - off)
                assert self._near is not None
                return self._near
        return self._search(points, np.zeros_like(points))

    def _search(self, begin: NDArray[np.float64], way: NDArray[np.float64]) -> Candidates:
        """The candidates along a way, which become `_wide`; those at its beginning become `_near`."""
        relative = way - self._drift(way) if self._same else way
        longest = float(np.sqrt(np.einsum("ij,ij->i", relative, relative).max(initial=0.0)))
        least, most = self._margins
        margin = min(max(_SHARE * longest, least), most)
        found = Candidates(*map(_ascending, self._patches.find(begin, relative, self._dhat + 2.0 * margin)))
        self._wide, self._begin, self._way, self._wide_margin = found, begin.copy(), way, margin
        if longest > margin:
            self._keep_near(begin, margin)
        else:
            self._near, self._reference, self._margin = found, self._begin, margin
        return found

    def _drift(self, way: NDArray[np.float64]) -> NDArray[np.float64]:
        """(s, 3) the mean of the way over each owner."""
        owner, count = self._mesh.owner, self._owners
        counts = np.maximum(np.bincount(owner, minlength=count), 1)
        means = np.stack([np.bincount(owner, weights=way[:, j], minlength=count) / counts for j in range(3)], axis=1)
        return means[owner]

    def _keep_near(self, points: NDArray[np.float64], margin: float) -> None:
        assert self._wide is not None
        self._near = self._wide.nearer_than(self._mesh, points, self._dhat + 2.0 * margin)
        self._reference, self._margin = points.copy(), margin

    def _covers(self, begin: NDArray[np.float64], end: NDArray[np.float64] | None = None) -> bool:
        """Whether `_near` has all candidates at `begin`, and while points move straight from there to `end`."""
        there, limit = begin if end is None else end, 2.0 * self._margin
        owner, allowed = self._mesh.owner, self._allowed
        return _covers(begin, there, end is not None, self._reference, owner, allowed, self._dhat, limit)


def _ascending(pairs: NDArray[np.int32]) -> NDArray[np.int32]:
    keys = np.sort(pairs[:, 0].astype(np.int64) << 32 | pairs[:, 1])
    return np.stack([keys >> 32, keys & 0xFFFFFFFF], axis=1).astype(np.int32)


def _distance_from_way(x: NDArray[np.float64], begin: NDArray[np.float64], way: NDArray[np.float64]) -> float:
    """The largest distance of a point from its place at the moment of a common motion that suits all best [m]."""
    moved = x - begin
    square = float(np.vdot(way, way))
    part = min(max(float(np.vdot(moved, way)) / square, 0.0), 1.0) if square > 0.0 else 0.0
    moved -= part * way
    return float(np.sqrt(np.einsum("ij,ij->i", moved, moved).max(initial=0.0)))


@njit(cache=True)
def _covers(begin, end, two_ends, reference, owner, allowed, gap, limit):
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
