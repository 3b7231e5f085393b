"""Where each body is among the arrays of a whole scene, in which all vertices and tets follow each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.mesh.skin import Skin
from supple.scene.body import PlacedBody
from supple.scene.rigid.rigid_body import RigidBody


@dataclass(frozen=True, eq=False)
class BodyRows:
    """The rows of the arrays of all vertices and of all tets that belong to one body.

    Attributes
    ----------
    number : place among the bodies
    """

    body: PlacedBody
    number: int
    vertices: slice
    tets: slice

    @property
    def name(self) -> str:
        return self.body.name

    @property
    def rigid(self) -> bool:
        """Whether its vertices are the control points of a rigid body, whose surface is the skin."""
        return isinstance(self.body, RigidBody)

    @property
    def boundary(self) -> NDArray[np.int32]:
        """(t, 3) the boundary of its tets, counter-clockwise from outside, rows of its own vertices."""
        return self.body.mesh.surface.triangles

    def points(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Positions or velocities (k, 3) as a frame has them, of values x (n, 3) of the vertices of all bodies."""
        own, skin = x[self.vertices], self.skin if self.rigid else None
        return own if skin is None else skin.positions(own)

    @property
    def skin(self) -> Skin | None:
        """The surface that its vertices carry, or None."""
        return self.body.attached_skin

    @property
    def touching_skin(self) -> Skin | None:
        """The skin, where that is what touches other things."""
        return self.skin if self.body.touches_with_skin else None


def rows_of(bodies: Sequence[PlacedBody]) -> tuple[BodyRows, ...]:
    """Those of all bodies of a scene."""
    rows, n, m = [], 0, 0
    for number, body in enumerate(bodies):
        vertices, tets = n + len(body.mesh.vertices), m + len(body.mesh.tets)
        rows.append(BodyRows(body, number, slice(n, vertices), slice(m, tets)))
        n, m = vertices, tets
    return tuple(rows)
