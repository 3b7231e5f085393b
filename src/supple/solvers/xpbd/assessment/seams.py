"""Pairs of triangles of two bodies that may meet, because stitches or welds join the bodies there.

These are the pairs of `supple.scene.stitches.masks`; between bodies that are stitched to each other, the pairs with a
stitched corner that meet where the scene places them; and a rigid body with the triangles that are welded to it.
`supple check` leaves out the same ones.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.model.system import System
from supple.numerics.adjacency import Adjacency, adjacency
from supple.numerics.geometry.triangle_crossings import crossing_triangles
from supple.scene.stitches.masks import stitched_crossings


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
    nodes, triangles, points = system.stitching.nodes(), system.triangles, system.points
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
