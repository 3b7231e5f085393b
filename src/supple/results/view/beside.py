"""Surfaces that are drawn beside the points of a body: both sides of a sheet, half its thickness away, and its rims.

A vertex of such a surface follows one point, and is at a given distance from it along each axis there. The axes follow
from the points alone, so that whatever draws a frame needs no more than they.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from supple.results.view.normals import vertex_normals

Floats = NDArray[np.float64]


def normals(x: Floats, triangles: NDArray[np.int32]) -> Floats:
    """(n, 1, 3) the normal at each point of a sheet."""
    return vertex_normals(x, triangles)[:, None]


# A page computes them too: `AXES` of client/src/shape.ts.
AXES: dict[str, Callable[[Floats, NDArray[np.int32]], Floats]] = {"normals": normals}


@dataclass(frozen=True, eq=False)
class Beside:
    """Where the vertices of a surface are beside the points that they follow.

    Attributes
    ----------
    axes : name of the d axes at each point
    cells : rows of the points from which the axes follow: (t, 3) triangles of a sheet
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
