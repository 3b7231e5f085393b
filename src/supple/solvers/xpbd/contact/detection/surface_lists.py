"""The lists of what may touch, until a point has moved too far; they serve later frames, too, while they hold."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.contact.search.excluded_pairs import excluded_pairs
from supple.contact.search.point_lists import PairFinder
from supple.contact.search.reach import any_beyond_radii, common_motions, search_radii
from supple.contact.search.surfaces import ContactSurfaces
from supple.solvers.xpbd.contact.contact_rows import ContactRows
from supple.solvers.xpbd.contact.detection.edge_pairs import EdgePairs
from supple.solvers.xpbd.contact.detection.near_pairs import NearPairs
from supple.solvers.xpbd.contact.detection.piece_runs import PieceRuns
from supple.solvers.xpbd.contact.detection.surface_edges import surface_edges

# Of the mean surface edge: the least and the largest motion of a point that lists allow for.
LEAST_REACH, MOST_REACH = 0.05, 0.2
# The largest motion of points of rigid bodies, whose lists are short: one body that is too fast makes all lists new.
RIGID_REACH = 0.6
# Points of each piece from which its motion as a rigid body is found in a substep.
ENOUGH_POINTS = 64


class SurfaceLists:
    """Points and the triangles near them, and pairs of edges near each other.

    Parameters
    ----------
    surfaces : of bodies and obstacles; rest : (n, 3) points at rest [m]; edge_length : the mean one [m]
    bodies : (n,) the rigid body of each point, or -1
    stitched : starts (t + 1,) and points: those stitched to each triangle

    Attributes
    ----------
    allowed : (p, p) whether points of the first piece are to be listed with triangles of the second; see `choose`
    near : the pairs that come near in a substep; pairs : the argument of `find_edge_contacts`; edges : see `EdgePairs`
    complete : (n,) up to which distance the list of a point is complete [m]
    excursions : (n,) largest distance that a point moved in a substep before contact stopped it [m]
    """

    def __init__(
        self,
        surfaces: ContactSurfaces,
        rest: NDArray[np.float64],
        edge_length: float,
        bodies: NDArray[np.int32],
        stitched: tuple[NDArray[np.int64], NDArray[np.int32]],
    ) -> None:
        s, n, pieces = surfaces, len(rest), len(surfaces.closed)
        self.allowed = s.allowed.copy()
        widest = float(np.diagonal(s.gaps).max(initial=0.0))
        self._rules = (self.allowed, *excluded_pairs(s, rest, 2.0 * min(widest, 0.5 * edge_length)))
        edges = surface_edges(s, rest)
        self.edges = EdgePairs(edges, s, rest, stitched)
        self.near = NearPairs(n, s.triangles, self.edges.arrays[0])
        self.pairs: tuple = ()
        self._finder = PairFinder(~edges.blunt)
        self._runs = PieceRuns(self._finder, s.triangle_piece)
        self._shapes = (s.point_piece, s.triangles, s.triangle_piece)
        self._least, self._most = (
            LEAST_REACH * edge_length,
            np.where(bodies >= 0, RIGID_REACH, MOST_REACH) * edge_length,
        )
        self._gap = np.where(s.allowed, s.gaps, 0.0).max(axis=1)[s.point_piece]
        self._common = np.zeros((pieces + 1, 3)), np.zeros((pieces, 3)), np.zeros((pieces, 3, 3))
        # Obstacles stand still, so that no motion is common to all points where there is one.
        self._all_share = len(s.fixed_points) == 0
        self._each = max(1, int(np.bincount(s.point_piece).min(initial=n)) // ENOUGH_POINTS)
        self.complete, self.excursions = np.full(n, -1.0), np.zeros(n)
        # Where points were when they were listed, how far each may move since then, and what was allowed.
        self._at, self._far, self._own = np.zeros((n, 3)), np.zeros((n, 3)), np.zeros((n, 3))
        self._listed = np.zeros_like(s.allowed)

    def choose(self, allowed: NDArray[np.bool_]) -> None:
        """What to list from now on (p, p)."""
        self.allowed[:] = allowed
        self.edges.choose(allowed)

    def hold(self, depth: NDArray[np.float64]) -> bool:
        """Whether the lists have what may touch until a point has moved too far; depth (n,) is that inside [m]."""
        deeper = self.complete < self._gap + self._least + depth
        return not deeper.any() and np.array_equal(self._listed, self.allowed)

    def left(self, x: NDArray[np.float64], before: NDArray[np.float64]) -> bool:
        """Whether a point at x (n, 3) has moved too far; before : at the beginning of the substep [m]."""
        asked = (self._far, self._own, self._shapes[0], self._all_share, self._each, self._common)
        return any_beyond_radii(x, before, self._at, *asked, self.excursions)

    def renew(
        self,
        x: NDArray[np.float64],
        before: NDArray[np.float64],
        motions: NDArray[np.float64],
        depth: NDArray[np.float64],
    ) -> None:
        """List what may touch while no point moves farther than in a frame of these motions (n, 3) [m].

        Parameters
        ----------
        x, before : (n, 3) now, and at the beginning of the substep [m]; depth : (n,) inside other pieces [m]
        """
        pieces = self._shapes[0]
        common_motions(x, motions, pieces, self._all_share, 1, self._common)
        points, scales = (x - before, self.excursions, pieces), (self._least, self._most)
        search_radii(x, motions, *points, self._common, scales, self._far, self._own)
        together = self.allowed | self.allowed.T
        alone = np.diagonal(together).astype(int) == together.sum(axis=1)
        # No list depends on how far these move.
        self._far[alone[pieces], 2] = np.inf
        self._own[~np.diagonal(together)[pieces], 2] = np.inf
        self.complete[:] = self._gap + self._least + depth
        self._far[:, 0] += self.complete
        self._own[:, 0] += self.complete
        self._finder.gather((x, *self._shapes), (self._far, self._own), self._rules)
        self._at[:], self._listed[:] = x, self.allowed
        self._runs.renew()
        near = (self._finder.starts, self._finder.triangles)
        self.edges.renew(x, (self._far[:, 1], self._own[:, 1]), self._gap, near)

    def number(self, rows: ContactRows) -> None:
        """Give the listed pairs their rows."""
        # Keys of points come before keys of edges.
        rows.renew(np.concatenate([self._runs.keys, self.edges.keys]))
        self.pairs = self.edges.numbered(np.searchsorted(rows.keys, self.edges.keys))
        self.near.renew(self._runs.lists(np.searchsorted(rows.keys, self._runs.keys)), self.pairs)
