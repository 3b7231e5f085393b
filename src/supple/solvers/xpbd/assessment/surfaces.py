"""Whether surfaces penetrate each other, or vertices an obstacle, at the end of a frame."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.contact.mesh.contact_mesh import joined_surfaces
from supple.contact.mesh.obstacles import ObstaclePoses, placed_with_obstacles, with_obstacles
from supple.model.system import System
from supple.numerics.adjacency import Adjacency, adjacency
from supple.numerics.geometry.box_tree import boxes_of_labels, boxes_of_triangles, near_boxes, overlap
from supple.numerics.geometry.triangle_crossings import CROSSING, crossing_triangles
from supple.runtime.kernel_cache import njit
from supple.scene.stitches.masks import stitched_crossings
from supple.solvers.xpbd.contact.settings import XPBDContact, colliding_pairs

# Pairs of triangles of two bodies that may meet, because stitches or welds join the bodies there.
#
# These are the pairs of `supple.scene.stitches.masks`; between bodies that are stitched to each other, the pairs with a
# stitched corner that meet where the scene places them; and a rigid body with the triangles that are welded to it.
# `supple check` leaves out the same ones.


class Seams:
    """Of the triangles (t, 3) of a system's bodies, owner (t,) the body of each."""

    def __init__(self, system: System, owner: NDArray[np.int32]) -> None:
        found = [_stitched(system, owner), _welded(system, owner)]
        pairs = np.sort(np.concatenate(found), axis=1)
        self._low, self._high = np.unique(pairs, axis=0).T.astype(np.int32)

    def among(self, picked: NDArray[np.int64], count: int) -> Adjacency:
        """Of `count` triangles those that are `picked`, ascending: for each, the higher ones that may meet it."""
        number = np.full(count, -1, dtype=np.int32)
        number[picked] = np.arange(len(picked), dtype=np.int32)
        low, high = number[self._low], number[self._high]
        both = (low >= 0) & (high >= 0)
        return adjacency(low[both], high[both], len(picked))


def _stitched(system: System, owner: NDArray[np.int32]) -> NDArray[np.int64]:
    """(k, 2) triangles around stitches of bodies to bodies."""
    nodes, triangles, points = system.stitching.seams(), system.triangles, system.points
    # Anchors on obstacles are not points of bodies.
    nodes = np.append(system.stitching.points_of_nodes(points), -1)[nodes].astype(np.int32)
    nodes = nodes[(nodes[:, 0] >= 0) & (nodes[:, 1] >= 0)]
    if not len(nodes):
        return np.zeros((0, 2), dtype=np.int64)
    around = stitched_crossings(nodes, triangles, len(points)).nonzero()
    body = np.zeros(len(points), dtype=np.int32)
    body[triangles] = owner[:, None]
    joined = np.zeros((len(system.bodies), len(system.bodies)), dtype=np.bool_)
    joined[body[nodes[:, 0]], body[nodes[:, 1]]] = joined[body[nodes[:, 1]], body[nodes[:, 0]]] = True
    placed = [part.body.place(system.rest_positions[part.vertices]) for part in system.bodies]
    meeting, _ = crossing_triangles(points.positions(np.concatenate(placed)), triangles, owner, joined)
    has_stitch = np.asarray(np.isin(triangles, nodes[nodes >= 0]).any(axis=1))
    return np.concatenate([np.column_stack(around), meeting[has_stitch[meeting].any(axis=1)]])


def _welded(system: System, owner: NDArray[np.int32]) -> NDArray[np.int64]:
    """(k, 2) triangles with a welded corner, and those of the rigid body."""
    names, found = [part.name for part in system.bodies], [np.zeros((0, 2), dtype=np.int64)]
    points = np.flatnonzero(np.isin(system.points.single, system.welding.vertices))
    has_weld = np.asarray(np.isin(system.triangles, points).any(axis=1))
    for weld in system.scene.welds:
        soft = np.flatnonzero(has_weld & (owner == names.index(weld.body)))
        rigid = np.flatnonzero(owner == names.index(weld.rigid))
        found.append(np.column_stack([np.repeat(soft, len(rigid)), np.tile(rigid, len(soft))]))
    return np.concatenate(found)


# Of the mean surface edge: how deep a vertex may be in an obstacle. Old overlaps are removed slowly.
TOLERATED_DEPTH = 0.05
# More pairs of triangles than this are not needed.
MOST_PAIRS = 1000


@dataclass(frozen=True)
class Overlap:
    """Two things that penetrate each other: their names, and how far.

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


def crossings(overlaps: Iterable[Overlap]) -> int:
    """Number of pairs of triangles that penetrate each other."""
    return sum(overlap.pairs for overlap in overlaps)


class SurfaceCheck:
    """The surfaces of a system that must stay apart, in the solver's numbering.

    Obstacles with what is stitched to them, pairs without contact, and what `settings` turns off, are left out; of
    bodies that are stitched or welded to each other, the triangles at the seam.
    """

    def __init__(self, system: System, settings: XPBDContact | None, edge_length: float) -> None:
        self.system = system
        self.tolerated = TOLERATED_DEPTH * edge_length
        self._poses = ObstaclePoses(system.obstacles)
        self._names = [f"body {part.name!r}" for part in system.bodies] + [o.label for o in system.obstacles]
        self._collide = colliding_pairs(system, settings, joined=True)
        self._extended, ranges = with_obstacles(system)
        self._formulas = [k for k, obstacle in enumerate(system.obstacles) if obstacle.contact_mesh is None]
        self._solid = tuple(part for part in ranges if part.index not in self._formulas)
        self._points, self._triangles, owner = joined_surfaces(self._extended, self._solid)
        self._owner = owner[self._triangles[:, 0]]
        joins = len(system.stitching.seams()) or len(system.welding)
        self._seams = Seams(system, self._owner[: len(system.triangles)]) if joins else None
        pairs = self._collide[np.ix_(owned := np.unique(self._owner), owned)]
        self._may_cross = bool(pairs.any())
        # The arguments and the result of the last search: the end of a frame is the beginning of the next one.
        self._last: tuple[NDArray[np.float64], float, NDArray[np.bool_], list[Overlap]]
        self._last = (np.zeros((0, 3)), -np.inf, np.zeros(0, dtype=np.bool_), [])
        self._obstacles_move = bool(self._poses.moving.any())
        own = [np.unique(system.triangles[part.triangles]) for part in system.bodies]
        self._surface, self._begins = np.concatenate(own), np.cumsum([0, *map(len, own[:-1])])

    def find(self, x: NDArray[np.float64], time: float, asleep: NDArray[np.bool_] | None = None) -> list[Overlap]:
        """The things that penetrate each other, at world positions x (n, 3) [m] and a time [s].

        Sleeping bodies (b,) are not compared with each other and with obstacles: nothing has moved there.
        """
        asleep = np.zeros(len(self.system.bodies), dtype=np.bool_) if asleep is None else asleep
        known, at, slept, found = self._last
        moved = self._obstacles_move and time != at
        if moved or not np.array_equal(slept, asleep) or not np.array_equal(known, x):
            collide = self._awake(asleep)
            found = [*(self._crossings(x, time, collide) if self._may_cross else ()), *self.depths(x, time, collide)]
            self._last = (x.copy(), time, asleep.copy(), found)
        return found

    def find_kept_apart(self, x: NDArray[np.float64], time: float, asleep: NDArray[np.bool_]) -> list[Overlap]:
        """`find` after a frame in which the guarantee of contact held: surfaces are tested only if there are seams."""
        if self._seams is not None:
            return self.find(x, time, asleep)
        found = self.depths(x, time, self._awake(asleep))
        self._last = (x.copy(), time, asleep.copy(), found)
        return found

    def _awake(self, asleep: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """(p, p) the pairs that must stay apart and of which one may have moved."""
        still = np.ones(len(self._names), dtype=np.bool_)
        still[: len(asleep)] = asleep
        return self._collide & ~(still[:, None] & still)

    def _crossings(self, x: NDArray[np.float64], time: float, collide: NDArray[np.bool_]) -> list[Overlap]:
        points = self._points.positions(placed_with_obstacles(self._extended, self._solid, x, time))
        chosen = collide.diagonal()[self._owner]
        own = boxes_of_triangles(points, self._triangles)
        boxes = boxes_of_labels(own, self._owner, len(self._names))
        starts, near = near_boxes(boxes, collide)
        if len(near):
            _note_near(own, self._owner, boxes, starts, near, chosen)
        if not chosen.any():
            return []
        picked = np.flatnonzero(chosen)
        seams = None if self._seams is None else self._seams.among(picked, len(self._triangles))
        shapes = points, self._triangles[picked], self._owner[picked]
        pairs, kinds = crossing_triangles(*shapes, collide, MOST_PAIRS, seams)
        owners = np.sort(self._owner[picked][pairs[kinds == CROSSING]], axis=1)
        found, counts = np.unique(owners, axis=0, return_counts=True) if len(owners) else (owners, [])
        return [
            Overlap(self._names[a], self._names[b], int(k), numbers=(int(a), int(b)))
            for (a, b), k in zip(found, counts, strict=True)
        ]

    def depths(self, x: NDArray[np.float64], time: float, collide: NDArray[np.bool_] | None = None) -> list[Overlap]:
        """Bodies with vertices inside of obstacles without triangles, of the pairs `collide` (p, p)."""
        collide = self._collide if collide is None else collide
        R, t = self._poses.at(time)
        x = self.system.points.positions(x)
        bodies, found = len(self.system.bodies), []
        for k in self._formulas:
            # Of all points at once: a scene may have many bodies of a few points each.
            obstacle, local = self.system.obstacles[k], (x - t[k]) @ R[k]
            deepest = np.maximum.reduceat(-obstacle.signed_distance(local[self._surface])[0], self._begins)
            for number in np.flatnonzero((deepest > self.tolerated) & collide[:bodies, bodies + k]):
                found.append(Overlap(self._names[number], self._names[bodies + k], depth=float(deepest[number])))
        return found


@njit(cache=True)
def _note_near(own, owner, boxes, starts, near, chosen):
    """Choose also the triangles (t,) that reach into the box of another thing that they collide with.

    own : (t, 6) boxes of the triangles; boxes : (p, 6) of all things; starts, near : see `near_boxes`
    """
    for t in range(len(owner)):
        k = owner[t]
        for i in range(starts[k], starts[k + 1]):
            if chosen[t]:
                break
            chosen[t] = overlap(boxes, near[i], own[t])
