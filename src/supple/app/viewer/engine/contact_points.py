"""Points at which surfaces are close to each other, computed from the state, for any solver."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.app.viewer.engine.scene.obstacle_distance import signed_distance
from supple.app.viewer.protocol import limits
from supple.contact.mesh.distances import middles_of_edges, middles_of_points, touching_pairs
from supple.mesh.topology import unique_edges
from supple.model.system import System
from supple.scene.contact_pairs import pair_table

# Largest distance of a contact point, as a share of the mean edge length of the surfaces.
NEAR = 0.1


def contact_points(system: System, positions: NDArray[np.float64], time: float) -> NDArray[np.float64]:
    """(c, 3) points [m] where surfaces are closer than NEAR mean edges; at most `MOST_CONTACT_POINTS`.

    On half-spaces, boxes and spheres these are vertices of bodies. Between bodies, and on triangle obstacles, they are
    the middles between vertices and triangles, and between edges, that are near each other.
    """
    near = NEAR * _mean_edge(system)
    skin = np.unique(system.triangles)
    positions = system.points.positions(positions)
    points = [_between_surfaces(system, positions, time, near)]
    for obstacle in system.obstacles:
        if obstacle.surface_mesh is None:
            points.append(positions[skin][signed_distance(obstacle, positions[skin], time)[0] < near])
    found = np.concatenate([np.zeros((0, 3)), *points])
    stride = -(-len(found) // limits.MOST_CONTACT_POINTS)
    return np.ascontiguousarray(found[:: max(stride, 1)])


def _mean_edge(system: System) -> float:
    a, b = system.rest_points[system.triangles[:, :2]].transpose(1, 0, 2)
    return float(np.linalg.norm(a - b, axis=1).mean())


def _between_surfaces(system: System, positions: NDArray[np.float64], time: float, near: float) -> NDArray[np.float64]:
    """(c, 3) middles of the pairs of things that may touch and are nearer than `near` [m]; of points (p, 3)."""
    points, triangles, owner = [positions], [system.triangles], [_body_of_points(system)]
    count = len(positions)
    for k, obstacle in enumerate(system.obstacles):
        mesh = obstacle.surface_mesh
        if mesh is not None:
            R, t = obstacle.pose(time)
            points.append(mesh.vertices @ R.T + t)
            triangles.append(mesh.triangles + count)
            owner.append(np.full(len(mesh.vertices), len(system.bodies) + k, dtype=np.int32))
            count += len(mesh.vertices)
    numbered = np.concatenate(triangles)
    used, compact = np.unique(numbered, return_inverse=True)
    faces = np.ascontiguousarray(compact.reshape(numbered.shape), dtype=np.int32)
    edges = unique_edges(faces, len(used))
    x = np.concatenate(points)[used]
    collide = pair_table(system.scene).collide
    of_points, of_edges = touching_pairs(x, faces, edges, np.concatenate(owner)[used], collide, near)
    return np.concatenate([middles_of_points(x, faces, of_points), middles_of_edges(x, edges, of_edges)])


def _body_of_points(system: System) -> NDArray[np.int32]:
    """(p,) the number of each point's body."""
    owner = np.empty(len(system.points), dtype=np.int32)
    for k, part in enumerate(system.bodies):
        owner[part.points] = k
    return owner
