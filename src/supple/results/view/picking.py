"""Points on the surfaces of bodies, found from points in space."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.results.view.model import RenderFrame
from supple.scene.rows import BodyRows


@dataclass(frozen=True, eq=False)
class SurfacePoint:
    """A point on the boundary of a body.

    Attributes
    ----------
    body : the body
    vertices : (3,) of the triangle that contains it, numbered in the body, or in the surface of a rigid one
    weights : (3,) barycentric coordinates
    place : (3,) its position [m]
    """

    body: BodyRows
    vertices: NDArray[np.int64]
    weights: NDArray[np.float64]
    place: NDArray[np.float64]

    @property
    def nearest_vertex(self) -> int:
        """The vertex of the triangle with the largest weight, numbered in the body; 0 for a rigid one, held whole."""
        return 0 if self.body.rigid else int(self.vertices[np.argmax(self.weights)])


def nearest_surface_point(frame: RenderFrame, place: ArrayLike) -> SurfacePoint:
    """The point on any boundary that is nearest to a point (3,) [m]."""
    from trimesh.triangles import closest_point, points_to_barycentric

    query, best, least = np.asarray(place, dtype=np.float64)[None], None, np.inf
    for body in frame.model.bodies:
        points, triangles = frame.finite_positions[body.vertices], body.boundary
        if body.rigid and body.skin is not None:
            points, triangles = body.skin.positions(points), body.skin.triangles
        found = closest_point(points[triangles], query.repeat(len(triangles), axis=0))
        away = np.linalg.norm(found - query, axis=1)
        row = int(away.argmin())
        if away[row] < least:
            least, best = away[row], (body, triangles[row].astype(np.int64), points[triangles[row]], found[row])
    assert best is not None  # a scene has bodies
    body, vertices, corners, point = best
    with np.errstate(all="ignore"):
        weights = points_to_barycentric(corners[None], point[None], method="cross")[0]
    if not np.isfinite(weights).all():  # a triangle without area
        weights = (np.arange(3) == np.argmin(np.linalg.norm(corners - point, axis=1))).astype(np.float64)
    weights = np.clip(weights, 0.0, 1.0)
    return SurfacePoint(body, vertices, weights / weights.sum(), point)
