"""The check of what happens between frames: surfaces that pass through each other."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from supple.results.check.frame_check import FrameCheck
from supple.results.check.geometry.passing_pairs import passing_pairs
from supple.results.check.report import CheckResult
from supple.results.check.snapshot import Snapshot

_MOST_PAIRS = 1000
# Straight pieces of a smooth path from frame to frame.
_PIECES = 8
# When a path has its kink, as shares of the time between the frames.
_KINKS = (0.25, 0.5, 0.75)

Floats = NDArray[np.float64]


def passing_between(before: Snapshot, x1: Floats, x0: Floats | None = None) -> tuple[int, NDArray[np.int64]]:
    """How many pairs of triangles pass from a frame's points, or x0 instead, to x1, and the first (k, 2) of them."""
    surfaces = before.scene.surfaces
    out = np.zeros((_MOST_PAIRS, 2), dtype=np.int64)
    shared = surfaces.triangles, surfaces.owners, surfaces.allowed, surfaces.ignored
    count = passing_pairs(before.points if x0 is None else x0, x1, *shared, *before.tree[2:4], out)
    return count, out[: min(count, _MOST_PAIRS)]


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
    """Surfaces that pass through each other between two frames, in both of which they are apart.

    Exact for straight paths. A body that turns moves on arcs, of which straight paths cut off a part, and one that hits
    another moves on a path with a kink: it fails where two bodies pass on all of these paths.
    """

    name = "tunnelling"
    needs = frozenset({"paths"})
    unit = "pairs"
    good = "nothing passes through anything between frames"
    bad = "triangles pass through each other between frames: {worst}"

    def begin(self) -> None:
        if self.settings.every > 1:
            self.why_not = "what happens between frames is known from one frame to the next only"
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
            count, pairs = passing_between(self._frames[-2], at.points)
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
        before = self._frames[-3].points if len(self._frames) > 2 else None
        after = None if following is None else following.points
        name = self.scene.surfaces.name_triangle
        pairs = self._passing_on_all(pairs, before, (a, b), after)
        if len(pairs):
            where = f"{name(int(pairs[0, 0]))} and {name(int(pairs[0, 1]))}, after frame {a.number}"
            self.tally.see(b, count, True, where)
        else:
            self.tally.see(b, 0.0, False)
            self._cut = b.number if self._cut is None else self._cut

    def _passing_on_all(
        self, pairs: NDArray[np.int64], before: Floats | None, frames: tuple[Snapshot, Snapshot], after: Floats | None
    ) -> NDArray[np.int64]:
        """The pairs of straight paths whose owners pass through each other on every other path as well."""
        owners = self.scene.surfaces.owners
        first, last = frames
        for path in paths(before, first.points, last.points, after):
            met = set()
            for x0, x1 in pairwise([first.points, *path, last.points]):
                met |= set(map(tuple, np.sort(owners[passing_between(first, x1, x0)[1]], axis=1).tolist()))
            kept = [tuple(pair) in met for pair in np.sort(owners[pairs], axis=1).tolist()]
            pairs = pairs[kept]
            if len(pairs) == 0:
                break
        return pairs

    def result(self) -> CheckResult:
        if self.why_not is None:
            self._judge(None)
            if self.tally.worst is None:
                self.why_not = "there is one frame only"
        if self._cut is not None:
            self.good = f"{self.good}; straight paths cross before frame {self._cut}, others do not"
        return super().result()
