"""Keeps drawn skins out of obstacles.

A solver keeps the tets of a body out of an obstacle. Its skin reaches beyond them where the tets are coarse, and would
pass through a floor or the wall of a bowl on which the body lies. Pictures move these points, and only these, onto the
obstacle: a point within the tets is drawn where it is, so that a penetration of the simulation stays visible.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from supple.mesh.skin import Skin
from supple.scene.obstacles.obstacle import Obstacle


def beyond_tets(skin: Skin, rest: NDArray[np.float64]) -> tuple[NDArray[np.bool_], float]:
    """Which vertices (k,) of a skin are outside of the tets that carry them, and how far at most it reaches there [m].

    Parameters
    ----------
    rest : (n, 3) positions of the body at rest [m]
    """
    within = np.maximum(skin.weights[:, :4], 0.0)
    outside = within.sum(axis=1) > 1.0 + 1e-6
    within = within[outside] / within[outside].sum(axis=1)[:, None]
    nearest = np.einsum("kw,kwi->ki", within, rest[skin.corners[outside, :4]])
    return outside, float(np.linalg.norm(skin.positions(rest)[outside] - nearest, axis=1).max(initial=0.0))


def kept_out(
    x: NDArray[np.float64],
    outside: NDArray[np.int64],
    reach: float,
    obstacles: Sequence[Obstacle],
    poses: NDArray[np.float64],
    gap: float,
) -> NDArray[np.float64]:
    """Points (k, 3), of which the rows `outside` are moved out of obstacles at `poses`, by at most `reach` [m].

    Obstacles of triangles are left out: whether a point is in one is not a question of the nearest triangle alone.

    Parameters
    ----------
    gap : distance from obstacles to which they are moved [m]
    """
    if not len(outside):
        return x
    for obstacle, pose in zip(obstacles, poses, strict=False):
        if obstacle.checked_by_triangles:
            continue
        distances, normals = obstacle.signed_distance((x[outside] - pose[:, 3]) @ pose[:, :3])
        missing = gap - distances
        moved = (missing > 0.0) & (missing < reach)
        x[outside[moved]] += (missing[moved, None] * normals[moved]) @ pose[:, :3].T
    return x


_PLACES = 32  # along each axis of a grid: a round wall of radius r is off by (2 r / 32)^2 / (4 r) = r / 1000 at most


def distance_grid(
    obstacle: Obstacle, low: NDArray[np.float64], high: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The signed distance from an obstacle in the box from `low` to `high` (3,), in its own coordinates [m].

    It is linear between the places of a grid; the distance from a plane is that anyway.

    Returns
    -------
    The step (3,) along each axis [m], and the distances (n, n, n) at `low + step * (i, j, k)` [m].
    """
    n = 2 if obstacle.plane is not None else _PLACES
    step = (high - low) / (n - 1)
    places = low + step * np.stack(np.meshgrid(*[np.arange(n)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    return step, obstacle.signed_distance(places)[0].reshape(n, n, n)
