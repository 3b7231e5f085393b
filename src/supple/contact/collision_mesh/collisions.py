"""Pairs of near primitives at a point of the search, and how far a step may go before anything touches.

The broad phase runs once for a step of Newton's method, on the boxes that surfaces sweep; the line search along that
step uses only the pairs that were found.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from supple.contact.collision_mesh.contact_surface import ContactSurface
from supple.numerics.geometry.triangle_crossings import crossing_triangles

if TYPE_CHECKING:
    import ipctk

# Swept boxes of a long way overlap everything. It is divided into pieces of this many mean edges.
_PIECE = 2.0
# Iterations for one pair. Where two surfaces are as near as round-off, the library's own limit of ten million takes
# minutes. The result is conservative wherever the iteration stops.
_MAX_ITERATIONS = 100_000
_MAX_PIECES = 64


class Collisions:
    """Contacts between the triangles of a surface.

    Parameters
    ----------
    dhat : [m] contacts are pairs that are nearer than this.
    """

    def __init__(self, surface: ContactSurface, dhat: float) -> None:
        import ipctk

        self.surface = surface
        self.dhat = dhat
        # The library's default continuous detection takes minutes on aligned cubes; this one milliseconds.
        self._ccd = ipctk.AdditiveCCD(max_iterations=_MAX_ITERATIONS)
        mesh = surface.mesh
        # Edges of the bodies' own meshes: the diagonal of a split square counts as one edge.
        own = mesh.edges[(mesh.edges < len(surface.vertices)).all(axis=1)]
        ends = mesh.rest_positions[np.concatenate([own, surface.middles])]
        self._piece = _PIECE * float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).mean()) if len(ends) else np.inf
        self._candidates: ipctk.Candidates | None = None
        self._box: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None
        self._x: NDArray[np.float64] | None = None
        self._points: NDArray[np.float64] | None = None
        self._found: ipctk.NormalCollisions | None = None

    def points(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """The collision mesh's vertices (s, 3) at x."""
        if x is not self._x or self._points is None:
            self._x, self._points, self._found = x, self.surface.points(x), None
        return self._points

    def at(self, x: NDArray[np.float64]) -> ipctk.NormalCollisions:
        """All pairs nearer than dhat at x (n, 3)."""
        import ipctk

        points = self.points(x)
        if self._found is None:
            if not self._covers(points):
                self._find_candidates(points, points)
            found = ipctk.NormalCollisions()
            found.use_area_weighting = True
            # The plain set counts a vertex above a vertex once for each triangle around it: aligned bodies would slip.
            found.collision_set_type = ipctk.NormalCollisions.CollisionSetType.IMPROVED_MAX_APPROX
            found.build(self._candidates, self.surface.mesh, points, self.dhat)
            self._found = found
        return self._found

    def largest_step(self, x: NDArray[np.float64], direction: NDArray[np.float64]) -> float:
        """How far along `direction` (n, 3), at most 1, nothing touches."""
        start = self.points(x)
        way = self.surface.points(direction)
        longest = float(np.sqrt(np.einsum("ij,ij->i", way, way).max(initial=0.0)))
        if not np.isfinite(longest):
            return 0.0
        pieces = max(1, int(np.ceil(min(longest / self._piece, _MAX_PIECES))))
        length = min(1.0, self._piece * pieces / longest) / pieces if longest > 0.0 else 1.0
        for k in range(pieces):
            begin = start if k == 0 else np.asfortranarray(start + (k * length) * way)
            end = np.asfortranarray(start + ((k + 1) * length) * way)
            self._find_candidates(begin, end)
            assert self._candidates is not None
            share = self._candidates.compute_collision_free_stepsize(self.surface.mesh, begin, end, 0.0, self._ccd)
            if share < 1.0:
                return (k + share) * length
        # A complete way must give exactly 1: pieces * (1 / pieces) can be slightly less.
        return 1.0 if longest <= pieces * self._piece else pieces * length

    def smallest_distance(self, x: NDArray[np.float64]) -> float:
        """Between surfaces [m]; infinite where nothing is nearer than dhat."""
        found = self.at(x)
        if found.empty():
            return np.inf
        # The library returns the square.
        return float(np.sqrt(found.compute_minimum_distance(self.surface.mesh, self.points(x))))

    def intersect(self, x: NDArray[np.float64]) -> bool:
        """Whether any two triangles that may not cross do so at x."""
        import ipctk

        surface, points = self.surface, self.points(x)
        if surface.stitched is None:
            return bool(ipctk.has_intersections(surface.mesh, points))
        # The library's test leaves out pairs of vertices only, and counts seams, whose sides touch.
        faces = np.ascontiguousarray(surface.mesh.faces)
        points = np.ascontiguousarray(points)
        pairs, _ = crossing_triangles(points, faces, surface.owner[faces[:, 0]], surface.collide)
        return len(surface.stitched.exclude(pairs, len(faces))) > 0

    def _find_candidates(self, begin: NDArray[np.float64], end: NDArray[np.float64]) -> None:
        import ipctk

        candidates = ipctk.Candidates()
        candidates.build(self.surface.mesh, begin, end, self.dhat)
        if self.surface.stitched is not None:
            self.surface.stitched.drop_from(candidates)
        self._candidates = candidates
        self._box = np.minimum(begin, end), np.maximum(begin, end)

    def _covers(self, points: NDArray[np.float64]) -> bool:
        """Whether the latest broad phase covers these points."""
        if self._box is None:
            return False
        low, high = self._box
        # A point of a line search lies between its ends up to round-off; candidates reach dhat / 2 beyond.
        slack = 1e-6 * self.dhat
        return bool((points >= low - slack).all() and (points <= high + slack).all())
