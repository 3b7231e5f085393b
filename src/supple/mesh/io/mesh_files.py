"""Reading and writing surfaces and tet meshes: picks the format by the extension, and words the errors."""

from __future__ import annotations

import logging
from collections.abc import Callable
from pathlib import Path

import numpy as np

from supple.errors import MeshError
from supple.mesh.checked_arrays import vertex_array
from supple.mesh.io import msh, obj, off, ply, stl, vtk_legacy, vtk_xml
from supple.mesh.io.cells import CellSoup, FormatError, tets_of
from supple.mesh.io.polygons import triangles_of
from supple.mesh.merge import merge_map
from supple.mesh.surface import SurfaceMesh
from supple.mesh.tetmesh import TetMesh
from supple.replacing import whole_files

logger = logging.getLogger(__name__)

SURFACE_READERS: dict[str, Callable[[bytes], CellSoup]] = {
    ".stl": stl.read,
    ".obj": obj.read,
    ".ply": ply.read,
    ".off": off.read,
    ".vtp": vtk_xml.read,
    ".vtu": vtk_xml.read,
    ".vtk": vtk_legacy.read,
}
SURFACE_WRITERS = {
    ".stl": stl.written,
    ".obj": obj.written,
    ".ply": ply.written,
    ".off": off.written,
    ".vtp": vtk_xml.written_surface,
    ".vtu": vtk_xml.written_cells,
    ".vtk": vtk_legacy.written_surface,
}
TET_READERS: dict[str, Callable[[bytes], CellSoup]] = {
    ".msh": msh.read,
    ".vtu": vtk_xml.read,
    ".vtk": vtk_legacy.read,
}
TETGEN_EXTENSIONS = (".node", ".ele", ".edge", ".face")
TET_EXTENSIONS = (*TETGEN_EXTENSIONS, *TET_READERS)
# Two units in the last place of single precision, relative to the bounding box.
MERGE_TOLERANCE = 2e-7


def load_surface(path: str | Path) -> SurfaceMesh:
    """Read a surface; see `SurfaceMesh.load`."""
    path = Path(path)
    extension = path.suffix.lower()
    if extension not in SURFACE_READERS:
        hint = "; a tet mesh is loaded with TetMesh.load" if extension in TET_EXTENSIONS else ""
        raise _unknown_extension(path, tuple(SURFACE_READERS), hint)
    data = _contents(path)
    try:
        soup = SURFACE_READERS[extension](data)
        if len(soup.points) == 0:
            raise FormatError("it holds no vertices")
        points = vertex_array(soup.points, str(path))
        triangles = triangles_of(soup)
    except FormatError as error:
        raise _located(path, error) from None
    low, high = points.min(axis=0), points.max(axis=0)
    keep, index = merge_map(points, MERGE_TOLERANCE * float(np.linalg.norm(high - low)))
    triangles = index[triangles]
    a, b, c = triangles.T
    collapsed = (a == b) | (b == c) | (c == a)
    if collapsed.all():
        raise MeshError(f"{path}: all {len(triangles)} triangles are degenerate; it holds no surface")
    if len(keep) < len(points):
        logger.info("%s: %d vertices in the place of others were merged", path, len(points) - len(keep))
    if collapsed.any():
        logger.warning("%s: %d triangles with a vertex twice were dropped", path, np.count_nonzero(collapsed))
    try:
        surface = SurfaceMesh(points[keep], triangles[~collapsed])
    except MeshError as error:
        raise MeshError(_renamed(path, error, "SurfaceMesh")) from None
    unused = len(surface.vertices) - len(surface.used_vertices)
    if unused:
        logger.warning("%s: %d vertices that belong to no triangle were dropped", path, unused)
        surface = surface.compact()
    return surface


def save_surface(surface: SurfaceMesh, path: str | Path) -> None:
    """Write a surface; see `SurfaceMesh.save`."""
    path = Path(path)
    writer = SURFACE_WRITERS.get(path.suffix.lower())
    if writer is None:
        raise _unknown_extension(path, tuple(SURFACE_WRITERS), "")
    if surface.shares_vertices:
        surface = surface.compact()
    data = writer(surface.vertices, surface.triangles)
    _write_whole(path, lambda temporary: temporary.write_bytes(data))


def load_tetmesh(path: str | Path) -> TetMesh:
    """Read a tet mesh; see `TetMesh.load`."""
    path = Path(path)
    extension = path.suffix.lower()
    if extension in TETGEN_EXTENSIONS:
        from supple.mesh.io.tetgen_files import read_tetgen

        return read_tetgen(path)
    if extension not in TET_EXTENSIONS:
        hint = "; a surface is loaded with SurfaceMesh.load" if extension in SURFACE_READERS else ""
        raise _unknown_extension(path, TET_EXTENSIONS, hint)
    data = _contents(path)
    try:
        soup = TET_READERS[extension](data)
        tets = tets_of(soup)
        mesh = TetMesh.dropping_unused(soup.points, tets)
    except FormatError as error:
        raise _located(path, error) from None
    except MeshError as error:
        raise MeshError(_renamed(path, error, "TetMesh")) from None
    if mesh.turned:
        logger.info("%s: %d of %d tets had negative winding and were turned", path, mesh.turned, len(mesh.tets))
    return mesh


def save_tetmesh(mesh: TetMesh, path: str | Path) -> None:
    """Write a tet mesh; see `TetMesh.save`."""
    path = Path(path)
    extension = path.suffix.lower()
    if extension in TETGEN_EXTENSIONS:
        from supple.mesh.io.tetgen_files import write_tetgen

        write_tetgen(mesh, path)
    elif extension == ".msh":
        _write_whole(path, lambda temporary: msh.write(temporary, mesh.vertices, mesh.tets))
    elif extension in TET_EXTENSIONS:
        writer = vtk_xml.written_cells if extension == ".vtu" else vtk_legacy.written_cells
        data = writer(mesh.vertices, mesh.tets)
        _write_whole(path, lambda temporary: temporary.write_bytes(data))
    else:
        raise _unknown_extension(path, TET_EXTENSIONS, "")


def _contents(path: Path) -> bytes:
    """All bytes of an ordinary, non-empty file."""
    if path.is_dir():
        raise MeshError(f"{path}: it is a folder; give the path of a mesh file")
    if not path.exists():
        raise MeshError(f"{path}: there is no such file")
    if not path.is_file():
        raise MeshError(f"{path}: it is not an ordinary file")
    try:
        data = path.read_bytes()
    except OSError as error:
        raise MeshError(f"{path}: it cannot be read: {error.strerror or error}") from None
    except MemoryError:
        raise MeshError(f"{path}: it is too large for the memory of this machine") from None
    if not data.strip():
        raise MeshError(f"{path}: it is empty")
    return data


def _write_whole(path: Path, write: Callable[[Path], object]) -> None:
    with whole_files(path, error=MeshError) as fresh:
        write(fresh[path])


def _unknown_extension(path: Path, known: tuple[str, ...], hint: str) -> MeshError:
    listed = ", ".join(sorted(known))
    shown = f"the extension '{path.suffix}' is not one of" if path.suffix else "it has no extension; use one of"
    return MeshError(f"{path}: {shown} {listed}{hint}")


def _located(path: Path, error: FormatError) -> MeshError:
    where = f"{path}:{error.line}" if error.line is not None else f"{path}"
    return MeshError(f"{where}: {error.reason}")


def _renamed(path: Path, error: MeshError, owner: str) -> str:
    return f"{path}: " + str(error).removeprefix(f"{owner}: ")
