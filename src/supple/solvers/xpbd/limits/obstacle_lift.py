"""Rigid displacements that take vertices out of simple shapes: obstacles that have no triangles."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.contact.mesh.obstacles import ObstaclePoses
from supple.model.system import System
from supple.scene.contact_pairs import pair_table

# How often all shapes are gone through: a displacement out of one may lead into another.
MOST_ROUNDS = 4


class ObstacleLift:
    """The simple shapes of a system, and which vertices they collide with.

    Parameters
    ----------
    skin : gap that is kept where it was at the beginning of a substep [m]
    """

    def __init__(self, system: System, skin: float) -> None:
        self._skin = skin
        self._poses = ObstaclePoses(system.obstacles)
        self._shapes = [k for k, obstacle in enumerate(system.obstacles) if obstacle.contact_mesh is None]
        collide = pair_table(system.scene).collide
        bodies = len(system.bodies)
        self._points = system.points
        self._collide = np.zeros((len(system.obstacles), len(system.points)), dtype=np.bool_)
        for number, part in enumerate(system.bodies):
            self._collide[:, np.unique(system.triangles[part.triangles])] = collide[bodies:, number][:, None]

    def displacement(
        self,
        x: NDArray[np.float64],
        x_prev: NDArray[np.float64],
        rows: NDArray[np.intp],
        times: tuple[float, float],
    ) -> NDArray[np.float64]:
        """What is to be added to vertices so that no point is deeper in a shape than at the beginning: (3,) [m].

        Parameters
        ----------
        x, x_prev : (n, 3) world positions of all vertices at the end and at the beginning of the substep [m]
        rows : (k,) the vertices that are moved; times : of the beginning and of the end [s]
        """
        moved_points = np.isin(self._points.vertices[self._points.start[:-1]], rows)
        x, x_prev = self._points.positions(x), self._points.positions(x_prev)
        d = np.zeros(3)
        for _ in range(MOST_ROUNDS):
            moved = False
            for k in self._shapes:
                mine = self._collide[k] & moved_points
                if not mine.any():
                    continue
                before, _ = self._gaps(k, x_prev[mine], times[0])
                now, normals = self._gaps(k, x[mine] + d, times[1])
                lack = np.minimum(before, self._skin) - now
                worst = int(np.argmax(lack))
                if lack[worst] > 0.0:
                    d, moved = d + lack[worst] * normals[worst], True
            if not moved:
                break
        return d

    def _gaps(self, k: int, x: NDArray[np.float64], time: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Signed distances (m,) from shape k at a time, and its normals there (m, 3)."""
        R, t = self._poses.at(time)
        gaps, normals = self._poses.obstacles[k].signed_distance((x - t[k]) @ R[k])
        return gaps, normals @ R[k].T
