"""The check of what happens between frames: surfaces that pass through each other."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.results.check.frame_check import FrameCheck
from supple.results.check.geometry.passing_pairs import passing_pairs
from supple.results.check.report import CheckResult
from supple.results.check.snapshot import Snapshot

_MOST_PAIRS = 1000
# Straight pieces of a smooth path from frame to frame.
_PIECES = 8

Floats = NDArray[np.float64]


def passing_between(before: Snapshot, x1: Floats, x0: Floats | None = None) -> tuple[int, NDArray[np.int64]]:
    """How many pairs of triangles pass from a frame's points, or x0 instead, to x1, and the first (k, 2) of them."""
    surfaces = before.scene.surfaces
    out = np.zeros((_MOST_PAIRS, 2), dtype=np.int64)
    shared = surfaces.triangles, surfaces.owners, surfaces.allowed, surfaces.ignored
    count = passing_pairs(before.points if x0 is None else x0, x1, *shared, *before.tree[2:4], out)
    return count, out[: min(count, _MOST_PAIRS)]


class Tunnelling(FrameCheck):
    """Surfaces that pass through each other between two frames, in both of which they are apart.

    Exact for straight paths. A body that turns moves on arcs, of which straight paths cut off a part: it fails where
    surfaces pass on smooth paths through four frames as well.
    """

    name = "tunnelling"
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
        if self._passes_smoothly((before, a.points, b.points, after), a):
            where = f"{name(int(pairs[0, 0]))} and {name(int(pairs[0, 1]))}, after frame {a.number}"
            self.tally.see(b, count, True, where)
        else:
            self.tally.see(b, 0.0, False)
            self._cut = b.number if self._cut is None else self._cut

    def _passes_smoothly(self, points: tuple[Floats | None, Floats, Floats, Floats | None], tree_of: Snapshot) -> bool:
        """Whether surfaces pass on the path through all points that are there: of third degree, or lower."""
        before, first, last, after = points
        known = [(t, x) for t, x in zip((-1.0, 0.0, 1.0, 2.0), points, strict=True) if x is not None]
        if before is None and after is None:
            return True
        at = first
        for k in range(1, _PIECES + 1):
            t = k / _PIECES
            following = last if k == _PIECES else np.zeros_like(first)
            if k < _PIECES:
                for own, x in known:  # Lagrange's polynomials
                    others = [other for other, _ in known if other != own]
                    following += x * float(np.prod([(t - other) / (own - other) for other in others]))
            if passing_between(tree_of, following, at)[0]:
                return True
            at = following
        return False

    def result(self) -> CheckResult:
        if self.why_not is None:
            self._judge(None)
            if self.tally.worst is None:
                self.why_not = "there is one frame only"
        if self._cut is not None:
            self.good = f"{self.good}; straight paths cross before frame {self._cut}, those along arcs do not"
        return super().result()
