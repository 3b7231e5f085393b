"""The parts of a series: connected pieces, each with its own rows of points, tets and triangles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.mesh.io.series.series import Cells
from supple.mesh.topology import TET_FACETS, facet_keys, graph_components
from supple.results.check.geometry.orientation import volume_signs

Ints = NDArray[np.int64]
# With more pieces than these, the parts that the file names are not divided.
_MOST_PIECES = 1000
# A part of which at least this share of tets is negative at first, but not all, has tets of either winding.
_EITHER_WINDING = 0.1


@dataclass(frozen=True, eq=False)
class Parts:
    """Points, tets and triangles in the order of the parts.

    Attributes
    ----------
    names : of the parts; points : (n,) rows of the series' positions
    tets, triangles : rows of these points; surfaces are those given, and the boundaries of tets
    ends : for each part, the ends of its points, tets and triangles
    tet_numbers : (m,) the rows of tets in the files; triangle_numbers : (t,) as well, or -1 on the boundary of tets
    twins : (k, 2) rows of the series' positions that are one point here
    notes : what was assumed, one sentence each
    """

    names: tuple[str, ...]
    points: Ints
    tets: Ints
    triangles: Ints
    ends: Ints
    tet_numbers: Ints
    triangle_numbers: Ints
    twins: Ints
    notes: tuple[str, ...]


def parts_of(cells: Cells, first: NDArray[np.float64], last: NDArray[np.float64] | None) -> Parts:
    """The parts of cells, with positions (count, 3) of the first frame, and of the last where it has these cells."""
    notes: list[str] = []
    tets, triangles = cells.tets, cells.triangles
    twins = _twins(cells, first, first if last is None else last)
    if len(twins):
        one = np.arange(cells.count)
        one[twins[:, 0]] = twins[:, 1]
        tets, triangles = one[tets], one[triangles]
        notes.append(f"{len(twins)} points on open sides that lie on others are taken as these")
    degenerate = (np.diff(np.sort(triangles, axis=1), axis=1) == 0).any(axis=1)
    if degenerate.any():
        notes.append(f"{np.count_nonzero(degenerate)} triangles that have a point twice are left out")
    triangle_numbers = np.flatnonzero(~degenerate)
    triangles = triangles[~degenerate]
    piece, names = _pieces(cells, tets, triangles)
    used = np.zeros(cells.count, dtype=bool)
    used[tets], used[triangles] = True, True
    points = np.flatnonzero(used)
    points = points[np.argsort(piece[points], kind="stable")]
    row = np.full(cells.count, -1)
    row[points] = np.arange(len(points))
    order = np.argsort(piece[tets[:, 0]], kind="stable")
    tets, tet_numbers = _wound(row[tets[order]], piece[tets[order, 0]], first[points], notes), order
    boundary = _boundary(tets, len(points))
    triangles = row[triangles]
    extra = ~np.isin(facet_keys(triangles, len(points)), facet_keys(tets[:, TET_FACETS].reshape(-1, 3), len(points)))
    triangles = np.concatenate([boundary, triangles[extra]])
    triangle_numbers = np.concatenate([np.full(len(boundary), -1), triangle_numbers[extra]])
    of_triangle = piece[points][triangles[:, 0]]
    order = np.argsort(of_triangle, kind="stable")
    counts = (
        np.bincount(labels, minlength=len(names)) for labels in (piece[points], piece[points][tets[:, 0]], of_triangle)
    )
    ends = np.cumsum(np.stack(list(counts), axis=1), axis=0)
    return Parts(names, points, tets, triangles[order], ends, tet_numbers, triangle_numbers[order], twins, tuple(notes))


def _twins(cells: Cells, first: NDArray[np.float64], last: NDArray[np.float64]) -> Ints:
    """Pairs (k, 2) of points on open sides of triangles, of one named part, that coincide in both frames.

    Formats for drawing repeat a point for each of its normals. A closed surface has no open side: two bodies that
    touch stay two.
    """
    nothing = np.zeros((0, 2), dtype=np.int64)
    triangles = cells.triangles
    if len(triangles) == 0:
        return nothing
    sides = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    keys, counts = np.unique(sides[:, 0] * cells.count + sides[:, 1], return_counts=True)
    open_ = np.unique(np.concatenate(np.divmod(keys[counts == 1], cells.count)))
    places = np.column_stack([cells.part[open_], first[open_] + 0.0, last[open_] + 0.0])
    _, keep, group = np.unique(places, axis=0, return_index=True, return_inverse=True)
    kept = open_[keep][group.ravel()]
    moved = kept != open_
    return np.column_stack([open_[moved], kept[moved]]) if moved.any() else nothing


def _pieces(cells: Cells, tets: Ints, triangles: Ints) -> tuple[Ints, tuple[str, ...]]:
    """The piece of each point (count,), in the order of their first points, and the names of the pieces."""
    ends = [tets[:, [0, k]] for k in (1, 2, 3)] + [triangles[:, [0, k]] for k in (1, 2)]
    edges = np.concatenate(ends)
    label = graph_components(cells.count, edges[:, 0], edges[:, 1]).astype(np.int64)
    used = np.unique(np.concatenate([tets.ravel(), triangles.ravel()]))
    lowest = np.full(cells.count, cells.count)
    np.minimum.at(lowest, label[used], used)
    key = lowest[label] if len(np.unique(label[used])) <= _MOST_PIECES else cells.part
    _, first, of = np.unique(key[used], return_index=True, return_inverse=True)
    piece = np.zeros(cells.count, dtype=np.int64)
    piece[used] = of.ravel()
    owners = cells.part[used[first]]
    names, counts = [], np.bincount(owners, minlength=len(cells.names))
    seen = np.zeros(len(cells.names), dtype=np.int64)
    for owner in owners.tolist():
        base = cells.names[owner] or ("part" if counts[owner] > 1 else "mesh")
        names.append(f"{base} {seen[owner]}" if counts[owner] > 1 else base)
        seen[owner] += 1
    return piece, tuple(names)


def _wound(tets: Ints, piece: Ints, x: NDArray[np.float64], notes: list[str]) -> Ints:
    """The tets with the winding that makes those of the first frame positive.

    Where a file winds all tets of a part the other way, all are reoriented, so that a tet that is inverted in the first
    frame stays so.
    """
    if len(tets) == 0:
        return tets
    negative = volume_signs(np.ascontiguousarray(x), tets.astype(np.int32)) < 0
    share = np.bincount(piece, negative) / np.maximum(np.bincount(piece), 1)
    mixed = (share >= _EITHER_WINDING) & (share <= 1.0 - _EITHER_WINDING)
    reoriented = np.where(mixed[piece], negative, share[piece] > 0.5)
    if mixed.any():
        notes.append("tets are wound both ways; those that are negative in the first frame are reoriented")
    out = tets.copy()
    out[reoriented] = out[reoriented][:, [1, 0, 2, 3]]
    return out


def _boundary(tets: Ints, count: int) -> Ints:
    """(t, 3) facets of one tet only, counter-clockwise from outside."""
    facets = tets[:, TET_FACETS].reshape(-1, 3)
    if len(facets) == 0:
        return facets
    _, first, counts = np.unique(facet_keys(facets, count), return_index=True, return_counts=True)
    return facets[np.sort(first[counts == 1])]
