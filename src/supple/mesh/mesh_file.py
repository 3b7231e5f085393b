"""A mesh file of either kind."""

from __future__ import annotations

from pathlib import Path

from supple.mesh.io.mesh_files import read_contents, surface_of, tet_file_of
from supple.mesh.origin import with_origin
from supple.mesh.surface import SurfaceMesh
from supple.mesh.tetmesh import TetMesh


def load_mesh(path: str | Path, *, keep_axes: bool = False) -> SurfaceMesh | TetMesh:
    """The tet mesh in a file where it has solid cells, otherwise its surface.

    Parameters
    ----------
    keep_axes : as of `SurfaceMesh.load`

    Raises
    ------
    MeshError : as of `SurfaceMesh.load` and `TetMesh.load`.
    """
    contents = read_contents(path, keep_axes=keep_axes)
    mesh = TetMesh.of_file(tet_file_of(contents)) if contents.has_solids else SurfaceMesh(*surface_of(contents))
    return with_origin(mesh, path)
