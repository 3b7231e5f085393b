"""What is wrong with a triangle surface, and where: the report of `SurfaceMesh.check`."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from supple.mesh.checked_arrays import frozen, place
from supple.mesh.topology import Components, edge_keys, facet_keys
from supple.numerics.geometry.triangle_crossings import crossing_triangles

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
        found = [
            self._edges(self.open_edges, "open boundary edge", "the surface has a hole there"),
            self._edges(self.non_manifold_edges, "non-manifold edge", "three or more triangles share it"),
            self._edges(self.inconsistent_edges, "inconsistent edge", "its triangles face opposite sides"),
            self._triangles(self.duplicate_triangles, "duplicate triangle", "pair"),
            self._triangles(self.degenerate_triangles, "degenerate triangle", "without area"),
            self._triangles(self.folded_triangles, "folded triangle", "pair that lies on each other"),
            self._triangles(self.intersecting_triangles, "intersecting triangle", "pair"),
            self._unused(),
            self._facing(),
        ]
        return [line for line in found if line is not None]

    def __str__(self) -> str:
        pieces = "1 component" if self.component_count == 1 else f"{self.component_count} components"
        lines = self.problems or ["nothing wrong: watertight, oriented outward, no self-intersection"]
        return "\n".join([f"{self.surface!r}, {pieces}", *lines])

    def _edges(self, edges: NDArray[np.int32], name: str, why: str) -> str | None:
        if len(edges) == 0:
            return None
        a, b = self.surface.vertices[edges[0]]
        ends, middle = f"{edges[0, 0]} and {edges[0, 1]}", place(0.5 * (a + b))
        return f"{_count(len(edges), name)}: {_first(edges)}between vertices {ends} at {middle}, {why}"

    def _triangles(self, rows: NDArray[np.int32], name: str, kind: str) -> str | None:
        if len(rows) == 0:
            return None
        vertices, triangles = self.surface.vertices, self.surface.triangles
        where = place(vertices[triangles[np.ravel(rows[0])[0]]].mean(axis=0))
        if rows.ndim == 1:
            return f"{_count(len(rows), name)} {kind}: {_first(rows)}triangle {rows[0]} at {where}"
        many = rows is self.intersecting_triangles and len(rows) >= MAX_INTERSECTIONS
        count = f"{len(rows)} or more {name} {kind}s" if many else f"{_count(len(rows), f'{name} {kind}')}"
        if kind != "pair" and len(rows) > 1:
            count = f"{len(rows)} {name} pairs that lie on each other"
        return f"{count}: {_first(rows)}triangles {rows[0, 0]} and {rows[0, 1]} at {where}"

    def _unused(self) -> str | None:
        rows = self.unused_vertices
        if len(rows) == 0:
            return None
        where = place(self.surface.vertices[rows[0]])
        name = "vertex" if len(rows) == 1 else "vertices"
        return f"{len(rows)} {name} in no triangle: {_first(rows)}vertex {rows[0]} at {where}"

    def _facing(self) -> str | None:
        rows = self.wrong_facing_components
        if len(rows) == 0:
            return None
        triangle = int(np.flatnonzero(self.surface.components.labels == rows[0])[0])
        where = place(self.surface.vertices[self.surface.triangles[triangle]].mean(axis=0))
        verb = "faces" if len(rows) == 1 else "face"
        return (
            f"{_count(len(rows), 'component')} of {self.component_count} {verb} the wrong way (bodies face outward, "
            f"cavities inward): {_first(rows)}component {rows[0]} at {where}"
        )


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


def _count(n: int, name: str) -> str:
    return f"1 {name}" if n == 1 else f"{n} {name}s"


def _first(rows: NDArray[np.int32]) -> str:
    return "" if len(rows) == 1 else "the first is "


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
    members = [corners[labels == k] for k in range(count)] if count > 1 else [corners]
    lows = np.array([m.min(axis=(0, 1)) for m in members])
    highs = np.array([m.max(axis=(0, 1)) for m in members])
    wrong = []
    for k in range(count):
        point = members[k][0, 0]
        around = np.flatnonzero(((lows < point) & (highs > point)).all(axis=1))
        depth = 0
        if nested:
            depth = sum(abs(winding_number(members[other], point)) > 0.5 for other in around if other != k)
        if (volumes[k] > 0.0) != (depth % 2 == 0):
            wrong.append(k)
    return np.array(wrong, dtype=np.int32)


def winding_number(triangles: NDArray[np.float64], point: NDArray[np.float64]) -> float:
    """How many times closed triangles (m, 3, 3) wind around a point: 1 inside, 0 outside, -1 inside an inward surface.

    Sum of signed solid angles (Van Oosterom & Strackee 1983, eq. 8) over 4 pi.
    """
    a, b, c = (triangles - point).transpose(1, 0, 2)
    la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
    det = np.einsum("ij,ij->i", a, np.cross(b, c))
    dots = [np.einsum("ij,ij->i", *pair) for pair in ((a, b), (b, c), (c, a))]
    below = la * lb * lc + dots[0] * lc + dots[1] * la + dots[2] * lb
    return float(np.arctan2(det, below).sum() / (2.0 * np.pi))
