"""Which surfaces have an inside."""

from __future__ import annotations

import numpy as np

from supple.errors import SceneError
from supple.mesh.surface import SurfaceMesh
from supple.mesh.topology import edge_keys


def require_closed(surface: SurfaceMesh, owner: str) -> None:
    """Check that every edge has as many triangles on one side as on the other.

    Raises
    ------
    SceneError : where one has not; the text begins with `owner`.
    """
    keys = edge_keys(surface.triangles, len(surface.vertices)).ravel()
    starts, ends = surface.triangles.ravel(), surface.triangles[:, [1, 2, 0]].ravel()
    signs = np.where(starts < ends, 1, -1)
    order = np.argsort(keys, kind="stable")
    first = np.flatnonzero(np.concatenate([[True], np.diff(keys[order]) != 0]))
    unbalanced = np.add.reduceat(signs[order], first) != 0
    if unbalanced.any():
        count = int(np.count_nonzero(unbalanced))
        raise SceneError(
            f"{owner}: its surface is not closed, or its triangles do not all face the same way ({count} "
            f"{'edge' if count == 1 else 'edges'}); repair it with sp.repair_surface, or give a TetMesh"
        )
