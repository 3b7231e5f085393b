"""What a stitch sees of the two things that it joins: a body, or a triangle obstacle, where it is at time 0."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.errors import SceneError
from supple.mesh.surface import SurfaceMesh
from supple.scene.body import Body
from supple.scene.obstacles.obstacle import Obstacle


@dataclass(frozen=True, eq=False)
class Side:
    """One of the two.

    Attributes
    ----------
    label : how messages call it
    points : (n, 3) all its vertices in the world [m]
    triangles : (t, 3) of its surface; edges : (e, 2) of its surface, sorted; surface_vertices : (s,)
    """

    label: str
    points: NDArray[np.float64]
    triangles: NDArray[np.int32]
    edges: NDArray[np.int32]
    surface_vertices: NDArray[np.int32]


def side_of(thing: Body | Obstacle) -> Side:
    """A body as the scene places it, or a triangle obstacle at time 0.

    Raises
    ------
    SceneError : for other obstacles.
    """
    if isinstance(thing, Body):
        return _side(f"body {thing.name!r}", thing.mesh.surface, thing.place(thing.mesh.vertices))
    surface = thing.surface_mesh
    if surface is None:
        raise SceneError(f"{thing.label} is a {type(thing).__name__}; stitches hold on to bodies and TriangleObstacles")
    R, t = thing.pose(0.0)
    return _side(thing.label, surface, surface.vertices @ R.T + t)


def _side(label: str, surface: SurfaceMesh, points: NDArray[np.float64]) -> Side:
    return Side(label, points, surface.triangles, surface.edges, surface.used_vertices)
