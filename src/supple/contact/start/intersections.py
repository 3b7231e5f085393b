"""Intersections at the start: incremental potential contact keeps surfaces apart only if they start apart."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.contact.start.surfaces import StartSurfaces
from supple.numerics.geometry.box_tree import boxes_of_labels, boxes_of_triangles
from supple.numerics.geometry.triangle_crossings import CROSSING, crossing_triangles
from supple.numerics.geometry.winding_number import winding_number
from supple.scene.contact_pairs import PairTable

# How far a surface is moved inwards to test whether it only touches, as a share of its size.
_INWARD_SHARE = 1e-9


@dataclass(frozen=True, eq=False)
class Intersection:
    """Two things whose surfaces are not apart, or one that is not apart from itself.

    Attributes
    ----------
    first, second : numbers of things: bodies in the scene's order, then obstacles. The first is a body.
    kind : "overlaps"; "touches", where the distance is zero and nothing is inside anything; "is inside", where the
        first is completely inside the second; "is around", where the second is inside the first; "is outside" of a room
    triangles : (k, 2) rows of the first's and of the second's own triangles that meet; -1 for a plane, which has none;
        empty where the surfaces do not meet
    point : (3,) one of the places [m]; depth : approximate depth [m]
    """

    first: int
    second: int
    kind: str
    triangles: NDArray[np.int64]
    point: NDArray[np.float64]
    depth: float


def intersections_of(surfaces: StartSurfaces, table: PairTable) -> list[Intersection]:
    """Every pair of things of a scene whose surfaces are not apart, bodies first.

    Pairs of triangles are tested exactly; a distance of zero counts as touching. Triangles of one body that share a
    vertex are not tested at that vertex.

    Parameters
    ----------
    table : which things collide; the other pairs are left out
    """
    met, found = _meeting(surfaces, table)
    found += _nested(surfaces, table, met)
    found += _behind_planes(surfaces, table)
    return sorted(found, key=lambda item: (item.first, item.second))


def _meeting(s: StartSurfaces, table: PairTable) -> tuple[set[tuple[int, int]], list[Intersection]]:
    """Pairs of things whose triangles meet; and where they do."""
    pairs, kinds = crossing_triangles(s.points, s.triangles, s.owner, table.collide)
    things = np.sort(s.owner[pairs], axis=1)
    met = {(int(a), int(b)) for a, b in np.unique(things, axis=0)} if len(things) else set()
    found = []
    for a, b in np.unique(things, axis=0):
        mine = (things == (a, b)).all(axis=1)
        some = pairs[mine]
        # Of two things, what crosses only by round-off touches.
        crossing = _still_meets(s, int(a), int(b)) if a != b else bool((kinds[mine] == CROSSING).any())
        kind = "overlaps" if crossing else "touches"
        depths, points = _depths(s.points[s.triangles[some[:, 0]]], s.points[s.triangles[some[:, 1]]])
        deepest = int(depths.argmax())
        depth = float(depths[deepest]) if kind == "overlaps" else 0.0
        local = some - s.first_row[[a, b]]
        found.append(Intersection(int(a), int(b), kind, local, points[deepest], depth))
    return met, found


def _still_meets(s: StartSurfaces, a: int, b: int) -> bool:
    """Whether a meets b, or is inside it, also with its surface moved inwards by a tiny distance."""
    mine, theirs = s.of(a), s.of(b)
    x = s.points.copy()
    corners = x[mine]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inwards = np.zeros_like(x)
    for k in range(3):
        np.subtract.at(inwards, mine[:, k], normals)
    length = np.linalg.norm(inwards, axis=1)
    rows = np.flatnonzero(length > 0.0)
    size = np.linalg.norm(np.ptp(x[mine.ravel()], axis=0)) + np.abs(x[mine.ravel()]).max() * 1e-3
    x[rows] += _INWARD_SHARE * size * inwards[rows] / length[rows, None]
    triangles = np.concatenate([mine, theirs])
    owner = np.repeat(np.array([0, 1], dtype=np.int32), [len(mine), len(theirs)])
    pairs, _ = crossing_triangles(x, triangles, owner, np.array([[False, True], [True, False]]))
    if len(pairs):
        return True
    return bool(s.solid[b]) and round(winding_number(x, theirs, tuple(x[mine[0, 0]]))) != 0


def _depths(first: NDArray[np.float64], second: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """How deep (k,) the triangles (k, 3, 3) of each pair penetrate each other, and approximately where (k, 3)."""
    behind = []
    for one, other in ((first, second), (second, first)):
        normal = np.cross(other[:, 1] - other[:, 0], other[:, 2] - other[:, 0])
        normal /= np.maximum(np.linalg.norm(normal, axis=1), 1e-300)[:, None]
        height = np.einsum("kij,kj->ki", one - other[:, :1], normal)
        behind.append(np.minimum(np.maximum(-height.min(axis=1), 0.0), np.maximum(height.max(axis=1), 0.0)))
    low = np.maximum(first.min(axis=1), second.min(axis=1))
    high = np.minimum(first.max(axis=1), second.max(axis=1))
    return np.maximum(*behind), 0.5 * (low + high)


def _nested(s: StartSurfaces, table: PairTable, met: set[tuple[int, int]]) -> list[Intersection]:
    """Surfaces that do not meet, of which one is completely inside the other, or outside a room."""
    low, high = _boxes(s)
    none = np.zeros((0, 2), dtype=np.int64)
    found: dict[tuple[int, int, str], Intersection] = {}
    is_container = np.isin(np.arange(len(s.solid)), s.rooms)
    for thing, vertex in s.pieces.tolist():
        if is_container[thing]:
            continue
        q = s.points[vertex]
        point = (q[0], q[1], q[2])
        within = s.solid & (low < q).all(axis=1) & (q < high).all(axis=1)
        for other in np.flatnonzero(table.collide[thing] & (within | is_container)).tolist():
            if other == thing or (min(thing, other), max(thing, other)) in met:
                continue
            room = bool(is_container[other])
            inside = round(winding_number(s.points, s.of(other), point)) != 0
            if inside == room:
                continue
            first, second = min(thing, other), max(thing, other)
            kind = "is outside" if room else "is inside" if thing == first else "is around"
            depth = float(np.min(np.minimum(high[first] - low[second], high[second] - low[first])))
            if room:
                depth = float(np.max(np.maximum(high[first] - high[second], low[second] - low[first])))
            found[first, second, kind] = Intersection(first, second, kind, none, q, abs(depth))
    return list(found.values())


def _boxes(s: StartSurfaces) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Corners (p, 3) of the things' bounding boxes; planes have none."""
    boxes = boxes_of_labels(boxes_of_triangles(s.points, s.triangles), s.owner, len(s.solid))
    return boxes[:, :3], boxes[:, 3:]


def _behind_planes(s: StartSurfaces, table: PairTable) -> list[Intersection]:
    found = []
    for thing, anchor, normal in s.planes:
        heights = (s.points - anchor) @ normal
        lowest = heights[s.triangles].min(axis=1)
        reached = (lowest <= 0.0) & table.collide[thing][s.owner]
        for body in np.unique(s.owner[reached]).tolist():
            rows = np.flatnonzero(reached & (s.owner == body))
            deepest = rows[int(lowest[rows].argmin())]
            corner = s.triangles[deepest, int(heights[s.triangles[deepest]].argmin())]
            kind = "touches" if lowest[deepest] == 0.0 else "overlaps"
            if heights[s.of(body)].max() < 0.0:
                kind = "is inside"
            local = np.column_stack([rows - s.first_row[body], np.full(len(rows), -1)])
            found.append(Intersection(body, thing, kind, local, s.points[corner], -float(lowest[deepest])))
    return found
