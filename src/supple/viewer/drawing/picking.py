"""Points on the surfaces of bodies, found from points and rays in space."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.viewer.drawing.moments.model import Model, ModelBody, Moment


@dataclass(frozen=True, eq=False)
class SurfacePoint:
    """A point on the boundary of a body.

    Attributes
    ----------
    body : the body
    vertices : (3,) of the triangle that contains it, numbered in the body; weights : (3,) barycentric coordinates
    place : (3,) its position [m]
    """

    body: ModelBody
    vertices: NDArray[np.int64]
    weights: NDArray[np.float64]
    place: NDArray[np.float64]

    @property
    def nearest_vertex(self) -> int:
        """The vertex of the triangle with the largest weight, numbered in the body."""
        return int(self.vertices[np.argmax(self.weights)])


def _triangles(model: Model) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Triangles (t, 3) of all bodies, numbered in the model, and the body of each (t,)."""
    rows = [body.triangles.astype(np.int64) + body.vertices.start for body in model.bodies]
    return np.concatenate(rows), np.repeat(np.arange(len(rows)), [len(row) for row in rows])


def nearest_surface_point(moment: Moment, place: ArrayLike) -> SurfacePoint:
    """The point on any boundary that is nearest to a point (3,) [m]."""
    from trimesh.triangles import closest_point

    rows, _ = _triangles(moment.model)
    corners = moment.finite_positions[rows]
    query = np.asarray(place, dtype=np.float64)
    points = closest_point(corners, np.broadcast_to(query, (len(rows), 3)))
    nearest = int(np.argmin(np.linalg.norm(points - query, axis=1)))
    return _on_triangle(moment, nearest, points[nearest])


def surface_point_on_ray(moment: Moment, origin: ArrayLike, direction: ArrayLike) -> SurfacePoint | None:
    """The first intersection of a ray from `origin` (3,) in `direction` (3,) with any boundary, or None."""
    rows, _ = _triangles(moment.model)
    hit = first_hit(moment.finite_positions[rows], origin, direction)
    if hit is None:
        return None
    return _on_triangle(moment, hit[0], np.asarray(origin, dtype=np.float64) + hit[1] * np.asarray(direction))


def first_hit(corners: NDArray[np.float64], origin: ArrayLike, direction: ArrayLike) -> tuple[int, float] | None:
    """The triangle of `corners` (t, 3, 3) that a ray meets first, and the multiple of `direction` to it, or None.

    Source: Möller and Trumbore, "Fast, Minimum Storage Ray/Triangle Intersection" (1997).
    """
    a, b, c = (corners[:, k] for k in range(3))
    start, along = np.asarray(origin, dtype=np.float64), np.asarray(direction, dtype=np.float64)
    h = np.cross(along, c - a)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        inverse = 1.0 / np.einsum("ij,ij->i", b - a, h)
        u = inverse * np.einsum("ij,ij->i", start - a, h)
        q = np.cross(start - a, b - a)
        v = inverse * (q @ along)
        t = inverse * np.einsum("ij,ij->i", c - a, q)
        met = np.isfinite(t) & (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1.0 + 1e-9) & (t > 0.0)
    if not met.any():
        return None
    first = int(np.argmin(np.where(met, t, np.inf)))
    return first, float(t[first])


def _on_triangle(moment: Moment, triangle: int, place: NDArray[np.float64]) -> SurfacePoint:
    from trimesh.triangles import points_to_barycentric

    rows, owner = _triangles(moment.model)
    body = moment.model.bodies[owner[triangle]]
    corners = moment.finite_positions[rows[triangle]]
    with np.errstate(all="ignore"):
        weights = points_to_barycentric(corners[None], place[None], method="cross")[0]
    if not np.isfinite(weights).all():  # a triangle without area
        weights = (np.arange(3) == np.argmin(np.linalg.norm(corners - place, axis=1))).astype(np.float64)
    weights = np.clip(weights, 0.0, 1.0)
    return SurfacePoint(body, rows[triangle] - body.vertices.start, weights / weights.sum(), place)


def point_on_camera_plane(
    eye: ArrayLike, toward: ArrayLike, look: ArrayLike, through: ArrayLike
) -> NDArray[np.float64] | None:
    """Intersection of the line from the eye (3,) to a point (3,) with the plane through a point that faces the camera.

    Parameters
    ----------
    look : (3,) viewing direction of the camera; through : (3,) a point of the plane

    Returns
    -------
    (3,) [m], or None where there is no intersection in front of the eye.
    """
    start, along, normal = (np.asarray(v, dtype=np.float64) for v in (eye, toward, look))
    along = along - start
    slope = float(along @ normal)
    reach = float((np.asarray(through, dtype=np.float64) - start) @ normal)
    if slope * reach <= 0.0:
        return None
    return start + reach / slope * along
