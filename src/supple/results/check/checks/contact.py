"""Checks of surfaces: intersection, containment and distance."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from supple.results.check.formula_obstacles import Clearance, clearance
from supple.results.check.frame_check import FrameCheck
from supple.results.check.geometry.containment import is_inside
from supple.results.check.geometry.surface_pairs import closest_pair
from supple.results.check.geometry.triangle_distance import triangles_apart
from supple.results.check.report import CheckResult
from supple.results.check.snapshot import Scene, Snapshot
from supple.results.check.surfaces import moved


class Intersection(FrameCheck):
    """Bodies with each other, with themselves, and with obstacles made of triangles."""

    name = "intersection"
    unit = "pairs"
    good = "no triangles meet"
    bad = "triangles meet: {worst}"

    def see(self, at: Snapshot) -> None:
        count, pairs = at.meeting
        name = self.scene.surfaces.name_triangle
        where = f"{name(int(pairs[0, 0]))} and {name(int(pairs[0, 1]))}" if count else ""
        self.tally.see(at, count, count > 0, where)


def clearances(scene: Scene, at: Snapshot) -> Iterator[tuple[str, Clearance]]:
    """The clearance of each body from each obstacle that is a formula: where, and how far."""
    surfaces = scene.surfaces
    for j, obstacle in enumerate(scene.recording.obstacles):
        if obstacle.obstacle.checked_by_triangles:
            continue
        for i in range(surfaces.bodies):
            if not surfaces.allowed[i, surfaces.bodies + j]:
                continue
            rows = np.flatnonzero(surfaces.owners == i)
            triangles = surfaces.triangles[rows]
            if len(triangles) == 0:
                continue
            found = clearance(obstacle, at.poses[j], at.points, np.unique(triangles), triangles)
            part = scene.name("vertex", found.row) if found.by_vertex else surfaces.name_triangle(int(rows[found.row]))
            yield f"{part} and {obstacle.name}", found


class Obstacles(FrameCheck):
    """Bodies and the obstacles that are formulas."""

    name = "obstacles"
    unit = "m"
    lowest = True
    good = "closest {worst}"
    bad = "a body is in an obstacle, at {worst}"

    def begin(self) -> None:
        if all(recorded.obstacle.checked_by_triangles for recorded in self.scene.recording.obstacles):
            self.why_not = "the scene has no half-space, round solid or room"

    def see(self, at: Snapshot) -> None:
        found = list(clearances(self.scene, at))
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
        surfaces, x = self.scene.surfaces, at.points
        owners = surfaces.owners
        crossing = {frozenset(pair) for pair in owners[at.meeting[1]].tolist()}
        for solid in surfaces.pieces:
            if not solid.closed:
                continue
            corners = x[surfaces.triangles[solid.triangles].ravel()]
            low, high = corners.min(axis=0), corners.max(axis=0)
            for piece in surfaces.pieces:
                pair = frozenset((piece.owner, solid.owner))
                if piece is solid or not surfaces.allowed[piece.owner, solid.owner] or pair in crossing:
                    continue
                # A contained piece is contained with its bounding box; a single vertex may also lie on the surface.
                points = x[surfaces.triangles[piece.triangles].ravel()]
                if (points < low).any() or (points > high).any():
                    continue
                point = x[piece.vertex].copy()
                if is_inside(x, point, surfaces.triangles, solid.triangles):
                    yield f"{surfaces.names[piece.owner]} in {surfaces.names[solid.owner]}"

    def _solids_in_bodies(self, at: Snapshot) -> Iterator[str]:
        surfaces = self.scene.surfaces
        for j, obstacle in enumerate(self.scene.recording.obstacles):
            shape = obstacle.obstacle
            if shape.checked_by_triangles or shape.is_room or shape.plane is not None:
                continue
            # Of a convex solid, the mean of points about it is inside.
            center = moved(shape.triangles()[0].mean(axis=0)[None], at.poses[j])[0]
            for solid in surfaces.pieces:
                allowed = solid.owner < surfaces.bodies and surfaces.allowed[solid.owner, surfaces.bodies + j]
                if allowed and solid.closed and is_inside(at.points, center, surfaces.triangles, solid.triangles):
                    yield f"{obstacle.name} in {surfaces.names[solid.owner]}"


class Distance(FrameCheck):
    """The smallest distance between triangles without a common corner, and from obstacles that are formulas."""

    name = "distance"
    unit = "m"
    lowest = True
    good = "smallest {worst}"
    bad = "surfaces touch or meet: {worst}"

    def begin(self) -> None:
        self._last: tuple[int, int] | None = None

    def see(self, at: Snapshot) -> None:
        surfaces = self.scene.surfaces
        name = surfaces.name_triangle
        count, pairs = at.meeting
        if count:
            a, b = int(pairs[0, 0]), int(pairs[0, 1])
            self.tally.see(at, 0.0, True, f"{name(a)} and {name(b)} meet")
            return
        best = np.inf
        if self._last is not None:
            # The closest pair of the last frame is still close: boxes that are farther apart are not searched.
            first, second = (surfaces.triangles[row] for row in self._last)
            best = float(triangles_apart(at.points, first, second)) * (1.0 + 1e-12) + 1e-300
        squared, a, b = closest_pair(
            at.points, surfaces.triangles, surfaces.owners, surfaces.allowed, surfaces.ignored, *at.tree, best
        )
        if a >= 0:
            self._last = a, b
            self.tally.see(at, float(np.sqrt(squared)), squared <= 0.0, lambda: f"{name(a)} and {name(b)}")
        for where, found in clearances(self.scene, at):
            self.tally.see(at, found.smallest, found.smallest <= 0.0, where)

    def result(self) -> CheckResult:
        if self.tally.worst is None:
            self.why_not = "there are no two surfaces"
        return super().result()
