"""Whether surfaces are through each other, or vertices deep inside of obstacles, at the end of a frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.contact.obstacle_poses import ObstaclePoses
from supple.numerics.geometry.triangle_crossings import CROSSING, crossing_triangles
from supple.scene.contact_pairs import pair_table
from supple.system import System
from supple.xpbd.contact.settings import XPBDContact

# Of the mean surface edge: how deep a vertex may be in an obstacle. Old overlaps are removed slowly.
TOLERATED_DEPTH = 0.05
# More pairs of triangles than this say nothing new.
MOST_PAIRS = 1000


@dataclass(frozen=True)
class Overlap:
    """Two things that are through each other: their names, and how far.

    Attributes
    ----------
    first, second : names with their kind, such as "body 'ball'"; equal where a body is through itself
    pairs : number of pairs of triangles; depth : of a vertex in an obstacle that has no triangles [m]
    numbers : of the two things: bodies, then obstacles
    """

    first: str
    second: str
    pairs: int = 0
    depth: float = 0.0
    numbers: tuple[int, int] = (-1, -1)

    def __str__(self) -> str:
        if not self.pairs:
            return f"{self.first} is {self.depth:.2g} m deep in {self.second}"
        other = "itself" if self.first == self.second else self.second
        return f"{self.first} passes through {other} ({self.pairs} pairs of triangles)"


class SurfaceCheck:
    """The surfaces of a system that must stay apart, in the solver's numbering.

    Stitched things, pairs without contact, and what `settings` turns off, are left out.
    """

    def __init__(self, system: System, settings: XPBDContact | None, edge_length: float) -> None:
        self.system = system
        self.tolerated = TOLERATED_DEPTH * edge_length
        self._poses = ObstaclePoses(system.obstacles)
        self._names = [f"body {part.name!r}" for part in system.bodies] + [o.label for o in system.obstacles]
        self._collide = colliding_pairs(system, settings)
        bodies, n = len(system.bodies), len(system.masses)
        triangles, points, self._owners = [system.triangles], [], []
        owner = [np.repeat(np.arange(bodies), [part.triangles.stop - part.triangles.start for part in system.bodies])]
        self._formulas = []
        for k, obstacle in enumerate(system.obstacles):
            mesh = obstacle.surface_mesh
            if mesh is None:
                self._formulas.append(k)
                continue
            triangles.append(mesh.triangles.astype(np.int32) + n + sum(map(len, points)))
            points.append(mesh.vertices)
            self._owners += [k] * len(mesh.vertices)
            owner.append(np.full(len(mesh.triangles), bodies + k))
        self._triangles = np.ascontiguousarray(np.concatenate(triangles), dtype=np.int32)
        self._owner = np.concatenate(owner).astype(np.int32)
        self._fixed = np.concatenate(points) if points else np.zeros((0, 3))
        # The arguments and the result of the last search: the end of a frame is the beginning of the next one.
        self._last: tuple[NDArray[np.float64], float, list[Overlap]] = (np.zeros((0, 3)), -np.inf, [])
        self._surface = [np.unique(system.triangles[part.triangles]) for part in system.bodies]

    def find(self, x: NDArray[np.float64], time: float) -> list[Overlap]:
        """What is through what, at world positions x (n, 3) [m] and a time [s]."""
        known, at, found = self._last
        if time != at or not np.array_equal(known, x):
            found = [*self._crossings(x, time), *self.depths(x, time)]
            self._last = (x.copy(), time, found)
        return found

    def _crossings(self, x: NDArray[np.float64], time: float) -> list[Overlap]:
        R, t = self._poses.at(time)
        rows = np.array(self._owners, dtype=np.int64)
        points = np.concatenate([x, np.einsum("kij,kj->ki", R[rows], self._fixed) + t[rows]])
        corners = points[self._triangles]
        low, high = corners.min(axis=1), corners.max(axis=1)
        chosen = self._near(low, high)
        if not chosen.any():
            return []
        picked = np.flatnonzero(chosen)
        pairs, kinds = crossing_triangles(
            points, self._triangles[picked], self._owner[picked], self._collide, MOST_PAIRS
        )
        owners = np.sort(self._owner[picked][pairs[kinds == CROSSING]], axis=1)
        found, counts = np.unique(owners, axis=0, return_counts=True) if len(owners) else (owners, [])
        return [
            Overlap(self._names[a], self._names[b], int(k), numbers=(int(a), int(b)))
            for (a, b), k in zip(found, counts, strict=True)
        ]

    def _near(self, low: NDArray[np.float64], high: NDArray[np.float64]) -> NDArray[np.bool_]:
        """(t,) the triangles that reach into the box of another thing that they collide with, or of their own."""
        count = len(self._names)
        boxes = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
        owners, starts = np.unique(self._owner, return_index=True)  # ascending: triangles are sorted by their owner
        boxes[0][owners], boxes[1][owners] = np.minimum.reduceat(low, starts), np.maximum.reduceat(high, starts)
        chosen = np.diagonal(self._collide)[self._owner].copy()
        for a, b in np.argwhere(np.triu(self._collide, 1)):
            lower, upper = np.maximum(boxes[0][a], boxes[0][b]), np.minimum(boxes[1][a], boxes[1][b])
            if (lower <= upper).all():
                mine = (self._owner == a) | (self._owner == b)
                chosen |= mine & (low <= upper).all(axis=1) & (high >= lower).all(axis=1)
        return chosen

    def depths(self, x: NDArray[np.float64], time: float) -> list[Overlap]:
        """Bodies with vertices deep inside of obstacles that have no triangles; arguments as of `find`."""
        R, t = self._poses.at(time)
        bodies, found = len(self.system.bodies), []
        for k in self._formulas:
            for number, rows in enumerate(self._surface):
                if not self._collide[number, bodies + k]:
                    continue
                local = (x[rows] - t[k]) @ R[k]
                deepest = -float(self.system.obstacles[k].signed_distance(local)[0].min())
                if deepest > self.tolerated:
                    found.append(Overlap(self._names[number], self._names[bodies + k], depth=deepest))
        return found


def colliding_pairs(system: System, settings: XPBDContact | None) -> NDArray[np.bool_]:
    """(p, p) which things must stay apart: bodies, then obstacles, without those that are stitched to each other."""
    bodies = len(system.bodies)
    collide = pair_table(system.scene).collide.copy()
    if settings is None or not settings.body_collision:
        collide[:bodies, :bodies] &= np.eye(bodies, dtype=np.bool_)
    if settings is None or not settings.self_collision:
        collide[np.arange(bodies), np.arange(bodies)] = False
    names = [part.name for part in system.bodies] + [str(obstacle.name) for obstacle in system.obstacles]
    for stitch in system.scene.stitches:
        a, b = names.index(stitch.first), names.index(stitch.second)
        collide[a, b] = collide[b, a] = False
    return collide
