"""The part of bodies on one side of a plane: their clipped surface, and the surface of the section.

The plane is one of the bodies at rest. Points on it lie on edges of tets, at places that no motion changes, because
positions are linear within a tet.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.results.view.model import Model


@dataclass(frozen=True)
class Cut:
    """A plane that hides what is behind it at rest.

    Attributes
    ----------
    axis : 0, 1 or 2; place : from 0 (all is hidden) to 1 (nothing is hidden), as a share of the extent of each body
    """

    axis: int
    place: float


@dataclass(frozen=True, eq=False)
class Triangles:
    """Triangles whose corners lie on edges between vertices.

    Attributes
    ----------
    start, end : (t, 3) vertices; share : (t, 3) of the path from `start` to `end`
    owner : (t,) the tet that each belongs to
    """

    start: NDArray[np.int64]
    end: NDArray[np.int64]
    share: NDArray[np.float64]
    owner: NDArray[np.int64]

    def corners(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """(t, 3, 3) of the vertices x (n, 3) [m]."""
        return x[self.start] + self.share[:, :, None] * (x[self.end] - x[self.start])


def whole(triangles: NDArray[np.integer], owner: NDArray[np.int64]) -> Triangles:
    """Triangles (t, 3) between vertices."""
    rows = np.asarray(triangles, dtype=np.int64)
    return Triangles(rows, rows, np.zeros(rows.shape), owner)


def surface(model: Model, cut: Cut | None) -> Triangles:
    """The boundary of all bodies; with a cut, of what it leaves of them, counter-clockwise from outside at rest."""
    facets = model.facets
    outside = facets.outer < 0
    triangles, owner = facets.triangles[outside].astype(np.int64), facets.inner[outside]
    if cut is None:
        return whole(triangles, owner)
    height = np.empty(len(model.rest_positions))
    for body in model.bodies:
        along = model.rest_positions[body.vertices, cut.axis]
        low, high = float(along.min()), float(along.max())
        height[body.vertices] = along - (low + cut.place * (high - low))
    # A plane exactly through vertices would have sections of no area.
    height = np.where(np.abs(height) < 1e-9 * np.ptp(height), -1e-9 * np.ptp(height), height)
    parts = [*_clipped(triangles, owner, height), *_sections(model.tets.astype(np.int64), height)]
    start, end, owner = (np.concatenate(column) for column in zip(*parts, strict=True))
    share = np.where(start == end, 0.0, height[start] / np.where(start == end, 1.0, height[start] - height[end]))
    made = Triangles(start, end, share, owner)
    return _facing(made, model, cut.axis, sum(len(column[2]) for column in parts[:3]))


_Part = tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]


def _clipped(triangles: NDArray[np.int64], owner: NDArray[np.int64], height: NDArray[np.float64]) -> list[_Part]:
    """The parts of triangles below the plane, with one, two and three corners there."""
    below = height[triangles] < 0.0
    count = below.sum(axis=1)
    kept, own = triangles[count == 3], owner[count == 3]
    parts = [(kept, kept, own)]
    # One corner below, first in its row: a smaller triangle.
    a, b, c = _rolled(triangles[count == 1], below[count == 1]).T
    parts.append((np.stack([a, a, a], axis=1), np.stack([a, b, c], axis=1), owner[count == 1]))
    # One corner above, first in its row: two triangles.
    a, b, c = _rolled(triangles[count == 2], ~below[count == 2]).T
    start, end = np.stack([b, c, c, b, c, b], axis=1), np.stack([b, c, a, b, a, a], axis=1)
    parts.append((start.reshape(-1, 3), end.reshape(-1, 3), np.repeat(owner[count == 2], 2)))
    return parts


def _sections(tets: NDArray[np.int64], height: NDArray[np.float64]) -> list[_Part]:
    """The sections of tets: a triangle where one corner is alone on its side, two where two are on each."""
    below = height[tets] < 0.0
    count = below.sum(axis=1)
    parts = []
    for alone, chosen in ((below, count == 1), (~below, count == 3)):
        order = np.argsort(~alone[chosen], axis=1, kind="stable")
        a, b, c, d = np.take_along_axis(tets[chosen], order, axis=1).T
        parts.append((np.stack([a, a, a], axis=1), np.stack([b, c, d], axis=1), np.flatnonzero(chosen)))
    chosen = count == 2
    order = np.argsort(~below[chosen], axis=1, kind="stable")
    a, b, c, d = np.take_along_axis(tets[chosen], order, axis=1).T
    start, end = np.stack([a, a, b, a, b, b], axis=1), np.stack([c, d, d, c, d, c], axis=1)
    parts.append((start.reshape(-1, 3), end.reshape(-1, 3), np.repeat(np.flatnonzero(chosen), 2)))
    return parts


def _rolled(triangles: NDArray[np.int64], chosen: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Triangles (t, 3) with their chosen corner, one of each, first; the order around does not change."""
    first = np.argmax(chosen, axis=1)
    return np.take_along_axis(triangles, (first[:, None] + np.arange(3)) % 3, axis=1)


def _facing(made: Triangles, model: Model, axis: int, begin: int) -> Triangles:
    """The same, where the triangles from `begin` on face along an axis at rest."""
    a, b, c = made.corners(model.rest_positions).transpose(1, 0, 2)
    turned = np.cross(b - a, c - a)[:, axis] < 0.0
    turned[:begin] = False
    order = np.where(turned[:, None], [0, 2, 1], [0, 1, 2])
    start, end = (np.take_along_axis(column, order, axis=1) for column in (made.start, made.end))
    return Triangles(start, end, np.take_along_axis(made.share, order, axis=1), made.owner)
