"""The coarse space of the damping's preconditioner: velocities that lattices of nodes carry, interpolated trilinearly.

Each group of neighbouring vertices has a frame, the rotation that takes it nearest to where the scene places it.
Velocities are interpolated in that frame, so that a matrix of the shape that the scene places serves a body that turns
and bends.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.numerics.sparse.partition import bisected_groups

# Vertices of a group and of a node; nodes of the lattice of a body, groups of a body.
VERTICES, NODE, MOST = 32, 8, 64
_CORNERS = np.array(list(np.ndindex(2, 2, 2)))


@dataclass(frozen=True, eq=False)
class CoarseSpace:
    """Of the damped vertices that can move, group after group, those of bodies stitched to each other together.

    Attributes
    ----------
    rows : (r,) vertices; start : (g + 1,) rows of each group; blocks : (b + 1,) groups of each body
    offsets : (r, 3) where the scene places the rows, relative to the group's center [m]
    nodes, weights : (r, 8) of the rows; node_start : (b + 1,) nodes of each body
    """

    rows: NDArray[np.int64]
    start: NDArray[np.int64]
    blocks: NDArray[np.int64]
    offsets: NDArray[np.float64]
    nodes: NDArray[np.int64]
    weights: NDArray[np.float64]
    node_start: NDArray[np.int64]

    @classmethod
    def of(
        cls, rows: NDArray[np.int64], placed: NDArray[np.float64], bodies: NDArray[np.int32], pieces: NDArray[np.int32]
    ) -> CoarseSpace:
        """Group the vertices `rows`.

        Parameters
        ----------
        placed : (n, 3) where the scene places all vertices [m]
        bodies : (n,) what is solved together; pieces : (n,) what a group and a lattice may not exceed
        """
        groups, nodes, weights = [], [], []
        blocks, node_start = [0], [0]
        for body in np.unique(bodies[rows]):
            mine = rows[bodies[rows] == body]
            made = bisected_groups(placed[mine], pieces[mine], min(MOST, max(1, len(mine) // VERTICES)))
            groups += [mine[np.sort(group)] for group in made]
            blocks.append(len(groups))
            mine = np.concatenate(groups[blocks[-2] :])
            own, share = _lattice(placed[mine], pieces[mine], min(MOST, len(mine) // NODE + 16))
            nodes.append(own + node_start[-1])
            weights.append(share)
            node_start.append(node_start[-1] + int(own.max()) + 1)
        start = np.concatenate([[0], np.cumsum([len(group) for group in groups])])
        offsets = np.concatenate([placed[group] - placed[group].mean(axis=0) for group in groups])
        ordered, lattice = np.concatenate(groups), (np.concatenate(nodes), np.concatenate(weights))
        return cls(ordered, start, np.array(blocks), offsets, *lattice, np.array(node_start))

    def inverses(self, matrices: list[NDArray[np.float64]]) -> NDArray[np.float32]:
        """Those of all bodies, one after the other, of their matrices."""
        parts = []
        for A in matrices:
            # Nodes outside of a body may move nothing, and several of them the same vertices.
            size = np.maximum(A.diagonal(), 0.0)
            scale = np.where(size > 1e-12 * size.max(), 1.0 / np.sqrt(np.where(size > 0.0, size, np.inf)), 0.0)
            parts.append(scale[:, None] * np.linalg.inv(scale[:, None] * A * scale + 1e-9 * np.eye(len(A))) * scale)
        return np.concatenate([part.ravel() for part in parts]).astype(np.float32)


def _lattice(
    x: NDArray[np.float64], pieces: NDArray[np.int32], most: int
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Nodes (r, 8) of points (r, 3) and their weights, with about `most` nodes of cubic cells; at least one cell."""
    low, extent = x.min(axis=0), np.ptp(x, axis=0)
    size, best = extent.max(), None
    while True:
        counts = np.maximum(1, np.round(extent / size if size > 0.0 else extent)).astype(np.int64)
        place = (x - low) / np.where(extent > 0.0, extent, 1.0) * counts
        cell = np.minimum(place.astype(np.int64), counts - 1)
        near = np.abs((1 - _CORNERS) - (place - cell)[:, None]).prod(axis=2)
        keys = np.ravel_multi_index(tuple((cell[:, None] + _CORNERS).transpose(2, 0, 1)), tuple(counts + 1))
        keys += pieces[:, None] * (counts + 1).prod()
        names, nodes = np.unique(keys, return_inverse=True)
        if best is not None and len(names) > most:
            return best
        best = nodes.reshape(keys.shape), near
        if len(names) >= most:
            return best
        size *= 0.85
