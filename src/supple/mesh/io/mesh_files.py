"""Reading and writing surfaces and tet meshes as arrays: selects the format by the extension."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.errors import MeshError
from supple.mesh.checked_arrays import vertex_array
from supple.mesh.io import abaqus, obj, off, ply, stl, vtk_legacy, vtk_xml
from supple.mesh.io.cells import CellSoup, FormatError, MeshFile, tets_of
from supple.mesh.io.libraries.meshio import read_msh, write_msh
from supple.mesh.io.libraries.trimesh import read_glb
from supple.mesh.io.libraries.usd import USD_SUFFIXES, read_usd, write_usd
from supple.mesh.io.polygons import triangles_of
from supple.mesh.io.tetgen_family import SUFFIXES, family_paths, is_tetgen_path, read_tetgen_family
from supple.mesh.io.text import file_contents
from supple.mesh.merge import merge_map
from supple.mesh.topology import has_vertex_twice, repeats_another, without_unused
from supple.runtime.replacing import whole_files

logger = logging.getLogger(__name__)

SURFACE_READERS: dict[str, Callable[[bytes], CellSoup]] = {
    ".stl": stl.read,
    ".obj": obj.read,
    ".ply": ply.read,
    ".off": off.read,
    ".glb": read_glb,
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
TET_READERS: dict[str, Callable[[bytes], CellSoup | MeshFile]] = {
    ".msh": read_msh,
    ".vtu": vtk_xml.read,
    ".vtk": vtk_legacy.read,
    ".inp": abaqus.read,
    **dict.fromkeys(USD_SUFFIXES, read_usd),
}
TET_WRITERS = {".vtu": vtk_xml.written_cells, ".vtk": vtk_legacy.written_cells, ".inp": abaqus.written}
TET_EXTENSIONS = (*SUFFIXES, *TET_READERS)
# Two units in the last place of single precision, relative to the bounding box.
MERGE_TOLERANCE = 2e-7


def read_surface(path: str | Path) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Vertices (n, 3) and triangles (m, 3) of a surface file; see `SurfaceMesh.load`."""
    path = Path(path)
    extension = path.suffix.lower()
    if extension not in SURFACE_READERS:
        hint = "; a tet mesh is loaded with TetMesh.load" if extension in TET_EXTENSIONS else ""
        raise _unknown_extension(path, tuple(SURFACE_READERS), hint)
    data = file_contents(path)
    try:
        soup = SURFACE_READERS[extension](data)
        if len(soup.points) == 0:
            raise FormatError("it has no vertices")
        points = vertex_array(soup.points, str(path))
        triangles = triangles_of(soup)
    except FormatError as error:
        raise located(path, error) from None
    low, high = points.min(axis=0), points.max(axis=0)
    keep, index = merge_map(points, MERGE_TOLERANCE * float(np.linalg.norm(high - low)))
    triangles = index[triangles]
    collapsed = has_vertex_twice(triangles)
    if collapsed.all():
        raise MeshError(f"{path}: all {len(triangles)} triangles are degenerate; it has no surface")
    if len(keep) < len(points):
        logger.info("%s: %d vertices at the place of others were merged", path, len(points) - len(keep))
    if collapsed.any():
        logger.warning("%s: %d triangles that have a vertex twice were dropped", path, np.count_nonzero(collapsed))
    triangles = triangles[~collapsed]
    repeats = repeats_another(triangles, len(keep))
    if repeats.any():
        logger.warning("%s: %d triangles that are there twice were dropped once", path, np.count_nonzero(repeats))
    points, triangles = without_unused(points[keep], triangles[~repeats])
    if len(points) < len(keep):
        unused = len(keep) - len(points)
        logger.warning("%s: %d vertices that belong to no triangle were dropped", path, unused)
    return points, triangles


def write_surface(path: str | Path, vertices: NDArray[np.float64], triangles: NDArray[np.int32]) -> None:
    """Write a surface; see `SurfaceMesh.save`."""
    path = Path(path)
    writer = SURFACE_WRITERS.get(path.suffix.lower())
    if writer is None:
        raise _unknown_extension(path, tuple(SURFACE_WRITERS), "")
    _write_whole(path, lambda temporary: temporary.write_bytes(writer(vertices, triangles)))


class TetFile(NamedTuple):
    """Points (n, 3), tets (m, 4) or (m, 10), the file that lists them; by name, rows of points and of tets in sets."""

    points: NDArray[np.float64]
    tets: NDArray[np.integer]
    source: Path
    node_sets: Mapping[str, NDArray[np.int64]] = {}
    tet_sets: Mapping[str, NDArray[np.int64]] = {}


def read_tets(path: str | Path) -> TetFile:
    """What a file of tets contains; see `TetMesh.load`."""
    path = Path(path)
    extension = path.suffix.lower()
    if is_tetgen_path(path):
        family = read_tetgen_family(path)
        ele = family_paths(path)[".ele"]
        if family.order == 2:
            logger.warning("%s: ten-node tets: only their four corners are used; to keep them, convert it to .vtu", ele)
        return TetFile(family.points, family.tets, ele)
    if extension not in TET_EXTENSIONS:
        hint = "; a surface is loaded with SurfaceMesh.load" if extension in SURFACE_READERS else ""
        raise _unknown_extension(path, TET_EXTENSIONS, hint)
    data = file_contents(path)
    try:
        found = TET_READERS[extension](data)
        file = found if isinstance(found, MeshFile) else MeshFile(found)
        return TetFile(file.soup.points, tets_of(file.soup), path, file.node_sets, file.tet_sets)
    except FormatError as error:
        raise located(path, error) from None


def write_tets(path: str | Path, vertices: NDArray[np.float64], tets: NDArray[np.int32]) -> None:
    """Write tets (m, 4) or (m, 10) to a `.msh`, `.vtu`, `.vtk`, `.inp` or USD file; see `TetMesh.save`."""
    path = Path(path)
    extension = path.suffix.lower()
    if extension == ".msh" or extension in USD_SUFFIXES:
        write = write_msh if extension == ".msh" else write_usd
        try:
            _write_whole(path, lambda temporary: write(temporary, vertices, tets))
        except FormatError as error:
            raise located(path, error) from None
    elif extension in TET_READERS:
        data = TET_WRITERS[extension](vertices, tets)
        _write_whole(path, lambda temporary: temporary.write_bytes(data))
    else:
        raise _unknown_extension(path, TET_EXTENSIONS, "")


def _write_whole(path: Path, write: Callable[[Path], object]) -> None:
    with whole_files(path, error=MeshError) as fresh:
        write(fresh[path])


def _unknown_extension(path: Path, known: tuple[str, ...], hint: str) -> MeshError:
    listed = ", ".join(sorted(known))
    found = f"the extension '{path.suffix}' is not one of" if path.suffix else "it has no extension; use one of"
    return MeshError(f"{path}: {found} {listed}{hint}")


def located(path: Path, error: FormatError) -> MeshError:
    """The error with the file, and the line where it is known."""
    where = f"{path}:{error.line}" if error.line is not None else f"{path}"
    return MeshError(f"{where}: {error.reason}")
