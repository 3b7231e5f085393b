"""How far bodies are from obstacles that are formulas: half-spaces, convex solids, and rooms that keep bodies in."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.results.check.geometry.orientation import plane_sides
from supple.results.check.surfaces import moved, moved_back
from supple.results.recording.scene import RecordedObstacle

# A moved obstacle, and every distance from a ball or a wall, is rounded a few times.
_ROUNDINGS = 16.0
# Halvings of triangles, and how many triangles may be left: one that lies along a cylinder is divided all along it.
_LEVELS, _MOST_TRIANGLES = 26, 4096


@dataclass(frozen=True, eq=False)
class Clearance:
    """The distance of a body's surface from one obstacle, negative inside of it.

    Attributes
    ----------
    smallest : [m]; row : of the vertex or triangle it belongs to; by_vertex : which of the two
    entered : whether the body is in the obstacle by more than rounding errors
    """

    smallest: float
    row: int
    by_vertex: bool
    entered: bool


def clearance(
    obstacle: RecordedObstacle,
    pose: NDArray[np.float64],
    x: NDArray[np.float64],
    vertices: NDArray[np.int64],
    triangles: NDArray[np.int64],
) -> Clearance:
    """The clearance of a surface from an obstacle at a pose (3, 4). `vertices` and `triangles` are rows of x.

    A static half-space is decided exactly, from its recorded point and normal. For a room vertices decide. For a solid
    whole triangles decide, up to about 1e-6 of their size where they lie along its surface.
    """
    shape, R, t = obstacle.obstacle, pose[:, :3], pose[:, 3]
    points = x[vertices]
    if shape.plane is not None:
        given, normal = shape.plane
        point = moved(given[None], pose)[0]
        turned = moved(normal[None], np.column_stack([R, np.zeros(3)]))[0]
        values = (points - point) @ turned
        worst = int(np.argmin(values))
        if np.array_equal(point, given):
            behind = plane_sides(x, vertices, point, turned) < 0
            if behind.any():
                worst = int(np.argmin(np.where(behind, values, np.inf)))
            entered = bool(behind.any())
        else:
            entered = bool(values[worst] < -_rounding(points, point))
        return Clearance(float(values[worst]), int(vertices[worst]), True, entered)
    tolerance = _rounding(points, t) + _rounding(shape.triangles()[0])
    if shape.is_room:  # the distance from its wall is concave: smallest at a vertex
        values, _ = shape.signed_distance(moved_back(points, pose))
        worst = int(np.argmin(values))
        return Clearance(float(values[worst]), int(vertices[worst]), True, bool(values[worst] < -tolerance))
    smallest, row = smallest_on_triangles(shape.signed_distance, moved_back(x, pose)[triangles])
    return Clearance(smallest, row, False, smallest < -tolerance)


def smallest_on_triangles(
    signed_distance: Callable[[NDArray[np.float64]], tuple[NDArray[np.float64], NDArray[np.float64]]],
    corners: NDArray[np.float64],
) -> tuple[float, int]:
    """The smallest distance of triangles with these corners (t, 3, 3) from a convex solid, and its triangle's row.

    The distance from a convex solid is convex, so on a triangle it is nowhere below its linear approximation at the
    middle. A triangle that can still contain the minimum is divided in four, which divides the error of this bound by
    four. The search ends at round-off, or where too many triangles are left.
    """
    rows = np.arange(len(corners))
    best, row = np.inf, -1
    for _ in range(_LEVELS):
        distances = signed_distance(corners.reshape(-1, 3))[0].reshape(-1, 3).min(axis=1)
        nearest = int(np.argmin(distances))
        if distances[nearest] < best:
            best, row = float(distances[nearest]), int(rows[nearest])
        middles = corners.mean(axis=1)
        values, normals = signed_distance(middles)
        slopes = np.einsum("tij,tj->ti", corners - middles[:, None], normals)
        kept = values + slopes.min(axis=1) < best - 1e-14 * np.abs(corners).max(initial=0.0)
        corners, rows = corners[kept], np.repeat(rows[kept], 4)
        if not 0 < len(corners) <= _MOST_TRIANGLES:
            break
        a, b, c = corners.transpose(1, 0, 2)
        ab, bc, ca = 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)
        parts = [np.stack(part, axis=1) for part in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
        corners = np.stack(parts, axis=1).reshape(-1, 3, 3)
    return best, row


def _rounding(*values: object) -> float:
    largest = sum(float(np.abs(np.asarray(value, dtype=np.float64)).max()) for value in values)
    return _ROUNDINGS * float(np.finfo(np.float64).eps) * largest
