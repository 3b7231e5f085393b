"""What is wrong with a triangle surface, and where: the report of `SurfaceMesh.check`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from supple.mesh.checked_arrays import frozen, place
from supple.mesh.topology import Components, edge_keys, facet_keys
from supple.numerics.geometry.triangle_crossings import crossing_triangles
from supple.numerics.geometry.winding_number import winding_number

# Unconnected triangles can have millions of intersections; a few are enough to find the fault.
MAX_INTERSECTIONS = 100
# Neighbours that enclose less than this angle [rad] lie on each other, within round-off.
FOLD_ANGLE = 1e-7
ROUND_OFF_UNITS = 64.0


class CheckedSurface(Protocol):
    """What a check reads of a `SurfaceMesh`, which itself imports this module."""

    @property
    def vertices(self) -> NDArray[np.float64]: ...
    @property
    def triangles(self) -> NDArray[np.int32]: ...
    @property
    def shares_vertices(self) -> bool: ...

    area_vectors: cached_property[NDArray[np.float64]]
    volume: cached_property[float]
    used_vertices: cached_property[NDArray[np.int32]]
    components: cached_property[Components]


@dataclass(frozen=True, eq=False)
class SurfaceReport:
    """All faults of a surface.

    Indices are rows of the surface's `triangles` and `vertices`.

    Attributes
    ----------
    surface : the surface that was checked
    open_edges : (k, 2) vertex pairs that only one triangle has
    non_manifold_edges : (k, 2) vertex pairs that three or more triangles share
    inconsistent_edges : (k, 2) vertex pairs whose two triangles run along them in the same direction
    duplicate_triangles : (k, 2) triangles with the same three vertices
    degenerate_triangles : (k,) triangles without area, within round-off
    folded_triangles : (k, 2) neighbours that lie on each other
    intersecting_triangles : (k, 2) triangles that cross or touch without sharing a vertex there; at most 100 are listed
    unused_vertices : (k,) vertices that no triangle has (none where the surface shares its vertices with a tet mesh)
    wrong_facing_components : components that face inward, or cavities of others that face outward; only searched
        for where the surface is watertight and consistently oriented
    component_count : number of connected pieces
    """

    surface: CheckedSurface
    open_edges: NDArray[np.int32]
    non_manifold_edges: NDArray[np.int32]
    inconsistent_edges: NDArray[np.int32]
    duplicate_triangles: NDArray[np.int32]
    degenerate_triangles: NDArray[np.int32]
    folded_triangles: NDArray[np.int32]
    intersecting_triangles: NDArray[np.int32]
    unused_vertices: NDArray[np.int32]
    wrong_facing_components: NDArray[np.int32]
    component_count: int

    @property
    def watertight(self) -> bool:
        """True where each edge belongs to exactly two triangles."""
        return len(self.open_edges) == 0 and len(self.non_manifold_edges) == 0

    @property
    def consistently_oriented(self) -> bool:
        """True where neighbours agree on which side is outside."""
        return len(self.inconsistent_edges) == 0

    @property
    def outward(self) -> bool:
        """True where a closed, consistent surface faces outward (and its cavities inward)."""
        return self.watertight and self.consistently_oriented and len(self.wrong_facing_components) == 0

    @property
    def self_intersecting(self) -> bool:
        """True where triangles cross, touch or lie on each other."""
        return len(self.intersecting_triangles) > 0 or len(self.folded_triangles) > 0

    @property
    def ok(self) -> bool:
        """True where nothing is wrong."""
        return not self.problems

    @cached_property
    def problems(self) -> list[str]:
        """One line for each kind of fault: its name, how many there are, and where the first one is."""
        surface, vertices = self.surface, self.surface.vertices

        def edge(row: NDArray[np.int32]) -> tuple[str, NDArray[np.float64]]:
            return f"between vertices {row[0]} and {row[1]}", vertices[row].mean(axis=0)

        def vertex(row: int) -> tuple[str, NDArray[np.float64]]:
            return f"vertex {row}", vertices[row]

        def triangle(row: int) -> tuple[str, NDArray[np.float64]]:
            return f"triangle {row}", vertices[surface.triangles[row]].mean(axis=0)

        def pair(row: NDArray[np.int32]) -> tuple[str, NDArray[np.float64]]:
            return f"triangles {row[0]} and {row[1]}", triangle(row[0])[1]

        def component(row: int) -> tuple[str, NDArray[np.float64]]:
            return f"component {row}", triangle(int(np.argmax(surface.components.labels == row)))[1]

        crossing = self.intersecting_triangles
        more = "or more " if len(crossing) >= MAX_INTERSECTIONS else ""
        count, facing = self.component_count, "the wrong way (bodies face outward, cavities inward)"
        found = [
            _line(self.open_edges, edge, "open boundary edge{s}", ", the surface has a hole there"),
            _line(self.non_manifold_edges, edge, "non-manifold edge{s}", ", three or more triangles share it"),
            _line(self.inconsistent_edges, edge, "inconsistent edge{s}", ", its triangles face opposite sides"),
            _line(self.duplicate_triangles, pair, "duplicate triangle pair{s}"),
            _line(self.degenerate_triangles, triangle, "degenerate triangle{s} without area"),
            _line(self.folded_triangles, pair, "folded triangle pair{s} that {lie} on each other"),
            _line(crossing, pair, f"{more}intersecting triangle pair{{s}}"),
            _line(self.unused_vertices, vertex, "{vertices} in no triangle"),
            _line(self.wrong_facing_components, component, f"component{{s}} of {count} {{face}} {facing}"),
        ]
        return [line for line in found if line]

    def __str__(self) -> str:
        pieces = "1 component" if self.component_count == 1 else f"{self.component_count} components"
        lines = self.problems or ["nothing wrong: watertight, oriented outward, no self-intersection"]
        return "\n".join([f"{self.surface!r}, {pieces}", *lines])


def check_surface(surface: CheckedSurface) -> SurfaceReport:
    """Check a surface; see `SurfaceReport` for the faults that are searched for."""
    n = len(surface.vertices)
    keys = edge_keys(surface.triangles, n)
    unique, inverse, counts = np.unique(keys.ravel(), return_inverse=True, return_counts=True)
    pairs = np.column_stack(np.divmod(unique, n)).astype(np.int32)
    # +1 where a triangle runs from the lower to the higher vertex of an edge, -1 where it runs back.
    starts = surface.triangles
    direction = np.where(starts < np.roll(starts, -1, axis=1), 1, -1).ravel()
    balance = np.zeros(len(unique), dtype=np.int64)
    np.add.at(balance, inverse.ravel(), direction)
    # A triangle with a vertex twice is reported as degenerate; its side from that vertex to itself is not an edge.
    real = pairs[:, 0] != pairs[:, 1]
    open_edges, shared_by_many = pairs[real & (counts == 1)], pairs[real & (counts > 2)]
    inconsistent = pairs[real & (counts == 2) & (balance != 0)]
    degenerate = _degenerate_triangles(surface)
    regular = np.ones(len(surface.triangles), dtype=bool)
    regular[degenerate] = False
    closed = len(open_edges) == 0 and len(shared_by_many) == 0 and len(inconsistent) == 0
    unused = np.empty(0, dtype=np.int32)
    if not surface.shares_vertices:
        unused = np.setdiff1d(np.arange(n, dtype=np.int32), surface.used_vertices)
    intersecting = _intersecting_triangles(surface, regular)
    wrong_facing = np.empty(0, dtype=np.int32)
    if closed:
        wrong_facing = _wrong_facing(surface, nested=len(intersecting) == 0)
    return SurfaceReport(
        surface=surface,
        open_edges=frozen(open_edges),
        non_manifold_edges=frozen(shared_by_many),
        inconsistent_edges=frozen(inconsistent),
        duplicate_triangles=frozen(_duplicate_triangles(surface)),
        degenerate_triangles=frozen(degenerate),
        folded_triangles=frozen(_folded_triangles(surface, inverse.reshape(-1, 3), counts, regular)),
        intersecting_triangles=frozen(intersecting),
        unused_vertices=frozen(unused),
        wrong_facing_components=frozen(wrong_facing),
        component_count=surface.components.count,
    )


def _line(rows: NDArray[np.int32], first: Callable[[Any], tuple[str, NDArray]], name: str, why: str = "") -> str:
    """One kind of fault: how many, and the name and place that `first` gives for the first one; "" without faults."""
    if len(rows) == 0:
        return ""
    if len(rows) == 1:
        words, begin = {"s": "", "lie": "lies", "face": "faces", "vertices": "vertex"}, ""
    else:
        words, begin = {"s": "s", "lie": "lie", "face": "face", "vertices": "vertices"}, "the first is "
    what, where = first(rows[0])
    return f"{len(rows)} {name.format(**words)}: {begin}{what} at {place(where)}{why}"


def _duplicate_triangles(surface: CheckedSurface) -> NDArray[np.int32]:
    keys = facet_keys(surface.triangles, len(surface.vertices))
    order = np.argsort(keys, kind="stable")
    same = keys[order][1:] == keys[order][:-1]
    return np.column_stack([order[:-1][same], order[1:][same]]).astype(np.int32)


def _degenerate_triangles(surface: CheckedSurface) -> NDArray[np.int32]:
    corners = surface.vertices[surface.triangles]
    sides = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2)
    longest = sides.max(axis=1)
    height_times_longest = 2.0 * np.linalg.norm(surface.area_vectors, axis=1)
    reach = np.maximum(longest, np.abs(corners).max(axis=(1, 2)))
    flat = height_times_longest <= ROUND_OFF_UNITS * np.finfo(np.float64).eps * longest * reach
    return np.flatnonzero(flat).astype(np.int32)


def _folded_triangles(
    surface: CheckedSurface, edge_of_side: NDArray[np.int64], counts: NDArray[np.int64], regular: NDArray[np.bool_]
) -> NDArray[np.int32]:
    """Neighbours across an edge (of exactly two triangles) that enclose no angle."""
    sides = edge_of_side.ravel()
    order = np.argsort(sides, kind="stable")
    order = order[(counts[sides[order]] == 2)]
    first, second = order[0::2], order[1::2]
    a, b = first // 3, second // 3
    keep = regular[a] & regular[b]
    first, second, a, b = first[keep], second[keep], a[keep], b[keep]
    start = surface.triangles[a, first % 3]
    end = surface.triangles[a, (first + 1) % 3]
    # Side k of a triangle runs from its corner k to k + 1: corner k + 2 is opposite.
    tips = surface.triangles[a, (first + 2) % 3], surface.triangles[b, (second + 2) % 3]
    x = surface.vertices
    along = x[end] - x[start]
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    arms = []
    for tip in tips:
        arm = x[tip] - x[start]
        arm = arm - np.einsum("ij,ij->i", arm, along)[:, None] * along
        arms.append(arm / np.linalg.norm(arm, axis=1, keepdims=True))
    folded = (np.linalg.norm(arms[0] - arms[1], axis=1) < FOLD_ANGLE) & (tips[0] != tips[1])
    return np.column_stack([a[folded], b[folded]]).astype(np.int32)


def _intersecting_triangles(surface: CheckedSurface, regular: NDArray[np.bool_]) -> NDArray[np.int32]:
    """Pairs of triangles, at most `MAX_INTERSECTIONS`, with common points other than shared vertices; exact."""
    rows = np.flatnonzero(regular)
    if len(rows) < 2:
        return np.empty((0, 2), dtype=np.int32)
    # Scaled by a power of two, which is exact, so that products of three coordinates neither overflow nor underflow.
    _, power = np.frexp(np.abs(surface.vertices).max())
    one_owner = np.zeros(len(rows), dtype=np.int32)
    pairs, _ = crossing_triangles(
        np.ldexp(surface.vertices, -power), surface.triangles[rows], one_owner, np.array([[True]]), MAX_INTERSECTIONS
    )
    return rows[pairs].astype(np.int32)


def _wrong_facing(surface: CheckedSurface, nested: bool) -> NDArray[np.int32]:
    """Components whose signed volume has the wrong sign for their depth inside other components.

    At even depth a component must face outward, at odd depth (a cavity) inward. Where components intersect, none is
    clearly inside another (`nested` is False), and all must face outward.
    """
    count, labels = surface.components
    corners = surface.vertices[surface.triangles]
    corners = corners - corners.mean(axis=(0, 1))
    signed = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))
    volumes = np.bincount(labels, weights=signed, minlength=count)
    members = [np.flatnonzero(labels == k) for k in range(count)]
    lows = np.array([corners[rows].min(axis=(0, 1)) for rows in members])
    highs = np.array([corners[rows].max(axis=(0, 1)) for rows in members])
    points, triangles = corners.reshape(-1, 3), np.arange(corners.size // 3, dtype=np.int32).reshape(-1, 3)
    wrong = []
    for k in range(count):
        point = corners[members[k][0], 0]
        around = np.flatnonzero(((lows < point) & (highs > point)).all(axis=1))
        depth = 0
        if nested:
            of = [triangles[members[other]] for other in around if other != k]
            depth = sum(abs(winding_number(points, piece, tuple(point))) > 0.5 for piece in of)
        if (volumes[k] > 0.0) != (depth % 2 == 0):
            wrong.append(k)
    return np.array(wrong, dtype=np.int32)
