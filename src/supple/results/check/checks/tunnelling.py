"""The check of what happens between frames: surfaces that penetrate each other."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from supple.mesh.topology import are_edges
from supple.results.check.frame_check import FrameCheck
from supple.results.check.geometry.containment import is_inside
from supple.results.check.geometry.vectors import area_vectors
from supple.results.check.report import CheckResult
from supple.results.check.trajectory import Snapshot

# Straight pieces of a smooth path from frame to frame.
_PIECES = 8
# When a path has its kink, as shares of the time between the frames.
_KINKS = (0.25, 0.5, 0.75)

# What continues with more of its velocity along the normal of a meeting was not touched. Fast soft balls that meet at
# 30 degrees to the normal keep up to half. Those that meet at more than 45 degrees keep most of it, and are not judged.
_GOES_ON, _FRONTAL = 0.8, 0.7
# Of the approach: what changes its velocity by more was pushed, if not by the other one; a third body or a floor hides
# what happens between two frames.
_PUSHED = 0.5
# Of the time between two frames, to find the moment of a meeting. Places on the path between them.
_HALVINGS, _SAMPLES = 12, 65

Floats = NDArray[np.float64]


def paths(before: Floats | None, first: Floats, last: Floats, after: Floats | None) -> Iterator[list[Floats]]:
    """Other paths than straight ones, as points between the first and the last ones.

    One is smooth, through the frames before and after; the others have a kink, as where something is hit: they begin
    with the motion before and end with the motion after.
    """
    known = [(t, x) for t, x in zip((-1.0, 0.0, 1.0, 2.0), (before, first, last, after), strict=True) if x is not None]
    if len(known) == 2:
        return
    smooth = []
    for t in np.arange(1, _PIECES) / _PIECES:
        x = np.zeros_like(first)
        for own, points in known:  # Lagrange's polynomials
            others = [other for other, _ in known if other != own]
            x += points * float(np.prod([(t - other) / (own - other) for other in others]))
        smooth.append(x)
    yield smooth
    straight = last - first
    begins = straight if before is None else first - before
    ends = straight if after is None else after - last
    for t in _KINKS:
        yield [0.5 * (first + t * begins + last - (1.0 - t) * ends)]
    for t in _KINKS:
        yield [first + t * begins]
        yield [last - (1.0 - t) * ends]


class Tunnelling(FrameCheck):
    """Surfaces that penetrate each other between two frames, in both of which they are apart.

    Exact for straight paths. A body that turns moves on arcs, of which straight paths cut off a part, and one that hits
    another moves on a path with a kink: it fails where two bodies pass on all of these paths.
    """

    name = "tunnelling"
    needs = frozenset({"files"})
    unit = "pairs"
    good = "nothing passes through anything between frames"
    bad = "triangles penetrate each other between frames: {worst}"
    nothing = "there is one frame only"
    in_order = "what happens between frames is known"

    def begin(self) -> None:
        self._frames: list[Snapshot] = []
        self._waiting: tuple[int, NDArray[np.int64]] | None = None
        self._cut: int | None = None

    def see(self, at: Snapshot) -> None:
        if self._frames and at.number != self._frames[-1].number + 1:
            self._judge(None)
            self._frames = []
        self._judge(at)
        self._frames = [*self._frames[-2:], at]
        if len(self._frames) > 1:
            before = self._frames[-2]
            count, pairs = self.of.surfaces.pairs(before.tree, before.points, at.points)
            if count:
                self._waiting = count, pairs
            else:
                self.tally.see(at, 0.0, False)

    def _judge(self, following: Snapshot | None) -> None:
        """Decide on what passed between the last two frames, with the frame before and the one after."""
        if self._waiting is None:
            return
        (count, pairs), self._waiting = self._waiting, None
        a, b = self._frames[-2:]
        pairs = self._passing_on_all(pairs, following)
        if len(pairs):
            self.tally.see(b, count, True, f"{self.of.surfaces.name_pair(pairs)}, after frame {a.number}")
        else:
            self.tally.see(b, 0.0, False)
            self._cut = b.number if self._cut is None else self._cut

    def _passing_on_all(self, pairs: NDArray[np.int64], following: Snapshot | None) -> NDArray[np.int64]:
        """The pairs of straight paths whose owners penetrate each other on every other path as well."""
        owners = self.of.surfaces.owners
        *before, first, last = [frame.points for frame in self._frames]
        tree, after = self._frames[-2].tree, None if following is None else following.points
        for path in paths(before[-1] if before else None, first, last, after):
            met = set()
            for x0, x1 in pairwise([first, *path, last]):
                met |= set(map(tuple, np.sort(owners[self.of.surfaces.pairs(tree, x0, x1)[1]], axis=1).tolist()))
            pairs = pairs[[tuple(pair) in met for pair in np.sort(owners[pairs], axis=1).tolist()]]
            if len(pairs) == 0:
                break
        return pairs

    def result(self) -> CheckResult:
        self._judge(None)
        if self._cut is not None:
            self.good = f"{self.good}; straight paths cross before frame {self._cut}, others do not"
        return super().result()


class GoingOn(FrameCheck):
    """Things that penetrate each other on the straight path between two frames of a recording, and continue.

    Contact bends paths within a frame, so straight ones alone show nothing. But where things meet, it takes their
    approach, and the velocities of both frames are recorded: it fails where two things that continue with their
    velocity would meet front to front, and in the next frame are past each other and still have most of their approach
    along the normal of that meeting, unless something pushed one of them or their middles go past each other. Only
    things are looked at that move farther in the frame than one of them is thick.
    """

    name = "tunnelling"
    needs = frozenset({"recording"})
    unit = "pairs"
    good = "nothing passes through anything between frames"
    bad = "things penetrate each other between frames and continue: {worst}"
    in_order = "what happens between frames is known"

    def see(self, at: Snapshot) -> None:
        before = self.last
        if before is None or at.number != before.number + 1:
            return
        passed = [
            pair
            for pair in self._through(before, at)
            if self._goes_on(before, at, pair) and self._is_central(before, at, pair)
        ]
        names = self.of.surfaces.names
        where = f"{names[passed[0][0]]} and {names[passed[0][1]]}, after frame {before.number}" if passed else ""
        self.tally.see(at, float(len(passed)), bool(passed), where)

    def _through(self, before: Snapshot, at: Snapshot) -> list[tuple[int, int]]:
        """The owners that pass on the straight path, of those that are fast."""
        surfaces = self.of.surfaces
        p, triangles, owners = len(surfaces.names), surfaces.triangles, surfaces.owners
        a, areas = before.points[triangles[:, 0]], area_vectors(before.points, triangles)
        moved = (at.points - before.points)[triangles].mean(axis=1)
        sizes = np.maximum(np.bincount(owners, minlength=p), 1)
        means = np.stack([np.bincount(owners, column, p) for column in moved.T], axis=1) / sizes[:, None]
        spread, apart = np.zeros(p), np.linalg.norm(moved - means[owners], axis=1)
        np.maximum.at(spread, owners, apart)
        volumes = np.abs(np.bincount(owners, np.einsum("ij,ij->i", a - a[0], areas) / 3.0, p))
        thickness = 2.0 * volumes / np.maximum(np.bincount(owners, np.linalg.norm(areas, axis=1), p), 1e-300)
        thickness[~np.array(surfaces.closed, dtype=bool) | (np.arange(p) >= surfaces.bodies)] = np.inf
        for body, _ in self.of.thin:
            thickness[body.number] = 2.0 * body.body.offset
        far = np.linalg.norm(means[:, None] - means, axis=2) + spread[:, None] + spread
        fast = surfaces.allowed & (far > np.minimum(thickness[:, None], thickness))
        solid = np.ones(p, dtype=bool)
        solid[[body.number for body, _ in self.of.thin]] = False
        fast[solid, solid] = False
        if not fast.any():
            return []
        pairs = owners[surfaces.pairs(before.tree, before.points, at.points, fast)[1]]
        return [(int(one), int(other)) for one, other in np.unique(np.sort(pairs, axis=1), axis=0)]

    def _goes_on(self, before: Snapshot, at: Snapshot, pair: tuple[int, int]) -> bool:
        surfaces, dt = self.of.surfaces, at.time - before.time
        only = np.zeros_like(surfaces.allowed)
        only[pair] = only[pair[::-1]] = True
        v0, v1 = (self._velocities(before, at, frame) for frame in (before, at))

        def met(share: float) -> NDArray[np.int64]:
            return surfaces.pairs(before.tree, before.points, before.points + share * dt * v0, only)[1]

        low, high = 0.0, 1.0
        if not len(met(high)):
            return False
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            low, high = (low, middle) if len(met(middle)) else (middle, high)
        n = np.zeros(3)
        first = met(high)
        first = np.where((surfaces.owners[first[:, 0]] == pair[0])[:, None], first, first[:, ::-1])
        x = before.points + high * dt * v0
        closed = [surfaces.closed[k] for k in pair]
        for sign, side in ((1.0, 1), (-1.0, 0)):
            if any(closed) and not closed[side]:  # of two sides of a sheet, nothing says which is met
                continue
            normals = area_vectors(x, surfaces.triangles[first[:, side]])
            n += sign * (normals / np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]).sum(axis=0)
        # (2, 2, 3) velocities of both where they meet, in both frames.
        v = np.stack([[v[surfaces.triangles[first[:, k]]].mean(axis=(0, 1)) for k in (0, 1)] for v in (v0, v1)])
        one, other = (at.points[surfaces.triangles[first[:, k]]].mean(axis=(0, 1)) for k in (0, 1))
        if not n.any():  # edges of rods
            n = np.cross(*(np.diff(x[surfaces.triangles[first[0, k], :2]], axis=0)[0] for k in (0, 1)))
        n /= max(float(np.linalg.norm(n)), 1e-300)
        if not any(closed):
            n *= np.sign((v[0, 1] - v[0, 0]) @ n)
        begin, end = (v[:, 1] - v[:, 0]) @ n
        return bool(
            (other - one) @ n > 0.0
            and begin > _FRONTAL * np.linalg.norm(v[0, 1] - v[0, 0])
            and end > _GOES_ON * begin
            and (np.abs((v[1] - v[0]) @ n) < _PUSHED * begin).all()
        )

    def _is_central(self, before: Snapshot, at: Snapshot, pair: tuple[int, int]) -> bool:
        """Whether the middle of one comes into the other on the straight path, where that has an inside.

        Things that meet with an edge give way sideways, and lose little of their approach.
        """
        surfaces = self.of.surfaces
        rows = [np.flatnonzero(surfaces.owners == k) for k in pair]
        closed = [surfaces.closed[k] for k in pair]
        for share in np.linspace(0.0, 1.0, _SAMPLES):
            x = before.points + share * (at.points - before.points)
            for one, other in ((0, 1), (1, 0)):
                middle = x[np.unique(surfaces.triangles[rows[one]])].mean(axis=0)
                if closed[other] and is_inside(x, middle, surfaces.triangles, rows[other]):
                    return True
        return not any(closed) and self._is_away_from_rims(before, at, pair)

    def _is_away_from_rims(self, before: Snapshot, at: Snapshot, pair: tuple[int, int]) -> bool:
        """Whether two things without an inside meet on the straight path where neither can go around the other: not at
        rims of two sheets, an edge of a rod and a rim, or the end of a rod."""
        surfaces = self.of.surfaces
        only = np.zeros_like(surfaces.allowed)
        only[pair] = only[pair[::-1]] = True
        met = surfaces.pairs(before.tree, before.points, at.points, only)[1]
        rims, of_rod = self._rims[met], are_edges(surfaces.triangles)[met]
        around = (rims | (of_rod & ~of_rod[:, ::-1])).all(axis=1) | (rims & of_rod).any(axis=1)
        return bool((~around).any())

    @cached_property
    def _rims(self) -> NDArray[np.bool_]:
        """(t,) the triangles with a corner on the rim of their sheet, and the last edges of rods."""
        triangles = self.of.surfaces.triangles
        of_rod = are_edges(triangles)
        sides = np.sort(np.concatenate([triangles[~of_rod][:, [k, (k + 1) % 3]] for k in range(3)]), axis=1)
        different, counts = np.unique(sides, axis=0, return_counts=True)
        points, uses = np.unique(triangles[of_rod, :2], return_counts=True)
        ends = np.append(different[counts == 1].ravel(), points[uses == 1])
        return np.asarray(np.isin(triangles, ends).any(axis=1))

    def _velocities(self, before: Snapshot, at: Snapshot, frame: Snapshot) -> Floats:
        """(n, 3) of all points in one of two frames; those of obstacles are what takes them from one to the other."""
        place, v = self.of.surfaces.place, (at.points - before.points) / (at.time - before.time)
        of_bodies = place(np.ones_like(frame.positions), np.zeros_like(frame.poses))[:, :1] == 1.0
        return np.where(of_bodies, place(frame.velocities, np.zeros_like(frame.poses)), v)
