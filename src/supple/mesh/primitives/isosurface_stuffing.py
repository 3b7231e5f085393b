"""Filling the inside of a smooth surface with well-shaped tets.

Isosurface stuffing (Labelle & Shewchuk 2007, "Isosurface Stuffing: Fast Tetrahedral Meshes with Good Dihedral
Angles"): the surface cuts a body-centred cubic lattice. Before that, lattice points too close to a cut are moved onto
the surface, so that no piece is thin. With the distances of the paper's table
(the safe choice of its section 3) dihedral angles stay between 10.7 and 164.8 degrees.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from supple.errors import MeshError
from supple.mesh.primitives.sizes import not_too_many
from supple.mesh.tetmesh import TetMesh
from supple.mesh.topology import TET_EDGES, edge_keys, without_unused

# A function of points (k, 3) that is negative inside, zero on the surface, and approximately a distance near it.
Implicit = Callable[[NDArray[np.float64]], NDArray[np.float64]]

# A cut closer than this fraction of the edge to an end moves this end onto the surface; for long and short edges.
SNAP_LONG, SNAP_SHORT = 0.24999, 0.41189
# Mean edge of the lattice over its spacing: 4 short edges, sqrt(3)/2 long, for 3 long ones.
MEAN_EDGE = (4.0 * np.sqrt(0.75) + 3.0) / 7.0
# Corners 0, 1 of a tet span a long edge of one half of the lattice, corners 2, 3 one of the other half.
PARTNER = np.array([1, 0, 3, 2])
# Of cuts, which halve what is left of an edge.
BISECTIONS = 40


def stuff(
    owner: str,
    inside: Implicit,
    bounds: tuple[NDArray[np.float64], NDArray[np.float64]],
    edge_length: float,
    bisections: int = BISECTIONS,
) -> TetMesh:
    """Tets that fill the region where `inside` is negative.

    Parameters
    ----------
    owner : name of the shape, for error messages
    inside : function of points (k, 3) -> (k,), negative inside
    bounds : lowest and highest corner of a box around the region [m]; a lattice point lies in its middle
    edge_length : mean edge [m]
    bisections : of each edge that the surface cuts

    Raises
    ------
    MeshError : where the region is empty, or the lattice would be too large.
    """
    low, high = bounds
    spacing = edge_length / MEAN_EDGE
    with np.errstate(over="ignore"):
        elements = 12.0 * float(np.prod((high - low) / spacing + 3.0))
    not_too_many(owner, elements, "make edge_length longer")
    points, tets = _lattice(low, high, spacing)
    values = inside(points)
    # Only tets with a corner inside are needed.
    tets = tets[(values[tets] < 0.0).any(axis=1)]
    nothing = MeshError(f"{owner}: edge_length = {edge_length:g} m is too long: no tet is left; make it shorter")
    if len(tets) == 0:
        raise nothing
    edges, of_tet, is_long = _edges(tets, len(points))
    cuts, fractions = _cuts(inside, points, values, edges, bisections)
    values = values.copy()
    points, cut_is_left = _snap(points, values, edges, is_long, cuts, fractions)
    cut_row = np.full(len(edges), -1)
    cut_row[cut_is_left] = len(points) + np.arange(len(cut_is_left))
    all_points = np.concatenate([points, cuts[cut_is_left]])
    pieces = _pieces(tets, np.sign(values), cut_row[of_tet], all_points)
    if len(pieces) == 0:  # all points that were inside have moved onto the surface
        raise nothing
    return TetMesh(*without_unused(all_points, pieces))


def _lattice(
    low: NDArray[np.float64], high: NDArray[np.float64], spacing: float
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Points and tets of a body-centred cubic lattice that covers a box and at least one layer around it."""
    half = np.ceil(0.5 * (high - low) / spacing).astype(np.int64) + 1
    n = 2 * half + 1
    grid = np.stack(np.meshgrid(*(np.arange(k) for k in n), indexing="ij"), axis=-1).reshape(-1, 3)
    corners = 0.5 * (low + high) + (grid - half) * spacing
    points = np.concatenate([corners, corners + 0.5 * spacing])
    strides = np.array([n[1] * n[2], n[2], 1])
    tets = []
    for axis in range(3):
        # Four centres surround the edge from a corner along `axis`; each two neighbours differ along another axis.
        u, v = (axis + 1) % 3, (axis + 2) % 3
        keep = (grid[:, axis] < n[axis] - 1) & (grid[:, u] > 0) & (grid[:, v] > 0)
        start = np.flatnonzero(keep)
        end = start + strides[axis]
        ring = [start + len(grid) - shift for shift in (strides[u] + strides[v], strides[v], 0, strides[u])]
        for k in range(4):
            tets.append(np.column_stack([start, end, ring[k], ring[(k + 1) % 4]]))
    return points, np.concatenate(tets)


def _edges(tets: NDArray[np.int64], n_points: int) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.bool_]]:
    """Unique edges (e, 2); the edge between corners i and j of each tet (m, 4, 4); which edges are long."""
    unique, inverse = np.unique(edge_keys(tets, n_points), return_inverse=True)
    of_tet = np.zeros((len(tets), 4, 4), dtype=np.int64)
    is_long = np.zeros(len(unique), dtype=bool)
    for row, (i, j) in zip(inverse.reshape(len(tets), 6).T, TET_EDGES, strict=True):
        of_tet[:, i, j] = of_tet[:, j, i] = row
        is_long[row] = PARTNER[i] == j
    return np.column_stack(np.divmod(unique, n_points)), of_tet, is_long


def _cuts(
    inside: Implicit,
    points: NDArray[np.float64],
    values: NDArray[np.float64],
    edges: NDArray[np.int64],
    bisections: int,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Where the surface cuts each edge: points (e, 3), and fractions (e,) from the first end; NaN where it does not."""
    first, second = edges.T
    cut = np.flatnonzero((values[first] < 0.0) != (values[second] < 0.0))
    inner = np.where(values[first[cut]] < 0.0, first[cut], second[cut])
    outer = first[cut] + second[cut] - inner
    a, b = points[inner], points[outer]
    low, high = np.zeros(len(cut)), np.ones(len(cut))
    for _ in range(bisections):
        middle = 0.5 * (low + high)
        is_inside = inside(a + middle[:, None] * (b - a)) < 0.0
        low, high = np.where(is_inside, middle, low), np.where(is_inside, high, middle)
    middle = 0.5 * (low + high)
    positions = np.full((len(edges), 3), np.nan)
    positions[cut] = a + middle[:, None] * (b - a)
    fractions = np.full(len(edges), np.nan)
    fractions[cut] = np.where(inner == first[cut], middle, 1.0 - middle)
    return positions, fractions


def _snap(
    points: NDArray[np.float64],
    values: NDArray[np.float64],
    edges: NDArray[np.int64],
    is_long: NDArray[np.bool_],
    cuts: NDArray[np.float64],
    fractions: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Move lattice points that are too close to cuts onto the nearest cut, and set `values` to 0 there.

    Returns the points, and the edges that are still cut.
    """
    points = points.copy()
    cut = np.flatnonzero(~np.isnan(fractions))
    limit = np.where(is_long[cut], SNAP_LONG, SNAP_SHORT)
    # Every close pair (end of edge, cut), nearest first within each end.
    ends = np.concatenate([edges[cut, 0], edges[cut, 1]])
    relative = np.concatenate([fractions[cut] / limit, (1.0 - fractions[cut]) / limit])
    lengths = np.concatenate([fractions[cut], 1.0 - fractions[cut]]) * np.tile(
        np.where(is_long[cut], 1.0, 0.75**0.5), 2
    )
    close = np.flatnonzero(relative < 1.0)
    order = close[np.lexsort((lengths[close], ends[close]))]
    _, first = np.unique(ends[order], return_index=True)
    chosen = order[first]
    points[ends[chosen]] = cuts[np.tile(cut, 2)[chosen]]
    values[ends[chosen]] = 0.0
    left = cut[(values[edges[cut, 0]] != 0.0) & (values[edges[cut, 1]] != 0.0)]
    return points, left


def _pieces(
    tets: NDArray[np.int64], signs: NDArray[np.float64], cut_of: NDArray[np.int64], points: NDArray[np.float64]
) -> NDArray[np.int64]:
    """The part of each lattice tet inside the surface (figure 3 of the paper), as tets of any winding."""
    sign = signs[tets]
    n_inside, n_outside = (sign < 0).sum(axis=1), (sign > 0).sum(axis=1)
    # Corners sorted: inside, on the surface, outside.
    order = np.argsort(sign, axis=1, kind="stable")
    rows = np.arange(len(tets))
    corner = [tets[rows, order[:, k]] for k in range(4)]

    def cut(i: int, j: int, which: NDArray[np.int64]) -> NDArray[np.int64]:
        """Cut between the sorted corners i and j; the corner j itself where it lies on the surface."""
        on_surface = sign[which, order[which, j]] == 0
        return np.where(on_surface, corner[j][which], cut_of[which, order[which, i], order[which, j]])

    out = [tets[(n_inside > 0) & (n_outside == 0)]]
    some = np.flatnonzero((n_inside == 1) & (n_outside > 0))
    out.append(np.column_stack([corner[0][some], cut(0, 1, some), cut(0, 2, some), cut(0, 3, some)]))

    some = np.flatnonzero((n_inside == 2) & (n_outside == 1))
    p, q, z = corner[0][some], corner[1][some], corner[2][some]
    cp, cq = cut(0, 3, some), cut(1, 3, some)
    from_p = _first_leads(order[some, 0], order[some, 1], order[some, 3], p, q)
    out.append(np.column_stack([p, q, np.where(from_p, cq, cp), z]))
    out.append(np.column_stack([np.where(from_p, p, q), cp, cq, z]))

    some = np.flatnonzero((n_inside == 2) & (n_outside == 2))
    p, q = corner[0][some], corner[1][some]
    bottom = [p, cut(0, 2, some), cut(0, 3, some)]
    top = [q, cut(1, 2, some), cut(1, 3, some)]
    by_2 = _first_leads(order[some, 0], order[some, 1], order[some, 2], p, q)
    by_3 = _first_leads(order[some, 0], order[some, 1], order[some, 3], p, q)
    # The quad on the surface has no neighbour: use its shorter diagonal, unless that would close a cycle.
    one_way = np.linalg.norm(points[bottom[1]] - points[top[2]], axis=1)
    other_way = np.linalg.norm(points[bottom[2]] - points[top[1]], axis=1)
    free = np.where(by_2 != by_3, by_3, one_way <= other_way)
    out += _prisms(bottom, top, [by_2, free, ~by_3])

    some = np.flatnonzero((n_inside == 3) & (n_outside == 1))
    bottom = [corner[k][some] for k in range(3)]
    top = [cut(k, 3, some) for k in range(3)]
    leads = [
        _first_leads(order[some, i], order[some, j], order[some, 3], bottom[i], bottom[j])
        for i, j in ((0, 1), (1, 2), (2, 0))
    ]
    out += _prisms(bottom, top, leads)
    return np.concatenate(out)


def _first_leads(
    p: NDArray[np.int64], q: NDArray[np.int64], n: NDArray[np.int64], p_row: NDArray[np.int64], q_row: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """Whether the quad on facet (p, q, n), n outside, is cut from p to the cut on q n, not from q to that on p n.

    Both tets at the facet must decide equally: the corner with the long edge to n leads, otherwise the lower point.
    """
    p_long, q_long = PARTNER[p] == n, PARTNER[q] == n
    return np.where(p_long | q_long, p_long, p_row < q_row)


def _prisms(
    bottom: list[NDArray[np.int64]], top: list[NDArray[np.int64]], leads: list[NDArray[np.bool_]]
) -> list[NDArray[np.int64]]:
    """Three tets for each prism. leads[k]: the quad of columns k and k + 1 is cut from bottom k to top k + 1."""
    a, b = np.column_stack(bottom), np.column_stack(top)
    # A column precedes those to which the diagonals from its bottom lead. The places are 0, 1, 2, except in a cycle.
    place = np.column_stack([~leads[0] * 1 + leads[2], leads[0] * 1 + ~leads[1], leads[1] * 1 + ~leads[2]])
    order = np.argsort(place, axis=1, kind="stable")
    rows = np.arange(len(a))
    (a0, a1, a2), (b0, b1, b2) = ([x[rows, order[:, k]] for k in range(3)] for x in (a, b))
    return [np.column_stack([a0, a1, a2, b2]), np.column_stack([a0, a1, b1, b2]), np.column_stack([a0, b0, b1, b2])]
