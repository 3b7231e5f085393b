"""A box whose tets are mirror images across its middle planes, so that symmetric problems stay symmetric."""

from collections.abc import Sequence

import numpy as np

from supple.mesh import shapes
from supple.mesh.tetmesh import TetMesh


def mirrored_box(size: Sequence[float], cells: int) -> TetMesh:
    """A box of cells^3 cells of six tets; neighbouring cells are mirror images.

    Parameters
    ----------
    size : full edge lengths [m]; cells : even
    """
    eighth = shapes.box([edge / cells for edge in size], (1, 1, 1))
    points, tets = [], []
    for cell in np.ndindex(cells, cells, cells):
        sign = 1.0 - 2.0 * (np.array(cell) % 2)
        middle = (np.array(cell) + 0.5 - cells / 2) * np.array(size) / cells
        tets.append(eighth.tets + 8 * len(points))
        points.append(eighth.vertices * sign + middle)
    all_points = np.concatenate(points)
    places = np.rint(all_points / (np.array(size) / cells)).astype(np.int64)
    _, first, merged = np.unique(places, axis=0, return_index=True, return_inverse=True)
    return TetMesh(all_points[first], merged.reshape(-1)[np.concatenate(tets)])
