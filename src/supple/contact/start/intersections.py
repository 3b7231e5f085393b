"""Whether surfaces intersect at the start: incremental potential contact keeps them apart only if they begin apart."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.contact.start.surfaces import StartSurfaces, start_surfaces, winding_number
from supple.numerics.geometry.triangle_crossings import CROSSING, crossing_triangles
from supple.scene.contact_pairs import PairTable
from supple.system import System

# Of a thing's size: how far its surface is drawn in to see whether it only touches.
_DRAWN_IN = 1e-9


@dataclass(frozen=True, eq=False)
class Intersection:
    """Two things whose surfaces are not apart, or one that is not apart from itself.

    Attributes
    ----------
    first, second : which things: bodies in the scene's order, then obstacles. The first is a body.
    kind : "overlaps"; "touches", where the distance is zero and nothing is inside anything; "is inside", where the
        first is wholly inside the second; "is around", the other way round; "is outside" of a room
    triangles : (k, 2) rows of the first's and of the second's own triangles that meet; -1 for a plane, which has none;
        none at all where the surfaces do not meet
    point : (3,) where, one of the places [m]
    depth : roughly how deep [m]
    """

    first: int
    second: int
    kind: str
    triangles: NDArray[np.int64]
    point: NDArray[np.float64]
    depth: float


def find_intersections(
    system: System,
    positions: NDArray[np.float64],
    time: float,
    table: PairTable,
    ignored: Collection[tuple[int, int]] = (),
) -> list[Intersection]:
    """Every pair of things of a scene whose surfaces are not apart, bodies first.

    Pairs of triangles are tested exactly; a distance of zero is no distance. Triangles of one body that share a vertex
    are not tested at that vertex. Pairs of things that do not collide are left out.

    Parameters
    ----------
    positions : (n, 3) of the system's vertices [m]; time : [s], where scripted obstacles are
    table : which things collide
    ignored : pairs (vertex, row of `system.triangles`) that may intersect, with all triangles at that vertex
    """
    return intersections_of(start_surfaces(system, positions, time), table, ignored)


def intersections_of(
    surfaces: StartSurfaces, table: PairTable, ignored: Collection[tuple[int, int]] = ()
) -> list[Intersection]:
    """The same for surfaces that are collected already."""
    met, found = _meeting(surfaces, table, ignored)
    found += _nested(surfaces, table, met)
    found += _behind_planes(surfaces, table)
    return sorted(found, key=lambda item: (item.first, item.second))


def _meeting(
    s: StartSurfaces, table: PairTable, ignored: Collection[tuple[int, int]]
) -> tuple[set[tuple[int, int]], list[Intersection]]:
    """Pairs of things whose triangles meet, ignored ones too; and those that count."""
    pairs, kinds = crossing_triangles(s.points, s.triangles, s.owner, table.collide)
    things = np.sort(s.owner[pairs], axis=1)
    met = {(int(a), int(b)) for a, b in np.unique(things, axis=0)} if len(things) else set()
    counts = ~_are_ignored(s, pairs, ignored)
    pairs, kinds, things = pairs[counts], kinds[counts], things[counts]
    found = []
    for a, b in np.unique(things, axis=0):
        mine = (things == (a, b)).all(axis=1)
        some = pairs[mine]
        crossing = bool((kinds[mine] == CROSSING).any())
        kind = "overlaps" if crossing or (a != b and _still_meets(s, int(a), int(b))) else "touches"
        depths, points = _depths(s.points[s.triangles[some[:, 0]]], s.points[s.triangles[some[:, 1]]])
        deepest = int(depths.argmax())
        depth = float(depths[deepest]) if kind == "overlaps" else 0.0
        local = some - s.first_row[[a, b]]
        found.append(Intersection(int(a), int(b), kind, local, points[deepest], depth))
    return met, found


def _are_ignored(s: StartSurfaces, pairs: NDArray[np.int64], ignored: Collection[tuple[int, int]]) -> NDArray[np.bool_]:
    """(k,) whether one triangle of a pair is an ignored vertex's, and the other the one it may meet."""
    out = np.zeros(len(pairs), dtype=np.bool_)
    if not ignored or not len(pairs):
        return out
    count = np.int64(len(s.triangles))
    allowed = np.unique([vertex * count + row for vertex, row in ignored])
    for one, other in ((0, 1), (1, 0)):
        keys = s.triangles[pairs[:, one]].astype(np.int64) * count + pairs[:, other, None]
        out |= np.isin(keys, allowed).any(axis=1)
    return out


def _still_meets(s: StartSurfaces, a: int, b: int) -> bool:
    """Whether a still meets b, or is inside it, with its surface drawn in by next to nothing."""
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
    x[rows] += _DRAWN_IN * size * inwards[rows] / length[rows, None]
    triangles = np.concatenate([mine, theirs])
    owner = np.repeat(np.array([0, 1], dtype=np.int32), [len(mine), len(theirs)])
    pairs, _ = crossing_triangles(x, triangles, owner, np.array([[False, True], [True, False]]))
    if len(pairs):
        return True
    return bool(s.solid[b]) and round(winding_number(x, theirs, tuple(x[mine[0, 0]]))) != 0


def _depths(first: NDArray[np.float64], second: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """How far (k,) each pair of triangles (k, 3, 3) goes through each other, and about where (k, 3)."""
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
    """Surfaces that do not meet, but one of them is wholly inside the other, or outside of a room."""
    low, high = _boxes(s)
    none = np.zeros((0, 2), dtype=np.int64)
    found: dict[tuple[int, int, str], Intersection] = {}
    is_room = np.isin(np.arange(len(s.solid)), s.rooms)
    for thing, vertex in s.pieces.tolist():
        if is_room[thing]:
            continue
        q = s.points[vertex]
        point = (q[0], q[1], q[2])
        within = s.solid & (low < q).all(axis=1) & (q < high).all(axis=1)
        for other in np.flatnonzero(table.collide[thing] & (within | is_room)).tolist():
            if other == thing or (min(thing, other), max(thing, other)) in met:
                continue
            room = bool(is_room[other])
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
    low = np.full((len(s.solid), 3), np.inf)
    high = -low
    for k in range(3):
        x = s.points[s.triangles, k]
        np.minimum.at(low[:, k], s.owner, x.min(axis=1))
        np.maximum.at(high[:, k], s.owner, x.max(axis=1))
    return low, high


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
