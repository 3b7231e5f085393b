"""The vertices and triangles of a shell, under the names of a tet mesh."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from supple.errors import MeshError
from supple.mesh.checked_arrays import frozen, place
from supple.mesh.surface import SurfaceMesh
from supple.mesh.tetmesh import TetMesh
from supple.mesh.topology import edge_keys, has_vertex_twice, is_used

# A triangle is flat where round-off of its corners moves it by its height, as `TetMesh` judges tets.
_FLAT = 64.0 * np.finfo(np.float64).eps


class ShellMesh(TetMesh):
    """A `TetMesh` without tets, whose `surface` is given.

    Parameters
    ----------
    surface : open or closed; at most two triangles at an edge, which run along it in opposite directions

    Raises
    ------
    MeshError : naming the vertex, triangle or edge at fault.
    """

    _arguments: ClassVar[dict[str, str]] = {"surface": "surface"}

    def __init__(self, surface: SurfaceMesh) -> None:
        _check(surface)
        none = frozen(np.zeros((0, 4), dtype=np.int32))
        given = {"vertices": surface.vertices, "tets": none, "nodes": none, "reoriented": 0, "_surface": surface}
        for key, value in given.items():
            object.__setattr__(self, key, value)

    @property
    def surface(self) -> SurfaceMesh:  # pyright: ignore[reportIncompatibleVariableOverride]
        return self.__dict__["_surface"]

    @property
    def edges(self) -> NDArray[np.int32]:  # pyright: ignore[reportIncompatibleVariableOverride]
        return self.surface.edges


def _check(surface: SurfaceMesh) -> None:
    x, triangles = surface.vertices, surface.triangles
    if not len(triangles):
        raise MeshError("its surface has no triangle")
    unused = np.flatnonzero(~is_used(triangles, len(x)))
    if len(unused):
        raise MeshError(f"vertex {unused[0]} at {place(x[unused[0]])} belongs to no triangle; give surface.compact()")
    a, b, c = x[triangles].transpose(1, 0, 2)
    sides = np.linalg.norm(np.stack([b - a, c - b, a - c]), axis=2).max(axis=0)
    reach = np.maximum(sides, np.abs(x[triangles]).max(axis=(1, 2)))
    flat = np.linalg.norm(np.cross(b - a, c - a), axis=1) <= _FLAT * sides * reach
    flat |= has_vertex_twice(triangles)
    if flat.any():
        t = int(np.flatnonzero(flat)[0])
        raise MeshError(f"triangle {t} at {place(x[triangles[t]].mean(axis=0))} has no area; remove it or remesh")
    keys = edge_keys(triangles, len(x)).ravel()
    edges, of_edge, counts = np.unique(keys, return_inverse=True, return_counts=True)
    forward = (triangles < np.roll(triangles, -1, axis=1)).ravel()
    runs = np.bincount(of_edge.ravel(), weights=np.where(forward, 1.0, -1.0))
    for wrong, text in (
        (counts > 2, "more than two triangles; cut the surface there, and join its parts with stitches"),
        (np.abs(runs) > 1.0, "two triangles that face different ways; turn one of them over (trimesh's fix_normals)"),
    ):
        if wrong.any():
            edge = int(edges[np.flatnonzero(wrong)[0]])
            i, j = divmod(edge, len(x))
            raise MeshError(f"the edge of vertices {i} and {j} at {place(0.5 * (x[i] + x[j]))} has {text}")
