"""How far bodies are from obstacles that are formulas: half-spaces, balls, and rooms that keep bodies in."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.output.check.geometry.orientation import plane_sides
from supple.output.check.geometry.triangle_distance import distances_from
from supple.output.check.surfaces import moved
from supple.output.recording.scene import RecordedObstacle

# A moved obstacle, and every distance from a ball or a wall, is rounded a few times.
_ROUNDINGS = 16.0


@dataclass(frozen=True, eq=False)
class Clearance:
    """The distance of a body's surface from one obstacle, negative inside of it.

    Attributes
    ----------
    smallest : [m]; row : of the vertex or triangle it belongs to; by_vertex : which of the two
    entered : whether the body is in the obstacle, beyond what rounding explains
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
    """How a surface, its `vertices` and `triangles` being rows of x, keeps away from an obstacle at a pose (3, 4).

    A half-space that stands still is decided exactly, by the point and the normal that the recording has.
    """
    said = obstacle.parameters
    R = pose[:, :3]
    if obstacle.kind == "HalfSpace":
        given, normal = np.asarray(said["point"], dtype=np.float64), np.asarray(said["normal"], dtype=np.float64)
        point = moved(given[None], pose)[0]
        turned = moved(normal[None], np.column_stack([R, np.zeros(3)]))[0]
        values = (x[vertices] - point) @ turned
        worst = int(np.argmin(values))
        if point is given or np.array_equal(point, given):
            behind = plane_sides(x, vertices, point, turned) < 0
            if behind.any():
                worst = int(np.argmin(np.where(behind, values, np.inf)))
            entered = bool(behind.any())
        else:
            entered = bool(values[worst] < -_rounding(x[vertices], point))
        return Clearance(float(values[worst]), int(vertices[worst]), True, entered)
    center = moved(np.asarray(said["center"], dtype=np.float64)[None], pose)[0]
    if obstacle.kind == "Sphere":
        radius = float(said["radius"])
        if said.get("inside", False):
            values = radius - np.linalg.norm(x[vertices] - center, axis=1)
            return _rounded(values, vertices, True, _rounding(x[vertices], center) + _rounding(radius))
        values = distances_from(center, x, triangles) - radius
        return _rounded(values, np.arange(len(triangles)), False, _rounding(x[vertices], center) + _rounding(radius))
    # The walls of a room.
    local = (x[vertices] - center) @ (R @ np.asarray(said["orientation"], dtype=np.float64))
    values = (0.5 * np.asarray(said["size"], dtype=np.float64) - np.abs(local)).min(axis=1)
    return _rounded(values, vertices, True, _rounding(x[vertices], center) + _rounding(said["size"]))


def _rounding(*values: object) -> float:
    largest = sum(float(np.abs(np.asarray(value, dtype=np.float64)).max()) for value in values)
    return _ROUNDINGS * float(np.finfo(np.float64).eps) * largest


def _rounded(values: NDArray[np.float64], rows: NDArray[np.int64], by_vertex: bool, tolerance: float) -> Clearance:
    worst = int(np.argmin(values))
    return Clearance(float(values[worst]), int(rows[worst]), by_vertex, bool(values[worst] < -tolerance))
