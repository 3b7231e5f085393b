"""A finger of chambers in a row, as a mesh of cells: a flat base, and between the chambers slots from above."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.mesh import shapes
from supple.mesh.tetmesh import TetMesh

# Cells of one chamber along the finger: two walls, two cells of air, and the slot to the next one.
_WALL, _AIR, _SLOT = (0, 3), (1, 2), 4
_HEIGHT, _WIDTH = 6, 4


def bellows(chambers: int, cell: float, finer: tuple[int, int, int] = (1, 1, 1)) -> TetMesh:
    """A finger along x from 0, with its base on y = 0; the air in the chambers is one void.

    Parameters
    ----------
    cell : thickness of the walls [m]; finer : into how many cells of the mesh this is divided along x, y and z
    """
    cells = np.array([5 * chambers - 1, _HEIGHT, _WIDTH])
    mesh = shapes.box(tuple(cells * cell), tuple(int(n) for n in cells * np.array(finer)))
    vertices = mesh.vertices + 0.5 * cells * cell
    i, j, k = np.floor(vertices[mesh.tets].mean(axis=1) / cell).astype(int).T
    tets = mesh.tets[_is_solid(i, j, k)]
    used, numbers = np.unique(tets, return_inverse=True)
    return TetMesh(vertices[used], numbers.reshape(-1, 4))


def _is_solid(i: NDArray[np.int_], j: NDArray[np.int_], k: NDArray[np.int_]) -> NDArray[np.bool_]:
    along, inside = i % 5, (k > 0) & (k < _WIDTH - 1)
    slot = (along == _SLOT) & (j > 2)
    chamber = np.isin(along, _AIR) & inside & (j > 0) & (j < _HEIGHT - 1)
    # The channel that joins the chambers begins and ends in the air of one.
    channel = (j == 1) & inside & (i > 0) & (i < i.max())
    return ~(slot | chamber | channel)
