"""Contacts of points with half-spaces: one for each point near a plane, which stands for all of its area.

A plane is three of a solver's vertices, see `supple.contact.mesh.obstacles`. It touches as a triangle without an
outline: the closest point to x is its foot, a combination of the three with weights of any size.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from supple.contact.features.contacts import Contacts, put
from supple.contact.features.pair_geometry import VERTEX_PLANE
from supple.contact.features.vertex_contacts import foot_on_plane
from supple.contact.mesh.contact_mesh import ContactMesh
from supple.contact.mesh.obstacles import ObstacleRange
from supple.numerics.geometry.closest_points import area_normal
from supple.numerics.geometry.embedded_points import EmbeddedPoints
from supple.numerics.mat3 import dot, row, subtract
from supple.numerics.noninverting_step import noninverting_step
from supple.runtime.kernel_cache import njit

# A step keeps at least this share of every distance; the bound for triangles is conservative in the same way.
_KEEP = 0.1


class HalfSpaces:
    """All pairs of a surface point and a half-space that may touch.

    Attributes
    ----------
    points : the surface's s points, then three of each plane; owner : (s + 3 h,) of each
    tets : (k, 4) the three points of a plane and the point before it, of positive volume
    areas : (k,) of the points [m^2]; offsets : (k,) of the points, see `ContactMesh` [m]
    """

    def __init__(self, mesh: ContactMesh, obstacles: tuple[ObstacleRange, ...]) -> None:
        """Every surface point of a body with every half-space that the body may touch."""
        planes = [part for part in obstacles if part.is_plane]
        anchors = np.concatenate([np.zeros(0, dtype=np.int32), *(part.vertices for part in planes)])
        self.points = EmbeddedPoints.joined([mesh.points, EmbeddedPoints.at_vertices(anchors)])
        owners = np.array([mesh.body_count + part.index for part in planes], dtype=np.int32)
        self.owner = np.concatenate([mesh.owner, np.repeat(owners, 3)])
        tets = [np.zeros((0, 4), dtype=np.int32)]
        for k, owner in enumerate(owners):
            near = np.flatnonzero(mesh.collide[mesh.owner, owner])
            corners = len(mesh.points) + 3 * k + np.arange(3)
            tets.append(np.column_stack([np.tile(corners, (len(near), 1)), near]).astype(np.int32))
        self.tets = np.ascontiguousarray(np.concatenate(tets))
        self.areas, self.offsets = mesh.areas[self.tets[:, 3]], mesh.offsets[self.tets[:, 3]]
        self._all = np.ones(len(self.tets), dtype=np.bool_)

    def contacts(self, x: NDArray[np.float64], reach: float) -> tuple[Contacts, float]:
        """The pairs with gaps below `reach` [m] at points x (s + 3 h, 3), and the least of all gaps, or infinity.

        Distances and gaps are below zero behind a plane.
        """
        heights = np.empty(len(self.tets))
        _write_heights(x, self.tets, heights)
        gaps = heights - self.offsets
        near = np.flatnonzero(gaps < reach)
        out = Contacts.room(len(near))
        _write(x, self.tets[near], heights[near], out)
        out.weights[:], out.gaps[:] = self.areas[near], gaps[near]
        return out, float(gaps.min(initial=np.inf))

    def largest_step(self, x: NDArray[np.float64], way: NDArray[np.float64]) -> tuple[float, int]:
        """The largest step along `way` (s + 3 h, 3), at most 1, that keeps a tenth of every gap.

        Returns
        -------
        step, row : of the pair that allows no more, -1 where none exists; 0 where a point is not before its plane
        """
        if not len(self.tets):
            return 1.0, -1
        tets, thick = self.tets, np.flatnonzero(self.offsets)
        if len(thick):
            # Points with an offset are tested where their surface is: nearer to the plane by the offset.
            a, b, c = x[tets[thick, :3]].transpose(1, 0, 2)
            normals, points, tets = np.cross(b - a, c - a), tets[thick, 3], tets.copy()
            normals /= np.linalg.norm(normals, axis=1)[:, None]
            tets[thick, 3] = len(x) + np.arange(len(thick))
            x = np.concatenate([x, x[points] - self.offsets[thick, None] * normals])
            way = np.concatenate([way, way[points]])
        return noninverting_step(x, way, tets, self._all, _KEEP)


@njit(cache=True)
def _write_heights(x, tets, out):
    for k in range(len(tets)):
        a = row(x, tets[k, 0])
        n = area_normal(a, row(x, tets[k, 1]), row(x, tets[k, 2]))
        out[k] = dot(subtract(row(x, tets[k, 3]), a), n) / math.sqrt(dot(n, n))


@njit(cache=True)
def _write(x, tets, heights, out):
    for k in range(len(tets)):
        i, j, m, p = tets[k, 0], tets[k, 1], tets[k, 2], tets[k, 3]
        a, b, c = row(x, i), row(x, j), row(x, m)
        n, u = area_normal(a, b, c), foot_on_plane(row(x, p), a, b, c)
        h, length = heights[k], math.sqrt(dot(n, n))
        r = (h * n[0] / length, h * n[1] / length, h * n[2] / length)
        put(out, k, VERTEX_PLANE, (p, i, j, m), (1.0, -u[0], -u[1], -u[2]), r, 0.0)
        out.distances[k] = h  # below zero behind the plane
