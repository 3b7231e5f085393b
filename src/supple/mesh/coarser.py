"""A mesh of fewer tets for the same body, for simulations that must be fast."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.errors import MeshError
from supple.mesh.meshing.stuffing import as_large
from supple.mesh.primitives.isosurface_stuffing import MEAN_EDGE, stuff
from supple.mesh.skin import Embedding
from supple.mesh.tetmesh import TetMesh

_MOST_TRIES = 8
# A lattice of edges that differ by less often gives the same mesh.
_STEP = 0.93
# How far the surface of the body may be outside of the new tets, as a share of their mean edge, and how much the volume
# may change.
_FARTHEST, _LARGEST_CHANGE = 0.7, 0.15


def coarser(mesh: TetMesh, tets: int) -> TetMesh | None:
    """Well-shaped tets, at most this many, that fill about the same space; None where none have its shape.

    They have the same pieces and holes, about the same volume, and a surface near that of the mesh.

    Parameters
    ----------
    mesh : of linear tets; tets : the largest number of new ones
    """
    volume = float(mesh.volumes.sum())
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)

    def inside(points: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.where(Embedding.of(mesh, points).outside, 1.0, -1.0)

    # A tet of the lattice has a twelfth of the volume of its cell; those at the surface are smaller.
    edge = MEAN_EDGE * (12.0 * volume / tets) ** (1.0 / 3.0)
    edge = min(edge, 0.4 * float((high - low).max()))
    too_fine = 0.0  # the longest edge that gave too many tets
    for _ in range(_MOST_TRIES):
        if edge <= too_fine:
            return None
        try:
            made = as_large(stuff("coarser", inside, (low, high), edge), volume)
        except MeshError:  # no lattice point is inside
            edge *= _STEP
            continue
        if len(made.tets) > tets:
            too_fine = edge
            edge *= max((len(made.tets) / tets) ** (1.0 / 3.0), 1.0 / _STEP)
        elif _same_shape(mesh, made, edge):
            return made
        else:
            edge *= _STEP
    return None


def _same_shape(mesh: TetMesh, made: TetMesh, edge: float) -> bool:
    if abs(float(made.volumes.sum() / mesh.volumes.sum()) - 1.0) > _LARGEST_CHANGE or _topology(made) != _topology(
        mesh
    ):
        return False
    points = mesh.vertices[np.unique(mesh.surface.triangles)]
    held = Embedding.of(made, points)
    heights = 1.0 / np.linalg.norm(made.rest_shape_inverse, axis=2).max(axis=1)
    return float((-held.weights.min(axis=1) * heights[held.tets]).max()) < _FARTHEST * edge


def _topology(mesh: TetMesh) -> tuple[int, int]:
    """The number of pieces, and the Euler characteristic of the surface."""
    triangles = mesh.surface.triangles
    edges = np.unique(np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    return mesh.components.count, len(np.unique(triangles)) - len(edges) + len(triangles)
