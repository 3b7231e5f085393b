"""Candidates for contact, kept from one search to the next while no new ones are possible.

A search is made for a region: every point may be within a margin of its own straight way. Wherever on its way a point
is, no other pair comes near, so that one search serves every shorter way of the same points. A region is convex: a
straight way from one place in it to another stays in it. Points of one thing go along with its mean motion, which is
left out between them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.contact.features.pair_geometry import EDGE_EDGE, VERTEX_TRIANGLE, corners
from supple.contact.mesh.contact_mesh import ContactMesh
from supple.contact.search.distances import edge_edge_square, point_triangle_square
from supple.contact.search.patch_search import PatchSearch
from supple.numerics.geometry.box_tree import boxes_of_labels, near_boxes
from supple.runtime.kernel_cache import njit, prange

# Margins are this share of the longest way, between these shares of dhat and of the mean edge: points that move little
# do not need a new search for several steps, and the pairs that are kept stay few. Around a place, fewer are kept.
_SHARE, _LEAST, _MOST, _MOST_NEAR = 0.5, 0.5, 0.3, 0.1


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

    def where(self, of_points: NDArray[np.bool_], of_edges: NDArray[np.bool_]) -> Candidates:
        """The chosen pairs (k,), (l,)."""
        return Candidates(self.vertex_triangle[of_points], self.edge_edge[of_edges])

    def distances(self, mesh: ContactMesh, points: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
        """(k,), (l,) of the pairs at `points` (s, 3) [m]."""
        parts = mesh.triangles, mesh.edges
        of_points = distances(points, VERTEX_TRIANGLE, *parts, self.vertex_triangle)
        return of_points, distances(points, EDGE_EDGE, *parts, self.edge_edge)


_NONE = np.zeros((0, 2), dtype=np.int32), np.zeros((0, 2), dtype=np.int32)


class Region(NamedTuple):
    """Where points may be: within a margin of their ways.

    Attributes
    ----------
    begin : (s, 3) where the ways begin [m]; way, own : (s, 3) whole, and without the mean of the owner's points [m]
    margin, own_margin : of ways as a whole, and without these means [m]
    """

    begin: NDArray[np.float64]
    way: NDArray[np.float64]
    own: NDArray[np.float64]
    margin: float
    own_margin: float


class Latest(NamedTuple):
    """What a finder has found around its latest place: every pair that is nearer than dhat [m] there, and more."""

    dhat: float
    near: Candidates
    around: Region


class CandidateFinder:
    """Finds what is near what on a surface that moves.

    Parameters
    ----------
    dhat : [m] candidates are pairs whose distances, less the offsets of `ContactMesh`, may be below this

    Attributes
    ----------
    mesh : the surface; searches : how many have been made; reach : dhat and the largest offsets of two sides [m]
    """

    def __init__(self, mesh: ContactMesh, dhat: float) -> None:
        self.mesh, self.dhat, self.searches = mesh, dhat, 0
        self.reach = dhat + 2.0 * float(mesh.offsets.max(initial=0.0))
        self._patches = PatchSearch(mesh.parts, mesh.patches)
        edge = float(mesh.edge_lengths.mean()) if len(mesh.edge_lengths) else 0.0
        self._margins = _LEAST * dhat, max(_LEAST * dhat, _MOST * edge)
        self._most_near = max(_LEAST * dhat, _MOST_NEAR * edge)
        present = np.zeros(len(mesh.collide), dtype=np.bool_)  # half-spaces have no points
        present[mesh.owner] = True
        touch = mesh.collide & present & present[:, None]
        self._self = np.diag(np.diag(touch))
        self._others = touch & ~self._self
        self._kinds = bool(self._self.any()), bool(self._others.any())
        # All pairs that come nearer than dhat while points are in the region, with their distances where it begins, and
        # those of them that do so around the latest place.
        self._wide = self._near = Candidates(*_NONE)
        self._distances = np.zeros(0), np.zeros(0)
        zero = np.zeros((len(mesh.owner), 3))
        self._region = self._around = Region(zero, zero, zero, -1.0, -1.0)

    def find(self, begin: NDArray[np.float64], end: NDArray[np.float64]) -> Candidates:
        """Every pair that may come nearer than dhat while points move straight from `begin` (s, 3) to `end`, and more.

        The pairs with a common point, pairs that may not touch, and stitched pairs are left out.
        """
        if min(self._left(begin, self._around), self._left(end, self._around)) >= 0.0:
            return self._near
        if min(self._left(begin, self._region), self._left(end, self._region)) < 0.0:
            self._search(begin, end - begin)
        return self._possible((begin, end), self.reach)

    def at(self, points: NDArray[np.float64]) -> Candidates:
        """Every pair that is nearer than dhat at `points` (s, 3), and more; see `find`."""
        if self._left(points, self._around) >= 0.0:
            return self._near
        left = self._left(points, self._region)
        if left < 0.0:
            self._search(points, np.zeros_like(points))
            left = min(self._region.margin, self._region.own_margin)
        margin = min(left, self._most_near)
        reach = self.reach + 2.0 * margin
        possible = self._possible((points,), reach)
        self._near = possible.where(*(found < reach for found in possible.distances(self.mesh, points)))
        zero = np.zeros_like(points)
        self._around = Region(points.copy(), zero, zero, margin, margin)
        return self._near

    @property
    def latest(self) -> Latest:
        """For a finder of the same surface; see `resume`."""
        return Latest(self.dhat, self._near, self._around)

    def resume(self, latest: Latest) -> None:
        """Find no pairs again around a place where another finder of the same surface has found them."""
        less = max(0.0, 0.5 * (self.dhat - latest.dhat))
        around = latest.around
        self._near = latest.near
        self._around = around._replace(margin=around.margin - less, own_margin=around.own_margin - less)

    def longest(self, begin: NDArray[np.float64], way: NDArray[np.float64]) -> float:
        """The length [m] of the longest of the ways (s, 3) from `begin`, in which owners that meet nothing do not move
        as a whole."""
        meeting = np.asarray(self._meeting(begin, way, self.reach).any(axis=1))[self.mesh.owner]
        return _largest(np.where(meeting[:, None], way, self._without_mean(way)))

    def _search(self, begin: NDArray[np.float64], way: NDArray[np.float64]) -> None:
        """Find the candidates along a way."""
        self.searches += 1
        own, (least, most) = self._without_mean(way), self._margins
        own_margin, margin = (min(max(_SHARE * _largest(ways), least), most) for ways in (own, way))
        reach, own_reach = self.reach + 2.0 * margin, self.reach + 2.0 * own_margin
        kinds = (own, own_reach, self._self), (way, reach, self._meeting(begin, way, reach))
        kinds = [kind for kind in kinds if kind[2].any()]
        found = [self._patches.find(begin, *kind[:2], collide=kind[2], apart=True) for kind in kinds]
        self._wide = Candidates(*(_ascending(np.concatenate(both)) for both in zip(_NONE, *found, strict=True)))
        self._distances = self._wide.distances(self.mesh, begin)
        self._region = Region(begin.copy(), way, own, margin, own_margin)

    def _possible(self, places: Sequence[NDArray[np.float64]], reach: float) -> Candidates:
        """The pairs that may be nearer than `reach` on straight ways between places (s, 3): distances shrink by no more
        than points move."""
        moved, own = np.zeros(len(self.mesh.owner)), np.zeros(len(self.mesh.owner))
        for place in places:
            _lengthen(place, self._region.begin, self.mesh.owner, len(self._others), moved, own)
        mesh, chosen = self.mesh, []
        kinds = (VERTEX_TRIANGLE, self._wide.vertex_triangle), (EDGE_EDGE, self._wide.edge_edge)
        for (kind, pairs), distances in zip(kinds, self._distances, strict=True):
            motion = moved, own, mesh.owner
            chosen.append(_stay_within(kind, mesh.triangles, mesh.edges, pairs, distances, motion, reach))
        return self._wide.where(*chosen)

    def _meeting(self, begin: NDArray[np.float64], way: NDArray[np.float64], reach: float) -> NDArray[np.bool_]:
        """(p, p) the owners whose boxes may come nearer than `reach` while each is somewhere on its way (s, 3)."""
        out = np.zeros_like(self._others)
        if self._kinds[1]:
            end = begin + way
            boxes = np.concatenate([np.minimum(begin, end), np.maximum(begin, end) + reach], axis=1)
            starts, others = near_boxes(boxes_of_labels(boxes, self.mesh.owner, len(out)), self._others)
            one = np.repeat(np.arange(len(out)), np.diff(starts))
            out[one, others] = out[others, one] = True
        return out

    def _without_mean(self, way: NDArray[np.float64]) -> NDArray[np.float64]:
        """(s, 3) ways without the mean of the owner's."""
        return way - _means(way, np.zeros_like(way), self.mesh.owner, len(self._others))[0][self.mesh.owner]

    def _left(self, points: NDArray[np.float64], region: Region) -> float:
        """How much farther points (s, 3) may go off their ways [m]; negative outside of a region."""
        if True not in self._kinds:
            return np.inf
        if region.margin < 0.0:
            return -1.0
        return float(_left_of(points, region, self.mesh.owner, len(self._others), self._kinds))


@njit(cache=True)
def _means(x, begin, owner, count):
    """(count, 3) the mean displacement of each owner's points, and of all."""
    means, points, mean = np.zeros((count, 3)), np.zeros(count), np.zeros(3)
    for i in range(len(x)):
        points[owner[i]] += 1.0
        for j in range(3):
            means[owner[i], j] += x[i, j] - begin[i, j]
            mean[j] += (x[i, j] - begin[i, j]) / len(x)
    for k in range(count):
        for j in range(3):
            means[k, j] /= max(points[k], 1.0)
    return means, mean


@njit
def _off(x, begin, way, shifts, owner):
    """The largest distance of points x (s, 3), shifted back by their owners' shifts (p, 3), from ways; infinite where
    not finite."""
    most, moved = 0.0, np.empty(3)
    for i in range(len(x)):
        along = square = off = 0.0
        for j in range(3):
            moved[j] = x[i, j] - begin[i, j] - shifts[owner[i], j]
            along, square = along + moved[j] * way[i, j], square + way[i, j] * way[i, j]
        part = min(max(along / square, 0.0), 1.0) if square > 0.0 else 0.0
        for j in range(3):
            off += (moved[j] - part * way[i, j]) ** 2
        if not off <= most:
            most = off if off < np.inf else np.inf
    return math.sqrt(most)


@njit(cache=True)
def _left_of(x, region, owner, count, kinds):
    """How much farther points may go off their ways, between parts of one owner and of several."""
    left, (means, mean) = np.inf, _means(x, region.begin, owner, count)
    if kinds[0]:
        left = region.own_margin - _off(x, region.begin, region.own, means, owner)
    if kinds[1]:
        shifts = np.zeros((count, 3))
        off = _off(x, region.begin, region.way, shifts, owner)
        if off > region.margin:
            shifts += mean  # a common motion changes no distance
            off = min(off, _off(x, region.begin, region.way, shifts, owner))
        left = min(left, region.margin - off)
    return left


@njit(cache=True)
def _lengthen(x, begin, owner, count, moved, own):
    """Let how far points go (s,), as a whole and without the mean of their owner, be at least what they go to x."""
    means, _ = _means(x, begin, owner, count)
    for i in range(len(x)):
        whole = rest = 0.0
        for j in range(3):
            d = x[i, j] - begin[i, j]
            whole, rest = whole + d * d, rest + (d - means[owner[i], j]) ** 2
        moved[i], own[i] = max(moved[i], math.sqrt(whole)), max(own[i], math.sqrt(rest))


def _largest(ways: NDArray[np.float64]) -> float:
    """The length of the longest of the ways (s, 3)."""
    return float(np.sqrt(np.einsum("ij,ij->i", ways, ways).max(initial=0.0)))


@njit(cache=True)
def _stay_within(kind, triangles, edges, pairs, distances, motion, reach):
    """Which pairs (k, 2) at `distances` (k,) may come nearer than `reach` where points move no farther than `motion`
    says: as a whole, and without the mean of their owner."""
    moved, own, owner = motion
    out = np.empty(len(pairs), dtype=np.bool_)
    for k in range(len(pairs)):
        a, b, c, d = corners(kind, triangles, edges, pairs[k, 0], pairs[k, 1])
        far = own if owner[a] == owner[c] else moved
        if kind == EDGE_EDGE:
            most = max(far[a], far[b]) + max(far[c], far[d])
        else:
            most = far[a] + max(far[b], far[c], far[d])
        out[k] = distances[k] - most < reach
    return out


def _ascending(pairs: NDArray[np.int32]) -> NDArray[np.int32]:
    keys = np.sort(pairs[:, 0].astype(np.int64) << 32 | pairs[:, 1])
    return np.stack([keys >> 32, keys & 0xFFFFFFFF], axis=1).astype(np.int32)


@njit(cache=True, parallel=True)
def distances(x, kind, triangles, edges, pairs):
    """(k,) of pairs (k, 2) of points and triangles, or of edges [m]."""
    out = np.empty(len(pairs))
    for k in prange(len(pairs)):
        i, j = pairs[k, 0], pairs[k, 1]
        square = edge_edge_square(x, edges, i, j) if kind == EDGE_EDGE else point_triangle_square(x, i, triangles, j)
        out[k] = math.sqrt(square)
    return out
