"""What contact needs of earlier steps beside positions and velocities. It is stored in `State.memory`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class ContactMemory:
    """Arrays over the points of `ContactSurfaces`: the bodies' n_b points first, then those of obstacles.

    Attributes
    ----------
    triangles : (t, 3) the triangles of the bodies, which `entered` counts
    positions : (n, 3) of all points at the end of the step [m]
    depth : (2, n) how deep a point is inside a body, and inside an obstacle [m]
    entered : (n,) the triangle of its own piece that a point has passed through and is still behind; -1 for none
    excursions : (n,) largest distance that a point moved in a substep before contact stopped it [m]
    """

    triangles: NDArray[np.int32]
    positions: NDArray[np.float64]
    depth: NDArray[np.float64]
    entered: NDArray[np.int32]
    excursions: NDArray[np.float64]

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
