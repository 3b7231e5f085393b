"""Whether a surface goes through itself, with exact arithmetic."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.contact.mesh.contact_mesh import ContactMesh
from supple.numerics.geometry.triangle_crossings import crossing_triangles
from supple.runtime.kernel_cache import ROWS
from supple.runtime.threads import threads_for


def intersects(mesh: ContactMesh, points: NDArray[np.float64]) -> bool:
    """Whether two triangles that may touch have a common point at `points` (s, 3).

    Common vertices do not count, and neither do seams of stitches, whose sides touch.
    """
    owner = mesh.owner[mesh.triangles[:, 0]]
    ignored = None if mesh.stitched is None else mesh.stitched.crossing
    with threads_for(len(mesh.triangles), ROWS):
        return len(crossing_triangles(points, mesh.triangles, owner, mesh.collide, 1, ignored)[0]) > 0
