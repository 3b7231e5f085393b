"""Points on the surfaces of bodies, found from points in space."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.results.view.model import Model, RenderFrame
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


@dataclass(frozen=True, eq=False)
class _Triangles:
    """The boundaries of all bodies: `corners` (t, 3, 3) [m], `vertices` (t, 3) as of `SurfacePoint`, body (t,)."""

    corners: NDArray[np.float64]
    vertices: NDArray[np.int64]
    body: NDArray[np.int64]


def _triangles(frame: RenderFrame) -> _Triangles:
    corners, vertices = [], []
    for body in frame.model.bodies:
        points, triangles = frame.finite_positions[body.vertices], body.boundary
        if body.rigid and body.skin is not None:
            points, triangles = body.skin.positions(points), body.skin.triangles
        corners.append(points[triangles])
        vertices.append(triangles.astype(np.int64))
    owners = np.repeat(np.arange(len(vertices)), [len(rows) for rows in vertices])
    return _Triangles(np.concatenate(corners), np.concatenate(vertices), owners)


def nearest_surface_point(frame: RenderFrame, place: ArrayLike) -> SurfacePoint:
    """The point on any boundary that is nearest to a point (3,) [m]."""
    from trimesh.triangles import closest_point

    triangles = _triangles(frame)
    query = np.asarray(place, dtype=np.float64)
    points = closest_point(triangles.corners, np.broadcast_to(query, (len(triangles.corners), 3)))
    nearest = int(np.argmin(np.linalg.norm(points - query, axis=1)))
    return _on_triangle(frame.model, triangles, nearest, points[nearest])


def _on_triangle(model: Model, triangles: _Triangles, row: int, place: NDArray[np.float64]) -> SurfacePoint:
    from trimesh.triangles import points_to_barycentric

    corners = triangles.corners[row]
    with np.errstate(all="ignore"):
        weights = points_to_barycentric(corners[None], place[None], method="cross")[0]
    if not np.isfinite(weights).all():  # a triangle without area
        weights = (np.arange(3) == np.argmin(np.linalg.norm(corners - place, axis=1))).astype(np.float64)
    weights = np.clip(weights, 0.0, 1.0)
    return SurfacePoint(model.bodies[triangles.body[row]], triangles.vertices[row], weights / weights.sum(), place)
