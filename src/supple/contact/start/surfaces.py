"""The surfaces of a scene at its start as one list of triangles."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from supple.contact.mesh.contact_mesh import joined_surfaces
from supple.contact.mesh.obstacles import placed_with_obstacles, with_obstacles
from supple.mesh.closed_surfaces import is_closed
from supple.mesh.topology import connected_components
from supple.model.system import System


@dataclass(frozen=True, eq=False)
class StartSurfaces:
    """Surfaces as the implicit solver uses them: spheres consist of triangles. Things: bodies, then obstacles.

    Attributes
    ----------
    points : (p, 3) [m], the system's points first; triangles : (t, 3), the system's first
    owner : (t,) the thing of each triangle; first_row : (p,) the row of each thing's first triangle
    pieces : (s, 2) for each connected part of a surface its thing and one of its vertices
    planes : half-spaces, as (thing, point (3,), normal (3,))
    rooms : obstacles that contain bodies; solid : (p,) whether a thing has an inside where nothing may be
    """

    points: NDArray[np.float64]
    triangles: NDArray[np.int32]
    owner: NDArray[np.int32]
    first_row: NDArray[np.int64]
    pieces: NDArray[np.int64]
    planes: tuple[tuple[int, NDArray[np.float64], NDArray[np.float64]], ...]
    rooms: tuple[int, ...]
    solid: NDArray[np.bool_]

    def of(self, thing: int) -> NDArray[np.int32]:
        """Triangles (k, 3) of one thing."""
        return self.triangles[self.owner == thing]

    def pair(self, a: int, b: int) -> StartSurfaces:
        """The surfaces of two things alone; rows of triangles are their own."""
        rows = np.isin(self.owner, (a, b))
        owner = self.owner[rows]
        return replace(
            self,
            triangles=self.triangles[rows],
            owner=owner,
            first_row=np.searchsorted(owner, np.arange(len(self.solid))),
            pieces=self.pieces[np.isin(self.pieces[:, 0], (a, b))],
            planes=tuple(plane for plane in self.planes if plane[0] in (a, b)),
            rooms=tuple(room for room in self.rooms if room in (a, b)),
        )


def start_surfaces(system: System, positions: NDArray[np.float64], time: float) -> StartSurfaces:
    """Collect the surfaces of a system at positions (n, 3) [m] and a time [s]. Rows beyond the bodies' are not used."""
    bodies, (extended, ranges) = len(system.bodies), with_obstacles(system)
    count = bodies + len(system.obstacles)
    x = placed_with_obstacles(extended, ranges, np.asarray(positions, dtype=np.float64), time)
    planes, rooms, solid = [], [], np.ones(count, dtype=np.bool_)
    solid[:bodies] = [part.body.offset == 0.0 for part in system.bodies]
    for part in ranges:
        thing, corners = bodies + part.index, x[part.vertices]
        if part.is_plane:
            normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
            planes.append((thing, corners[0], normal / np.linalg.norm(normal)))
            continue
        if part.obstacle.is_container:
            rooms.append(thing)
            solid[thing] = False
        solid[thing] &= is_closed(part.triangles)
    points, triangles, owner = joined_surfaces(extended, ranges)
    owner = owner[triangles[:, 0]]
    first_row, pieces = np.searchsorted(owner, np.arange(count)), _pieces(triangles, owner, len(points))
    return StartSurfaces(points.positions(x), triangles, owner, first_row, pieces, tuple(planes), tuple(rooms), solid)


def _pieces(triangles: NDArray[np.int32], owner: NDArray[np.int32], n: int) -> NDArray[np.int64]:
    labels = connected_components(triangles, n).labels
    _, rows = np.unique(labels, return_index=True)
    rows = np.sort(rows)
    return np.column_stack([owner[rows], triangles[rows, 0]]).astype(np.int64)
