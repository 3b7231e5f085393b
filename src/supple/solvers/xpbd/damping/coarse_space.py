"""The coarse space of the damping's preconditioner: affine velocity fields of groups of neighbouring vertices.

Each group has a frame, the rotation that takes its vertices nearest to where the scene places them. Fields are given in
that frame, so that the coarse matrix, which is computed once for the shape that the scene places, serves a body that
turns and bends.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from supple.numerics.sparse.partition import bisected_groups
from supple.numerics.sparse.skyline_cholesky import factorize, solve
from supple.numerics.svd3 import svd3
from supple.runtime.kernel_cache import njit

# The coarse solve costs as much as the elements' forces where a body has about a hundred groups.
SMALLEST_GROUP, MOST_GROUPS = 32, 64


@dataclass(frozen=True, eq=False)
class VertexGroups:
    """The damped vertices that can move, group after group, those of bodies stitched to each other together.

    Attributes
    ----------
    rows : (r,) vertices; start : (g + 1,) rows of each group; group_of : (n,) group of each vertex, -1 for others
    blocks : (b + 1,) groups of each body
    offsets : (r, 3) where the scene places the rows, relative to the group's center [m]
    fields : (r, 4) 1 and the offset in units of the group's size
    """

    rows: NDArray[np.int64]
    start: NDArray[np.int64]
    group_of: NDArray[np.int64]
    blocks: NDArray[np.int64]
    offsets: NDArray[np.float64]
    fields: NDArray[np.float64]


def vertex_groups(
    rows: NDArray[np.int64], placed: NDArray[np.float64], bodies: NDArray[np.int32], pieces: NDArray[np.int32]
) -> VertexGroups:
    """Group the vertices `rows`.

    Parameters
    ----------
    placed : (n, 3) where the scene places all vertices [m]
    bodies : (n,) what is solved together; pieces : (n,) what a group may not exceed
    """
    members, blocks = [], [0]
    for body in np.unique(bodies[rows]):
        mine = rows[bodies[rows] == body]
        count = min(MOST_GROUPS, max(1, round(len(mine) / SMALLEST_GROUP)))
        members += [mine[np.sort(group)] for group in bisected_groups(placed[mine], pieces[mine], count)]
        blocks.append(len(members))
    start = np.concatenate([[0], np.cumsum([len(group) for group in members])]).astype(np.int64)
    ordered = np.concatenate(members)
    group_of = np.full(len(placed), -1, dtype=np.int64)
    group_of[ordered] = np.repeat(np.arange(len(members)), np.diff(start))
    offsets = np.concatenate([placed[group] - placed[group].mean(axis=0) for group in members])
    fields = np.ones((len(ordered), 4))
    for low, high in pairwise(start):
        size = np.sqrt((offsets[low:high] ** 2).sum(axis=1).mean())
        fields[low:high, 1:] = offsets[low:high] / size if size > 0.0 else 0.0
    return VertexGroups(ordered, start, group_of, np.array(blocks, dtype=np.int64), offsets, fields)


class CoarseMatrix:
    """Z^T (M + H K) Z, factored, body by body.

    Parameters
    ----------
    masses : (n,) [kg]; elements : (vertices (m, k), matrices (m, 3 k, 3 k)) of K, in the scene's placement; H : [s]
    """

    def __init__(
        self,
        groups: VertexGroups,
        masses: NDArray[np.float64],
        elements: Iterable[tuple[NDArray[np.int32], NDArray[np.float64]]],
        H: float,
    ) -> None:
        self._groups = groups
        counts = np.diff(groups.blocks)
        self._offsets = np.concatenate([[0], np.cumsum(counts**2)])
        self._first = np.arange(len(groups.start) - 1, dtype=np.int32)
        self._first -= np.repeat(groups.blocks[:-1], counts).astype(np.int32)
        self._blocks = np.zeros((self._offsets[-1], 12, 12))
        fields = np.zeros((len(groups.group_of), 4))
        fields[groups.rows] = groups.fields
        body_of = np.repeat(np.arange(len(counts)), counts)
        where = groups.blocks, self._offsets, body_of, groups.group_of, fields, self._blocks, self._first
        _add_masses(groups.rows, masses, *where)
        for vertices, matrices in elements:
            _add_elements(vertices, H * matrices, *where)
        for b, count in enumerate(counts):
            factorize(self._of_body(b, count), self._first[groups.blocks[b] : groups.blocks[b + 1]])

    def _of_body(self, b: int, count: int) -> NDArray[np.float64]:
        return self._blocks[self._offsets[b] : self._offsets[b + 1]].reshape(count, count, 12, 12)

    def solve(self, b: NDArray[np.float64]) -> None:
        """b (12 g,) <- (Z^T (M + H K) Z)^-1 b."""
        _solve(self._groups.blocks, self._offsets, self._blocks, self._first, b)


@njit(cache=True)
def frames_of_groups(start, rows, motion, offsets, frames):
    """The rotation (g, 3, 3) of each group from where the scene places it: the polar factor of sum x offset^T."""
    for g in range(len(start) - 1):
        cx = cy = cz = 0.0
        for k in range(start[g], start[g + 1]):
            i = rows[k]
            cx += motion[i, 0]
            cy += motion[i, 1]
            cz += motion[i, 2]
        count = start[g + 1] - start[g]
        cx, cy, cz = cx / count, cy / count, cz / count
        a00 = a01 = a02 = a10 = a11 = a12 = a20 = a21 = a22 = 0.0
        for k in range(start[g], start[g + 1]):
            i = rows[k]
            x, y, z = motion[i, 0] - cx, motion[i, 1] - cy, motion[i, 2] - cz
            u, v, w = offsets[k, 0], offsets[k, 1], offsets[k, 2]
            a00 += x * u
            a01 += x * v
            a02 += x * w
            a10 += y * u
            a11 += y * v
            a12 += y * w
            a20 += z * u
            a21 += z * v
            a22 += z * w
        U, _, V = svd3((a00, a01, a02, a10, a11, a12, a20, a21, a22))
        for i in range(3):
            for j in range(3):
                frames[g, i, j] = U[3 * i] * V[3 * j] + U[3 * i + 1] * V[3 * j + 1] + U[3 * i + 2] * V[3 * j + 2]


@njit(cache=True)
def _add_masses(rows, masses, blocks, offsets, body_of, group_of, fields, out, first):
    for i in rows:
        g = group_of[i]
        b = body_of[g]
        local, count = g - blocks[b], blocks[b + 1] - blocks[b]
        block = out[offsets[b] + local * count + local]
        for p in range(4):
            for q in range(4):
                value = masses[i] * fields[i, p] * fields[i, q]
                for r in range(3):
                    block[3 * p + r, 3 * q + r] += value


@njit(cache=True)
def _add_elements(vertices, matrices, blocks, offsets, body_of, group_of, fields, out, first):
    corners = vertices.shape[1]
    for e in range(len(vertices)):
        for a in range(corners):
            i = vertices[e, a]
            g = group_of[i]
            if g < 0:
                continue
            b = body_of[g]
            row, count = g - blocks[b], blocks[b + 1] - blocks[b]
            for c in range(corners):
                j = vertices[e, c]
                column = group_of[j] - blocks[b]
                if group_of[j] < 0 or column > row:
                    continue
                first[g] = min(first[g], column)
                block = out[offsets[b] + row * count + column]
                for p in range(4):
                    for q in range(4):
                        w = fields[i, p] * fields[j, q]
                        for r in range(3):
                            for s in range(3):
                                block[3 * p + r, 3 * q + s] += w * matrices[e, 3 * a + r, 3 * c + s]


@njit(cache=True)
def _solve(blocks, offsets, factors, first, b):
    for body in range(len(blocks) - 1):
        low, high = blocks[body], blocks[body + 1]
        count = high - low
        factor = factors[offsets[body] : offsets[body + 1]].reshape(count, count, 12, 12)
        solve(factor, first[low:high], b[12 * low : 12 * high])
