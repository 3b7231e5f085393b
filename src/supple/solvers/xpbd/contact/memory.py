"""What contact needs of earlier steps beside positions and velocities. It is stored in `State.memory`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.solvers.xpbd.contact.contact_rows import LoadedRows


@dataclass(frozen=True, eq=False)
class SurfaceMemory:
    """Arrays over the points of `ContactSurfaces`: the bodies' n_b points first, then those of obstacles.

    Attributes
    ----------
    triangles : (t, 3) the triangles of the bodies, which `entered` counts
    positions : (n, 3) of all points at the end of the step [m]
    depth : (2, n) how deep a point is inside a body, and inside an obstacle [m]
    entered : (n,) the triangle of its own piece that a point has passed through and is still behind; -1 for none
    excursions : (n,) largest distance that a point moved in a substep before contact stopped it [m]
    loaded : the contacts that hold a force
    """

    triangles: NDArray[np.int32]
    positions: NDArray[np.float64]
    depth: NDArray[np.float64]
    entered: NDArray[np.int32]
    excursions: NDArray[np.float64]
    loaded: LoadedRows

    def matching_points(self, triangles: NDArray[np.int32], positions: NDArray[np.float64], tolerance: float) -> int:
        """How many of a scene's points, counted from the first one, this memory describes: all, the bodies', or none.

        The memory may come from a scene with other obstacles, and positions may have been changed since.

        Parameters
        ----------
        triangles, positions : (t, 3) of the bodies, and (n, 3) of all points [m], of the scene that continues
        tolerance : largest change of a coordinate [m]
        """
        if not np.array_equal(self.triangles, triangles):
            return 0
        bodies = int(triangles.max(initial=-1)) + 1
        if len(positions) == len(self.positions) and (np.abs(positions - self.positions) <= tolerance).all():
            return len(positions)
        return bodies if (np.abs(positions[:bodies] - self.positions[:bodies]) <= tolerance).all() else 0


@dataclass(frozen=True, eq=False)
class ObstacleMemory:
    """The loads of vertices that simple shapes push.

    Attributes
    ----------
    frames, parameters : (k, 4, 3), (k, p) of the shapes at time 0; see `ObstacleShapes`
    positions : (n, 3) of all vertices at the end of the step [m]
    shapes, vertices : (c,) of each contact, in ascending order; loads : (c, 3) see `ObstacleContacts` [m/s^2]
    """

    frames: NDArray[np.float64]
    parameters: NDArray[np.float64]
    positions: NDArray[np.float64]
    shapes: NDArray[np.int64]
    vertices: NDArray[np.int32]
    loads: NDArray[np.float64]

    def matches(
        self,
        frames: NDArray[np.float64],
        parameters: NDArray[np.float64],
        positions: NDArray[np.float64],
        tolerance: float,
    ) -> bool:
        """Whether the shapes are the same and every vertex is where it was, up to `tolerance` [m]."""
        same = np.array_equal(self.frames, frames) and np.array_equal(self.parameters, parameters)
        placed = len(self.positions) == len(positions) and (np.abs(positions - self.positions) <= tolerance).all()
        return bool(same and placed)


@dataclass(frozen=True, eq=False)
class ContactMemory:
    """What the next step needs: of surfaces, and of simple shapes; None where there are none."""

    surfaces: SurfaceMemory | None
    obstacles: ObstacleMemory | None
