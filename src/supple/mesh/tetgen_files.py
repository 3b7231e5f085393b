"""Tet meshes from and to TetGen's own files; `tetgen_family` has the layout of these files."""

from __future__ import annotations

from pathlib import Path

from supple.mesh.io.tetgen_family import family_paths, is_tetgen_path, write_tetgen_family
from supple.mesh.tetmesh import TetMesh


def read_tetgen(path: str | Path) -> TetMesh:
    """The tet mesh of a TetGen family, from the name of any one of its files or of the family ("bear.1").

    `.node` and `.ele` must exist. `.edge` and `.face` are checked where they exist, and derived from the tets
    otherwise. Vertices that no tet uses (for example the middle nodes of ten-node tets) are dropped, and negative tets
    are turned.

    Parameters
    ----------
    path : one of the files, such as bear.1.node, or the name of the family.

    Raises
    ------
    MeshError : `file:line: reason`, or the name of the file that is missing.
    """
    return TetMesh.load(path if is_tetgen_path(path) else family_paths(path)[".ele"])


def write_tetgen(mesh: TetMesh, path: str | Path, base_index: int = 1) -> dict[str, Path]:
    """Write `.node`, `.ele`, `.edge` (all edges) and `.face` (the boundary, counter-clockwise from outside).

    Vertices and edges of the boundary have the marker 1, others 0. Coordinates are written with every digit, so that
    they read back bit for bit.

    Parameters
    ----------
    mesh : what is written
    path : the name of one of the four files, or of the family ("bear.1")
    base_index : 1 (TetGen's default) or 0

    Returns
    -------
    dict : the four paths by suffix

    Raises
    ------
    MeshError : where a file cannot be written. Then none of the four is new, and existing files are unchanged.
    """
    return write_tetgen_family(path, mesh.vertices, mesh.tets, mesh.edges, mesh.surface.triangles, base_index)
