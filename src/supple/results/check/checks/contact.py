"""Checks of surfaces: intersection, containment and distance."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.results.check.frame_check import FrameCheck
from supple.results.check.geometry.containment import is_inside
from supple.results.check.geometry.orientation import plane_sides
from supple.results.check.geometry.surface_pairs import closest_pair
from supple.results.check.geometry.triangle_distance import triangles_apart
from supple.results.check.report import CheckResult
from supple.results.check.surfaces import moved, moved_back
from supple.results.check.trajectory import Snapshot
from supple.scene.obstacles.obstacle import Obstacle

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
    shape: Obstacle,
    pose: NDArray[np.float64],
    x: NDArray[np.float64],
    vertices: NDArray[np.int64],
    triangles: NDArray[np.int64],
) -> Clearance:
    """The clearance of a surface from an obstacle at a pose (3, 4). `vertices` and `triangles` are rows of x.

    A static half-space is decided exactly, from its recorded point and normal. For a container vertices decide. For a
    solid whole triangles decide, up to about 1e-6 of their size where they lie along its surface.
    """
    R, t = pose[:, :3], pose[:, 3]
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
    if shape.is_container:  # the distance from its wall is concave: smallest at a vertex
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


class Intersection(FrameCheck):
    """Bodies with each other, with themselves, and with obstacles made of triangles."""

    name = "intersection"
    unit = "pairs"
    good = "no triangles meet"
    bad = "triangles meet: {worst}"

    def see(self, at: Snapshot) -> None:
        count, pairs = at.meeting
        self.tally.see(at, count, count > 0, self.of.surfaces.name_pair(pairs) if count else "")


def clearances(at: Snapshot) -> Iterator[tuple[str, Clearance]]:
    """The clearance of each body from each obstacle that is a formula: where, and how far."""
    surfaces = at.of.surfaces
    for j, obstacle in enumerate(at.of.obstacles):
        for i in range(surfaces.bodies):
            rows = np.flatnonzero(surfaces.owners == i)
            if obstacle.checked_by_triangles or not surfaces.allowed[i, surfaces.bodies + j] or not len(rows):
                continue
            triangles = surfaces.triangles[rows]
            found = clearance(obstacle, at.poses[j], at.points, np.unique(triangles), triangles)
            part = at.of.name("vertex", found.row) if found.by_vertex else surfaces.name_triangle(int(rows[found.row]))
            yield f"{part} and {obstacle.name}", found


class Obstacles(FrameCheck):
    """Bodies and the obstacles that are formulas."""

    name = "obstacles"
    needs = frozenset({"recording"})
    unit = "m"
    lowest = True
    good = "closest {worst}"
    bad = "a body is in an obstacle, at {worst}"

    def begin(self) -> None:
        if all(obstacle.checked_by_triangles for obstacle in self.of.obstacles):
            self.why_not = "the scene has no half-space, round solid or container"

    def see(self, at: Snapshot) -> None:
        found = list(clearances(at))
        if found:
            where, worst = min(found, key=lambda item: (not item[1].entered, item[1].smallest))
            self.tally.see(at, worst.smallest, worst.entered, where)


class Containment(FrameCheck):
    """Pieces of bodies and obstacles that are completely inside others, where no triangles meet."""

    name = "containment"
    unit = "pieces"
    good = "nothing is inside another thing"
    bad = "contained: {worst}"

    def see(self, at: Snapshot) -> None:
        found = [*self._contained(at), *self._solids_in_bodies(at)]
        self.tally.see(at, len(found), bool(found), found[0] if found else "")

    def _contained(self, at: Snapshot) -> Iterator[str]:
        surfaces, x = self.of.surfaces, at.points
        owners = surfaces.owners
        crossing = {frozenset(pair) for pair in owners[at.meeting[1]].tolist()}
        corners = [x[surfaces.triangles[piece.triangles].ravel()] for piece in surfaces.pieces]
        low = np.array([own.min(axis=0) for own in corners]).reshape(-1, 3)
        high = np.array([own.max(axis=0) for own in corners]).reshape(-1, 3)
        for k, solid in enumerate(surfaces.pieces):
            if not solid.closed:
                continue
            # A contained piece is contained with its bounding box; a single vertex may also lie on the surface.
            for other in np.flatnonzero(((low >= low[k]) & (high <= high[k])).all(axis=1)).tolist():
                piece = surfaces.pieces[other]
                pair = frozenset((piece.owner, solid.owner))
                if other == k or not surfaces.allowed[piece.owner, solid.owner] or pair in crossing:
                    continue
                point = x[piece.vertex].copy()
                if is_inside(x, point, surfaces.triangles, solid.triangles):
                    yield f"{surfaces.names[piece.owner]} in {surfaces.names[solid.owner]}"

    def _solids_in_bodies(self, at: Snapshot) -> Iterator[str]:
        surfaces = self.of.surfaces
        for j, obstacle in enumerate(self.of.obstacles):
            if obstacle.checked_by_triangles or obstacle.is_container or obstacle.plane is not None:
                continue
            # Of a convex solid, the mean of points about it is inside.
            center = moved(obstacle.triangles()[0].mean(axis=0)[None], at.poses[j])[0]
            for solid in surfaces.pieces:
                allowed = solid.owner < surfaces.bodies and surfaces.allowed[solid.owner, surfaces.bodies + j]
                if allowed and solid.closed and is_inside(at.points, center, surfaces.triangles, solid.triangles):
                    yield f"{obstacle.name} in {surfaces.names[solid.owner]}"


class Distance(FrameCheck):
    """The smallest distance between triangles without a common corner, and from obstacles that are formulas."""

    name = "distance"
    unit = "m"
    lowest = True
    good: str = "smallest {worst}"
    bad = "surfaces touch or meet: {worst}"
    nothing = "two surfaces are needed"

    def begin(self) -> None:
        self._closest: tuple[int, int] | None = None
        self._of_frames: list[float] = []

    def see(self, at: Snapshot) -> None:
        surfaces = self.of.surfaces
        count, pairs = at.meeting
        if count:
            self.tally.see(at, 0.0, True, f"{surfaces.name_pair(pairs)} meet")
            return
        best = np.inf
        if self._closest is not None:
            # The closest pair of the last frame is still close: boxes that are farther apart are not searched.
            first, second = (surfaces.triangles[row] for row in self._closest)
            best = float(triangles_apart(at.points, first, second)) * (1.0 + 1e-12) + 1e-300
        squared, a, b = closest_pair(surfaces.looked_at(), at.points, at.tree, best)
        if a >= 0:
            self._closest = a, b
            self._of_frames.append(float(np.sqrt(squared)))
            self.tally.see(at, self._of_frames[-1], squared <= 0.0, surfaces.name_pair(np.array([[a, b]])))
        for where, found in clearances(at):
            self.tally.see(at, found.smallest, found.smallest <= 0.0, where)

    def result(self) -> CheckResult:
        if "files" in self.of.knows and self._of_frames:
            tenth, half = np.quantile(self._of_frames, [0.1, 0.5])
            self.good = f"{Distance.good}; {tenth:.3g} m in a tenth of the frames, {half:.3g} m in half of them"
        return super().result()
