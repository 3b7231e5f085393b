"""Points at which surfaces are close to each other, computed from the state, for any solver."""

from __future__ import annotations

from importlib.util import find_spec

import numpy as np
from numpy.typing import NDArray

from supple.system import System
from supple.viewer.engine.scene.obstacle_distance import signed_distance
from supple.viewer.protocol import limits

# Largest distance of a contact point, as a share of the mean edge length of the surfaces.
NEAR = 0.1


def contact_points(system: System, positions: NDArray[np.float64], time: float) -> NDArray[np.float64]:
    """(c, 3) points [m] where surfaces are closer than NEAR mean edges; at most `MOST_CONTACT_POINTS`.

    On half-spaces, boxes and spheres these are vertices of bodies. Between bodies, and on triangle obstacles, they are
    the middles of the pairs of vertices, edges and triangles that IPC finds.
    """
    near = NEAR * _mean_edge(system)
    skin = np.unique(system.triangles)
    points = [_between_surfaces(system, positions, time, near)]
    for obstacle in system.obstacles:
        if obstacle.surface_mesh is None:
            points.append(positions[skin][signed_distance(obstacle, positions[skin], time)[0] < near])
    found = np.concatenate([np.zeros((0, 3)), *points])
    stride = -(-len(found) // limits.MOST_CONTACT_POINTS)
    return np.ascontiguousarray(found[:: max(stride, 1)])


def _mean_edge(system: System) -> float:
    a, b = system.rest_positions[system.triangles[:, :2]].transpose(1, 0, 2)
    return float(np.linalg.norm(a - b, axis=1).mean())


def _between_surfaces(system: System, positions: NDArray[np.float64], time: float, near: float) -> NDArray[np.float64]:
    if find_spec("ipctk") is None:  # it has no wheels for Linux on ARM
        return np.zeros((0, 3))
    import ipctk

    vertices, triangles = [positions], [system.triangles]
    count = len(positions)
    for obstacle in system.obstacles:
        mesh = obstacle.surface_mesh
        if mesh is not None:
            R, t = obstacle.pose(time)
            vertices.append(mesh.vertices @ R.T + t)
            triangles.append(mesh.triangles + count)
            count += len(mesh.vertices)
    F = np.concatenate(triangles).astype(np.int32)
    used, compact = np.unique(F, return_inverse=True)
    X = np.asfortranarray(np.concatenate(vertices)[used])
    F = np.asfortranarray(compact.reshape(F.shape), dtype=np.int32)
    E = ipctk.edges(F)
    found = ipctk.NormalCollisions()
    found.build(ipctk.CollisionMesh(X, E, F), X, near)
    middles = [X[[i for i in found[k].vertex_ids(E, F) if i >= 0]].mean(axis=0) for k in range(len(found))]
    return np.array(middles).reshape(-1, 3)
