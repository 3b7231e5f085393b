"""The two things that a stitch joins, each a body, soft or rigid, or a triangle obstacle, where they are at time 0."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.errors import SceneError
from supple.scene.body import PlacedBody
from supple.scene.obstacles.obstacle import Obstacle
from supple.scene.rigid.rigid_body import RigidBody


@dataclass(frozen=True, eq=False)
class Side:
    """One of the two things.

    Attributes
    ----------
    label : its name in messages
    points : (n, 3) of all its vertices, of a rigid body those of its surface, in world coordinates [m]
    triangles : (t, 3) of its surface; edges : (e, 2) of its surface, sorted; surface_vertices : (s,)
    """

    label: str
    points: NDArray[np.float64]
    triangles: NDArray[np.int32]
    edges: NDArray[np.int32]
    surface_vertices: NDArray[np.int32]

    def vertex_normals(self) -> NDArray[np.float64]:
        """(n, 3) outward unit normals: area-weighted means of the triangles around each vertex; zero inside."""
        a, b, c = self.points[self.triangles].transpose(1, 0, 2)
        doubled = np.repeat(np.cross(b - a, c - a), 3, axis=0)
        out = np.zeros_like(self.points)
        np.add.at(out, self.triangles.ravel(), doubled)
        lengths = np.linalg.norm(out, axis=1)
        return out / np.where(lengths > 0.0, lengths, 1.0)[:, None]

    def mean_edges(self) -> NDArray[np.float64]:
        """(n,) mean length of the surface's edges at each vertex [m]; infinite inside."""
        ends = self.edges.ravel()
        lengths = np.linalg.norm(self.points[self.edges[:, 0]] - self.points[self.edges[:, 1]], axis=1)
        counts = np.bincount(ends, minlength=len(self.points))
        sums = np.bincount(ends, weights=np.repeat(lengths, 2), minlength=len(self.points))
        return np.where(counts > 0, sums, np.inf) / np.maximum(counts, 1)


def side_of(thing: PlacedBody | Obstacle, stitch: str) -> Side:
    """A body as the scene places it, or a triangle obstacle at time 0; `stitch` begins the message.

    Raises
    ------
    SceneError : for other obstacles.
    """
    if isinstance(thing, RigidBody):
        label, surface, points = thing.label, thing.surface, thing.place(thing.points)
    elif isinstance(thing, PlacedBody):
        label, surface, points = f"body {thing.name!r}", thing.mesh.surface, thing.place(thing.mesh.vertices)
    elif thing.surface_mesh is not None:
        R, t = thing.pose(0.0)
        label, surface, points = thing.label, thing.surface_mesh, thing.surface_mesh.vertices @ R.T + t
    else:
        kind = type(thing).__name__
        raise SceneError(f"{stitch}: {thing.label} is a {kind}; stitches join bodies and TriangleObstacles")
    return Side(label, points, surface.triangles, surface.edges, surface.used_vertices)
