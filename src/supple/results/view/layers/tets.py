"""Bodies as tets: colored by a field, exploded, or cut.

A mesh of the page has one color, so that the triangles are sorted into one mesh for each color.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.mesh.topology import TET_FACETS
from supple.results.view.fields import NOT_KNOWN_COLOR, Field, Limits, Range, bin_of, nodal_values, palette
from supple.results.view.layers.layer import Layer, single
from supple.results.view.layers.section import Cut, Triangles, surface, whole
from supple.results.view.look import drawn_as
from supple.results.view.model import Model, RenderFrame
from supple.results.view.picking import first_hit

_LEAST = 16  # smallest capacity of a mesh, in triangles


class ColoredTriangles:
    """Flat triangles in a few colors.

    Parameters
    ----------
    scene : of viser; name : of the meshes, which get a number each; colors : (c, 3) from 0 to 255
    """

    def __init__(self, scene: Any, name: str, colors: NDArray[np.uint8]) -> None:
        self.handles = [
            scene.add_mesh_simple(
                f"{name}/{i}",
                np.zeros((3 * _LEAST, 3), dtype=np.float32),
                _faces(_LEAST),
                color=tuple(int(c) for c in color),
                flat_shading=True,
                side="double",
                visible=False,
            )
            for i, color in enumerate(colors)
        ]
        self._capacity = [_LEAST] * len(self.handles)

    def update(self, corners: NDArray[np.float64], color: NDArray[np.int64]) -> None:
        """Draw triangles with these corners (t, 3, 3) [m], each in one of the colors (t,)."""
        order = np.argsort(color, kind="stable")
        ends = np.searchsorted(color[order], np.arange(len(self.handles) + 1))
        for i, handle in enumerate(self.handles):
            own_rows = corners[order[ends[i] : ends[i + 1]]]
            if len(own_rows) == 0:
                handle.visible = False
                continue
            # The capacity is a power of two: the browser creates new buffers only where it changes.
            capacity = max(_LEAST, 1 << (len(own_rows) - 1).bit_length())
            points = np.repeat(own_rows[:1, :1], 3 * capacity, axis=0).reshape(-1, 3)
            points[: 3 * len(own_rows)] = own_rows.reshape(-1, 3)
            handle.vertices = single(points)
            if capacity != self._capacity[i]:
                handle.faces = _faces(capacity)
                self._capacity[i] = capacity
            handle.visible = True


def _faces(count: int) -> NDArray[np.uint32]:
    return np.arange(3 * count, dtype=np.uint32).reshape(-1, 3)


class TetView(Layer):
    """Facets of tets.

    Parameters
    ----------
    field : for coloring, or None for the colors of the bodies; ends : of the color scale
    explode : displacement of the tets, as a share of their distance from the center of the body; 0 draws only the
        surface
    cut : a plane that hides what is behind it, or None

    Attributes
    ----------
    range : ends of the color scale; None without a field, or where no value is known
    values : of the tets (m,); None without a field
    """

    def __init__(
        self, scene: Any, frame: RenderFrame, field: Field | None, ends: Range, explode: float, cut: Cut | None
    ) -> None:
        model = frame.model
        self._field, self._explode = field, explode
        self._limits = Limits(field, ends) if field is not None else None
        self.range: tuple[float, float] | None = None
        colors = palette(field) if field is not None else np.array([drawn_as(body)[0] for body in model.bodies])
        self._drawn = ColoredTriangles(scene, "/bodies/tets", np.vstack([colors, [NOT_KNOWN_COLOR]]))
        self.nodes = self._drawn.handles
        self._triangles = exploded_facets(model) if explode > 0.0 else surface(model, cut)
        self._body = np.empty(len(model.tets), dtype=np.int64)
        for i, body in enumerate(model.bodies):
            self._body[body.tets] = i
        self.values: NDArray[np.float64] | None = None
        self.update(frame)

    def update(self, frame: RenderFrame) -> None:
        x = self._triangles.corners(frame.finite_positions)
        if self._explode > 0.0:
            x = x + self._offsets(frame)[self._triangles.owner][:, None]
        self._corners = x
        if self._field is None or self._limits is None:
            color = self._body[self._triangles.owner]
        else:
            self.values = self._field.values(frame)
            self.range = self._limits.follow(self.values)
            color = bin_of(self._of_triangles(frame, self.values), *(self.range or (0.0, 1.0)))
        self._drawn.update(x, color)

    def _of_triangles(self, frame: RenderFrame, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """(t,) the mean of the corners, between which values change smoothly; of tets apart from each other, their own
        values (m,)."""
        own = values[self._triangles.owner]
        if self._explode > 0.0:
            return own
        smooth = self._triangles.corners(nodal_values(frame, values)[:, None])[..., 0].mean(axis=1)
        return np.where(np.isfinite(own), smooth, own)

    def tet_on_ray(self, origin: ArrayLike, direction: ArrayLike) -> int | None:
        """The tet that a ray from `origin` (3,) in `direction` (3,) meets first, or None."""
        hit = first_hit(self._corners, origin, direction)
        return None if hit is None else int(self._triangles.owner[hit[0]])

    def _offsets(self, frame: RenderFrame) -> NDArray[np.float64]:
        """(m, 3) displacement of each tet from the center of its body [m]."""
        model = frame.model
        centers = frame.finite_positions[model.tets].mean(axis=1)
        offsets = np.empty_like(centers)
        for body in model.bodies:
            offsets[body.tets] = centers[body.tets] - centers[body.tets].mean(axis=0)
        return self._explode * offsets


def exploded_facets(model: Model) -> Triangles:
    """All facets of all tets."""
    return whole(model.tets[:, TET_FACETS].reshape(-1, 3), np.repeat(np.arange(len(model.tets)), 4))
