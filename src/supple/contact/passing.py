"""Whether things pass each other on the direct way from one state to another.

A minimization only knows the state at the end of its step, and continuous detection keeps it from going through things,
not from going around them. The direct way shows it: every owner turns and moves evenly, and what changes its shape
changes straight. What rolls, slides or bends cuts a little of what it goes around off this way. So things have to go
deep into each other: deeper than the thinner one is thick, and than half of the way beside each other, which is so long
that a minimization takes the way back.
"""

from __future__ import annotations

from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from supple.contact.ccd import NO_FLOOR, collision_time, is_clear
from supple.contact.features.pair_geometry import EDGE_EDGE, VERTEX_TRIANGLE, any_across, corners, unit
from supple.contact.mesh.contact_mesh import ContactMesh
from supple.contact.search.patch_search import PatchSearch
from supple.numerics.geometry.box_tree import boxes_of_labels, near_boxes
from supple.numerics.geometry.closest_points import closest_on_segments, closest_on_triangle
from supple.numerics.mat3 import row
from supple.runtime.kernel_cache import njit

# Of the way beside each other: where things would go deeper, the minimum may be around.
_BESIDE = 0.5
# Directions in which that way is measured.
_ACROSS = 8
# What turns does so in pieces of this angle [rad], of which the chord cuts off half a percent of the radius.
_TURN = 0.2
# What moves far is followed in pieces of this many mean edges, in which little is near its path; as many at most.
_PIECE, _MOST_PIECES = 4.0, 256
# Parts meet where their distance falls to this power of a tenth.
_ROUNDS = 5


class Passing:
    """The test for one mesh.

    Parameters
    ----------
    rest : (s, 3) the points of the mesh at rest [m]

    Attributes
    ----------
    searches : how many have been made
    """

    def __init__(self, mesh: ContactMesh, rest: NDArray[np.float64]) -> None:
        self.mesh, self._rest, self.searches = mesh, rest, 0
        self._owners = int(mesh.owner.max(initial=-1)) + 1

    @cached_property
    def _thickness(self) -> NDArray[np.float64]:
        """(p,) thickness of shells, mean thickness 2 V / A of other bodies, infinite for obstacles [m]."""
        mesh = self.mesh
        of_triangle = mesh.owner[mesh.triangles[:, 0]]
        a, b, c = self._rest[mesh.triangles].transpose(1, 0, 2)
        areas = 0.5 * np.cross(b - a, c - a)
        volumes = np.bincount(of_triangle, np.einsum("ij,ij->i", a, areas) / 3.0, self._owners)
        surfaces = np.bincount(of_triangle, np.linalg.norm(areas, axis=1), self._owners)
        out = 2.0 * np.abs(volumes) / np.maximum(surfaces, np.finfo(np.float64).tiny)
        out[mesh.owner] = np.where(mesh.offsets > 0.0, 2.0 * mesh.offsets, out[mesh.owner])  # shells contain no volume
        out[mesh.body_count :] = np.inf
        return out

    def between(self, begin: NDArray[np.float64], end: NDArray[np.float64]) -> tuple[int, int] | None:
        """Points of two things that go deep into each other, or through, from `begin` to `end` (s, 3); else None."""
        mesh, p, ways = self.mesh, self._owners, end - begin
        if p == 0 or not np.isfinite(ways).all():
            return None
        sizes = np.maximum(np.bincount(mesh.owner, minlength=p), 1)[:, None]
        means = _sums(mesh.owner, ways, p) / sizes
        others = np.zeros(p)
        np.maximum.at(others, mesh.owner, np.linalg.norm(ways - means[mesh.owner], axis=1))
        # Nothing goes deeper than it moves.
        fastest = np.linalg.norm(means - means.mean(axis=0), axis=1) + others
        if 2.0 * fastest.max() <= self._thickness.min():
            return None
        center = _sums(mesh.owner, begin, p) / sizes
        for x0, x1 in _path(begin, end, mesh.owner, center, center + means):
            # With what is around them, as boxes of what is flat or straight would overlap for no time.
            around = [np.concatenate([x - mesh.offsets[:, None], x + mesh.offsets[:, None]], axis=1) for x in (x0, x1)]
            boxes = [boxes_of_labels(limits, mesh.owner, p) for limits in around]
            swept = np.concatenate(
                [np.minimum(boxes[0], boxes[1])[:, :3], np.maximum(boxes[0], boxes[1])[:, 3:]], axis=1
            )
            starts, other = near_boxes(swept, mesh.collide[:p, :p])
            own = np.flatnonzero(np.diag(mesh.collide)[:p])
            one, other = np.append(np.repeat(np.arange(p), np.diff(starts)), own), np.append(other, own)
            far = np.linalg.norm(means[one] - means[other], axis=1) + others[one] + others[other]
            fast = far > np.minimum(self._thickness[one], self._thickness[other])
            first, last = _times_of_overlap(boxes[0], boxes[1], one[fast], other[fast])
            near = first < last
            if near.any():
                which = np.zeros_like(mesh.collide)
                which[one[fast][near], other[fast][near]] = True
                met = self._deep_meeting(x0, x1, (first[near].min(), last[near].max()), which, end)
                if met is not None:
                    return met
        return None

    def _deep_meeting(
        self,
        x0: NDArray[np.float64],
        x1: NDArray[np.float64],
        times: tuple[float, float],
        which: NDArray[np.bool_],
        end: NDArray[np.float64],
    ) -> tuple[int, int] | None:
        """Points of two owners, of those asked for (p, p), that meet between two times of the straight way from x0 to
        x1 (s, 3), and go deep into each other up to the `end` (s, 3)."""
        mesh, ways = self.mesh, x1 - x0
        search = PatchSearch(mesh.parts._replace(collide=which), mesh.patches)
        among = ways - ways.mean(axis=0)
        longest = (times[1] - times[0]) * float(np.sqrt(np.einsum("ij,ij->i", among, among).max()))
        pieces = min(max(1, int(np.ceil(longest / (_PIECE * float(mesh.edge_lengths.mean()))))), _MOST_PIECES)
        share = (times[1] - times[0]) / pieces
        for piece in range(pieces):
            x, way = x0 + (times[0] + piece * share) * ways, share * ways
            self.searches += 1
            found = search.find(x, way, 0.0)
            for kind, pairs in zip((VERTEX_TRIANGLE, EDGE_EDGE), found, strict=True):
                met = np.zeros((len(pairs), 8))
                _write_meetings(x, way, end, kind, mesh.triangles, mesh.edges, pairs, met)
                for k in np.flatnonzero(met[:, 0] > 0.0):
                    a, _, b, _ = corners(kind, mesh.triangles, mesh.edges, *pairs[k])
                    one, other = int(mesh.owner[a]), int(mesh.owner[b])
                    least = min(self._thickness[one], self._thickness[other])
                    if met[k, 0] > least:
                        beside = self._beside(one, other, met[k, 1:4], x + met[k, 4] * way, met[k, 5:])
                        least = max(least, _BESIDE * beside)
                    if met[k, 0] > least:
                        return int(a), int(b)
        return None

    def _beside(
        self, one: int, other: int, n: NDArray[np.float64], x: NDArray[np.float64], place: NDArray[np.float64]
    ) -> float:
        """How far two owners at x (s, 3) have to move across n to be beside each other, or an open rod that they meet
        at `place` has to slip over its end [m]."""
        u = np.array(any_across(tuple(n)))
        angles = 2.0 * np.pi * np.arange(_ACROSS) / _ACROSS
        across = np.outer(np.cos(angles), u) + np.outer(np.sin(angles), np.cross(n, u))
        heights, limits = x[self.mesh.owner == one] @ across.T, x[self.mesh.owner == other] @ across.T
        ends = np.flatnonzero((np.diff(self.mesh.neighbors.start) == 1) & np.isin(self.mesh.owner, (one, other)))
        tails = np.linalg.norm(x[ends] - place, axis=1)
        return float(np.min(np.append(tails, heights.max(axis=0) - limits.min(axis=0))))


def _path(
    begin: NDArray[np.float64],
    end: NDArray[np.float64],
    owner: NDArray[np.int32],
    c0: NDArray[np.float64],
    c1: NDArray[np.float64],
) -> list[tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """The pieces of a way on which every owner, with centers c0 and c1 (p, 3), turns evenly: points where each begins
    and ends."""
    r0, r1, p = begin - c0[owner], end - c1[owner], len(c0)
    moments = _sums(owner, (r1[:, :, None] * r0[:, None, :]).reshape(-1, 9), p)
    U, _, Vt = np.linalg.svd(moments.reshape(p, 3, 3))
    U[:, :, 2] *= np.sign(np.linalg.det(U) * np.linalg.det(Vt))[:, None]
    R = U @ Vt
    turns = Rotation.from_matrix(R).as_rotvec()
    pieces = int(np.ceil(np.linalg.norm(turns, axis=1).max() / _TURN))
    ends = [begin]
    if pieces > 1:
        r1 = np.einsum("sji,sj->si", R[owner], r1)
        for t in np.arange(1, pieces) / pieces:
            part = Rotation.from_rotvec(t * turns).as_matrix()[owner]
            turned = np.einsum("sij,sj->si", part, (1.0 - t) * r0 + t * r1)
            ends.append(((1.0 - t) * c0 + t * c1)[owner] + turned)
    return list(pairwise([*ends, end]))


def _sums(owner: NDArray[np.int32], values: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """(count, k) of values (s, k) by owner."""
    return np.stack([np.bincount(owner, column, count) for column in values.T], axis=1).astype(np.float64)


def _times_of_overlap(
    begin: NDArray[np.float64], end: NDArray[np.float64], one: NDArray[np.int64], other: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(k,) when the boxes of owners begin and cease to overlap, which move from `begin` to `end` (p, 6), in [0, 1]."""
    first, last = np.zeros(len(one)), np.ones(len(one))
    for low, high in ((one, other), (other, one)):
        gap, final = (boxes[high, 3:] - boxes[low, :3] for boxes in (begin, end))
        with np.errstate(divide="ignore", invalid="ignore"):
            times = gap / (gap - final)
        first = np.maximum(first, np.where(gap < 0.0, np.where(final < 0.0, np.inf, times), 0.0).max(axis=1))
        last = np.minimum(last, np.where(final < 0.0, np.where(gap < 0.0, -np.inf, times), 1.0).min(axis=1))
    return first, last


@njit(cache=True)
def _write_meetings(x, way, end, kind, triangles, edges, pairs, met):
    """For each of the pairs (k, 2) that meet while points go from x along `way` (s, 3): how deep they are beyond the
    place of the meeting at `end` (s, 3), the normal there, the time, and the place."""
    y, w, four = np.empty((4, 3)), np.empty((4, 3)), (0, 1, 2, 3)
    for k in range(len(pairs)):
        points = corners(kind, triangles, edges, pairs[k, 0], pairs[k, 1])
        if is_clear(x, way, kind, points, 0.0):
            continue
        for i in range(4):
            for m in range(3):
                y[i, m], w[i, m] = x[points[i], m], way[points[i], m]
        now = 0.0
        for _ in range(_ROUNDS):
            time = collision_time(y, w, kind, four, 1.0 - now, NO_FLOOR, 0.0)
            now += time
            if now > 1.0:
                break
            for i in range(4):
                for m in range(3):
                    y[i, m] += time * w[i, m]
        if now > 1.0:
            continue
        a, b, c, d = row(y, 0), row(y, 1), row(y, 2), row(y, 3)
        if kind == VERTEX_TRIANGLE:
            u = closest_on_triangle(a, b, c, d)
            shares = (1.0, -u[0], -u[1], -u[2])
            met[k, 5:] = y[0]
        else:
            s, t = closest_on_segments(a, b, c, d)
            shares = (1.0 - s, s, t - 1.0, -t)
            met[k, 5:] = (1.0 - s) * y[0] + s * y[1]
        r, moved = np.zeros(3), np.zeros(3)
        for i in range(4):
            for m in range(3):
                r[m] += shares[i] * y[i, m]
                moved[m] += shares[i] * (end[points[i], m] - y[i, m])
        n = unit((r[0], r[1], r[2]))
        met[k, 0], met[k, 4] = -(n[0] * moved[0] + n[1] * moved[1] + n[2] * moved[2]), now
        for m in range(3):
            met[k, 1 + m] = n[m]
