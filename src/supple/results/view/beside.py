"""Surfaces that are drawn beside the points of a body: both sides of a sheet, half its thickness away, and its rims;
and tubes about the edges of a rod.

A vertex of such a surface follows one point, and is at a given distance from it along each axis there. The axes follow
from the points alone, so that whatever draws a frame needs no more than they.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from supple.materials.rods.frames import frames as frames_of
from supple.results.view.normals import vertex_normals

Floats = NDArray[np.float64]


def normals(x: Floats, triangles: NDArray[np.int32]) -> Floats:
    """(n, 1, 3) the normal at each point of a sheet."""
    return vertex_normals(x, triangles)[:, None]


def frames(x: Floats, edges: NDArray[np.int32]) -> Floats:
    """(n, 4, 3) at the first material point of each edge (e, 4) of a rod: its frame, and from end to end."""
    a, b, c, d = x[edges].transpose(1, 0, 2)
    out = np.zeros((len(x), 4, 3))
    out[edges[:, 2], :3] = frames_of(b - a, 0.5 * (c - d)).swapaxes(1, 2)
    out[edges[:, 2], 3] = b - a
    return out


# A page computes them too: `AXES` of client/src/shape.ts.
AXES: dict[str, Callable[[Floats, NDArray[np.int32]], Floats]] = {"normals": normals, "frames": frames}


@dataclass(frozen=True, eq=False)
class Beside:
    """Where the vertices of a surface are beside the points that they follow.

    Attributes
    ----------
    axes : name of the d axes at each point
    cells : rows of the points from which the axes follow: (t, 3) triangles of a sheet, (e, 4) edges of a rod
    away : (k, d) distances of the vertices along the axes [m]
    layers : how many surfaces lie on each other where they look like one: the two sides of a sheet
    """

    axes: str
    cells: NDArray[np.int32]
    away: Floats
    layers: int

    def offsets(self, x: Floats, rows: NDArray[np.int64]) -> Floats:
        """(k, 3) of vertices from the points `rows` (k,) of x (n, 3) [m]."""
        return np.einsum("kd,kdi->ki", self.away, AXES[self.axes](x, self.cells)[rows])

    def taken(self, vertices: NDArray[np.int64]) -> Self:
        """Of these vertices."""
        return replace(self, away=self.away[vertices])


def sheet(triangles: NDArray[np.int32], thickness: float) -> tuple[NDArray[np.int64], NDArray[np.int32], Beside]:
    """A closed surface about a middle one: the points (k,) that its vertices follow, its triangles, and where they are.

    Parameters
    ----------
    triangles : (t, 3) of the middle surface, which use all its points; thickness : [m]
    """
    n = int(triangles.max()) + 1
    start, end = triangles.ravel().astype(np.int64), np.roll(triangles, -1, axis=1).ravel().astype(np.int64)
    border = ~np.isin(start * n + end, end * n + start)
    a, b = start[border], end[border]
    rims = np.concatenate([np.column_stack([b, a, a + n]), np.column_stack([b, a + n, b + n])])
    closed = np.concatenate([triangles, triangles[:, ::-1] + n, rims]).astype(np.int32)
    away = np.repeat([[0.5 * thickness], [-0.5 * thickness]], n, axis=0)
    return np.tile(np.arange(n), 2), closed, Beside("normals", triangles, away, 2)


_SIDES = 10  # of a tube
_CAPS = (0.0, np.pi / 6.0, np.pi / 3.0)  # latitudes of the rings of its ends: without creases


def tubes(edges: NDArray[np.int32], radius: float) -> tuple[NDArray[np.int64], NDArray[np.int32], Beside]:
    """A tube with round ends about each edge of a rod; see `sheet`.

    Parameters
    ----------
    edges : (e, 4) both ends and both material points; radius : [m]
    """
    turns = 2.0 * np.pi * np.arange(_SIDES) / _SIDES
    latitudes = np.concatenate([-np.array(_CAPS)[::-1], _CAPS])
    ends = np.sign(np.arange(len(latitudes)) - 0.5 * (len(latitudes) - 1))
    rings = [
        np.column_stack(
            [np.cos(at) * np.cos(turns), np.cos(at) * np.sin(turns), np.full(_SIDES, np.sin(at)), np.full(_SIDES, end)]
        )
        for at, end in zip(latitudes, ends, strict=True)
    ]
    away = np.concatenate([[[0.0, 0.0, -1.0, -1.0]], *rings, [[0.0, 0.0, 1.0, 1.0]]])
    away *= [radius, radius, radius, 0.5]
    away[:, 0] -= radius  # from the material point
    own, following = np.arange(_SIDES), (np.arange(_SIDES) + 1) % _SIDES
    last = len(away) - 1
    triangles = [np.column_stack([np.zeros_like(own), following + 1, own + 1])]
    for ring in range(len(latitudes) - 1):
        low, high = 1 + ring * _SIDES, 1 + (ring + 1) * _SIDES
        triangles.append(np.column_stack([low + own, low + following, high + following]))
        triangles.append(np.column_stack([low + own, high + following, high + own]))
    triangles.append(np.column_stack([np.full_like(own, last), last - _SIDES + own, last - _SIDES + following]))
    count, of_one = len(edges), np.concatenate(triangles)
    every = (len(away) * np.arange(count)[:, None, None] + of_one).reshape(-1, 3).astype(np.int32)
    rows = np.repeat(edges[:, 2], len(away)).astype(np.int64)
    return rows, every, Beside("frames", edges, np.tile(away, (count, 1)), 1)
