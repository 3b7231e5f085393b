"""Bodies as tets: colored by a field, pulled apart, or cut."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.mesh.topology import TET_FACETS
from supple.viewer.drawing.coloring.color_scale import NOT_KNOWN_COLOR, Limits, bin_of, palette
from supple.viewer.drawing.coloring.fields import Field
from supple.viewer.drawing.layers.primitives.layer import Layer
from supple.viewer.drawing.layers.primitives.triangles import ColoredTriangles
from supple.viewer.drawing.moments.model import Model, Moment


@dataclass(frozen=True)
class Cut:
    """A plane that hides the tets behind it at rest.

    Attributes
    ----------
    axis : 0, 1 or 2; place : from 0 (all tets are hidden) to 1 (none is hidden), as a share of the extent of each body
    """

    axis: int
    place: float


class TetView(Layer):
    """Facets of tets.

    Parameters
    ----------
    field : for coloring, or None for the colors of the bodies
    explode : displacement of the tets, as a share of their distance from the center of the body; 0 draws only the
        surface
    cut : a plane that hides tets, or None
    """

    def __init__(self, scene: Any, moment: Moment, field: Field | None, explode: float, cut: Cut | None) -> None:
        model = moment.model
        self._field, self._explode = field, explode
        self._limits = Limits(field) if field is not None else None
        self.range: tuple[float, float] | None = None
        colors = palette(field) if field is not None else np.array([body.color for body in model.bodies])
        self._triangles = ColoredTriangles(scene, "/bodies/tets", np.vstack([colors, [NOT_KNOWN_COLOR]]))
        self.nodes = self._triangles.handles
        kept = kept_tets(model, cut)
        self._corners, self._owner = exploded_facets(model, kept) if explode > 0.0 else outer_facets(model, kept)
        self._body = np.empty(len(model.tets), dtype=np.int64)
        for i, body in enumerate(model.bodies):
            self._body[body.tets] = i
        self.update(moment)

    def update(self, moment: Moment) -> None:
        x = moment.finite_positions[self._corners]
        if self._explode > 0.0:
            x = x + self._offsets(moment)[self._owner][:, None]
        if self._field is None or self._limits is None:
            color = self._body
        else:
            values = self._field.values(moment)
            self.range = self._limits.follow(values)
            color = bin_of(values, *self.range)
        self._triangles.update(x, color[self._owner])

    def _offsets(self, moment: Moment) -> NDArray[np.float64]:
        """(m, 3) displacement of each tet from the center of its body [m]."""
        model = moment.model
        centers = moment.finite_positions[model.tets].mean(axis=1)
        offsets = np.empty_like(centers)
        for body in model.bodies:
            offsets[body.tets] = centers[body.tets] - centers[body.tets].mean(axis=0)
        return self._explode * offsets


def kept_tets(model: Model, cut: Cut | None) -> NDArray[np.bool_]:
    """(m,) the tets that a cut does not hide; at least one of each body."""
    kept = np.ones(len(model.tets), dtype=bool)
    if cut is not None:
        for body in model.bodies:
            along = model.rest_centers[body.tets, cut.axis]
            low, high = float(along.min()), float(along.max())
            kept[body.tets] = along <= low + cut.place * (high - low) * (1.0 + 1e-9)
    return kept


def outer_facets(model: Model, kept: NDArray[np.bool_]) -> tuple[NDArray[np.int32], NDArray[np.int64]]:
    """Facets (f, 3) with a kept tet on one side only, counter-clockwise from outside, and this tet (f,)."""
    facets = model.facets
    inner = kept[facets.inner]
    outer = np.where(facets.outer >= 0, kept[facets.outer], False)
    mine, turned = inner & ~outer, outer & ~inner
    triangles = np.concatenate([facets.triangles[mine], facets.triangles[turned][:, ::-1]])
    return triangles, np.concatenate([facets.inner[mine], facets.outer[turned]])


def exploded_facets(model: Model, kept: NDArray[np.bool_]) -> tuple[NDArray[np.int32], NDArray[np.int64]]:
    """All facets (f, 3) of the kept tets, and their tets (f,)."""
    rows = np.flatnonzero(kept)
    return model.tets[rows][:, TET_FACETS].reshape(-1, 3), np.repeat(rows, 4)
