"""Reading and writing surfaces and tet meshes as arrays: selects the format by the extension."""

from __future__ import annotations

import logging
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.errors import MeshError
from supple.mesh.checked_arrays import vertex_array
from supple.mesh.io import obj, off, ply, stl, vtk_legacy, vtk_xml
from supple.mesh.io.abaqus.assembly import read as read_inp
from supple.mesh.io.abaqus.blocks import written as written_inp
from supple.mesh.io.cells import TETRA, CellSoup, FormatError, MeshFile, checked, dimensions
from supple.mesh.io.libraries.meshio import read_medit, read_msh, write_msh
from supple.mesh.io.libraries.trimesh import read_3mf, read_dae, read_glb, read_gltf
from supple.mesh.io.libraries.usd import USD_SUFFIXES, read_usd, write_usd
from supple.mesh.io.polygons import triangles_of
from supple.mesh.io.splitting import tets_of
from supple.mesh.io.tetgen_family import SUFFIXES, family_paths, is_tetgen_path, read_tetgen_family
from supple.mesh.io.text import file_contents, without_mark
from supple.mesh.topology import has_vertex_twice, merge_map, repeats_another, without_unused
from supple.runtime.replacing import whole_files

logger = logging.getLogger(__name__)

# Formats of surfaces alone, and those of which a file may hold a surface, solids, or both.
SURFACE_READERS: dict[str, Callable[..., CellSoup | MeshFile]] = {
    ".stl": stl.read,
    ".obj": obj.read,
    ".ply": ply.read,
    ".off": off.read,
    ".glb": read_glb,
    ".gltf": read_gltf,
    ".dae": read_dae,
    ".3mf": read_3mf,
    ".vtp": vtk_xml.read,
}
READERS: dict[str, Callable[..., CellSoup | MeshFile]] = {
    **SURFACE_READERS,
    ".msh": read_msh,
    ".vtu": vtk_xml.read,
    ".vtk": vtk_legacy.read,
    ".inp": read_inp,
    ".mesh": read_medit,
    **dict.fromkeys(USD_SUFFIXES, read_usd),
}
# Those that may name further files also need their path.
_WITH_FILES = (read_inp, read_gltf)
SURFACE_WRITERS = {
    ".stl": stl.written,
    ".obj": obj.written,
    ".ply": ply.written,
    ".off": off.written,
    ".vtp": vtk_xml.written_surface,
    ".vtu": vtk_xml.written_cells,
    ".vtk": vtk_legacy.written_surface,
}
TET_WRITERS = {".vtu": vtk_xml.written_cells, ".vtk": vtk_legacy.written_cells, ".inp": written_inp}
TET_EXTENSIONS = (*SUFFIXES, *TET_WRITERS, ".msh", *USD_SUFFIXES)  # those that are written
# The beginning of a file says more of its format than its name.
_SIGNS = {
    rb"ply\s": ".ply",
    rb"(?:ST)?C?N?OFF\s": ".off",
    rb"solid\b[^\n]*\s+facet\s": ".stl",
    rb"glTF": ".glb",
    rb"\{\s*\"(?:asset|accessors|scenes?|buffers)\"": ".gltf",
    rb"PK\x03\x04": ".3mf",
    rb"# vtk DataFile": ".vtk",
    rb"(?:<\?xml[^>]*>\s*)?(?:<!--[^>]*-->\s*)?<VTKFile\b": ".vtu",
    rb"(?:<\?xml[^>]*>\s*)?(?:<!--[^>]*-->\s*)?<COLLADA\b": ".dae",
    rb"\$(?:MeshFormat|Comments|NOD)\s": ".msh",
    rb"#usda|PXR-USDC": ".usd",
    rb"MeshVersionFormatted\b": ".mesh",
    rb"(?i:(?:\*\*[^\n]*\n\s*)*\*(?:heading|node|part|include)\s*[,\r\n])": ".inp",
}
# Two units in the last place of single precision, relative to the bounding box.
MERGE_TOLERANCE = 2e-7
# Coordinates with y up, of a file whose x or z points up: which of its axes each is, and its sign.
_TURNED = {"x": ([1, 0, 2], (-1.0, 1.0, 1.0)), "z": ([0, 2, 1], (1.0, 1.0, -1.0))}


class Contents(NamedTuple):
    """What a mesh file holds: points and checked cells, the file that lists the cells, sets of points and of cells."""

    soup: CellSoup
    source: Path
    node_sets: Mapping[str, NDArray[np.int64]] = {}
    cell_sets: Mapping[str, NDArray[np.int64]] = {}

    @property
    def has_solids(self) -> bool:
        """Whether some cell has a volume."""
        return bool((dimensions(self.soup) == 3).any())


def read_contents(path: str | Path, *, keep_axes: bool = False) -> Contents:
    """The points and cells of a file of any format, by its beginning, otherwise by its extension.

    keep_axes : whether the coordinates stay those of the file where this says that another axis than y points up

    Raises
    ------
    MeshError : where the file is missing, malformed or of an unknown format; the text starts with the path.
    """
    path = Path(path)
    if is_tetgen_path(path):
        family = read_tetgen_family(path)
        ele = family_paths(path)[".ele"]
        if family.order == 2:
            logger.warning("%s: ten-node tets: only their four corners are used; to keep them, convert it to .vtu", ele)
        return Contents(CellSoup.of_rows(family.points, family.tets.astype(np.int64), TETRA), ele)
    extension = path.suffix.lower()
    if extension not in READERS:
        raise _unknown_extension(path, (*SUFFIXES, *READERS))
    data = file_contents(path)
    begin = without_mark(data[:4096]).lstrip()
    reader = READERS[extension]
    told = next((READERS[own] for sign, own in _SIGNS.items() if re.match(sign, begin)), reader)
    if told is not reader:
        kinds = [own for own, item in READERS.items() if item is told]
        logger.warning("%s: it is a %s file by what it holds, and read as that", path, " or ".join(kinds))
    try:
        found = told(data, path) if told in _WITH_FILES else told(data)
        file = found if isinstance(found, MeshFile) else MeshFile(found)
        if len(file.soup.points) == 0:
            raise FormatError("it has no vertices")
        soup = checked(file.soup)
    except FormatError as error:
        raise located(path, error) from None
    for note in file.notes:
        logger.warning("%s: %s", path, note)
    if file.up in _TURNED and not keep_axes:
        axes, signs = _TURNED[file.up]
        soup = soup._replace(points=soup.points[:, axes] * signs)
        logger.info("%s: its %s axis points up, and was turned to y", path, file.up)
    return Contents(soup, path, file.node_sets, file.cell_sets)


def surface_of(contents: Contents, *, merge: bool = True) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Vertices (n, 3) and triangles (m, 3) of the surface in a file; see `SurfaceMesh.load`."""
    path = contents.source
    if contents.has_solids:
        count = int((dimensions(contents.soup) == 3).sum())
        raise MeshError(
            f"{path}: it holds {count:,} solid cells, which are a tet mesh already: use it as it is; it is loaded with "
            f"TetMesh.load, whose .surface is the boundary (supple info {path.name})"
        )
    try:
        points = vertex_array(contents.soup.points, str(path))
        triangles = triangles_of(contents.soup)
    except FormatError as error:
        raise located(path, error) from None
    if len(triangles) == 0:
        raise MeshError(f"{path}: it has no triangles or polygons")
    if not merge:
        return points, triangles
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


class TetFile(NamedTuple):
    """Points (n, 3), tets (m, 4) or (m, 10), the file that lists them; by name, rows of points and of tets in sets."""

    points: NDArray[np.float64]
    tets: NDArray[np.integer]
    source: Path
    node_sets: Mapping[str, NDArray[np.int64]] = {}
    tet_sets: Mapping[str, NDArray[np.int64]] = {}


def tet_file_of(contents: Contents) -> TetFile:
    """The tets of a file, into which other solid cells are split; see `TetMesh.load`."""
    path = contents.source
    if not contents.has_solids:
        count = int((dimensions(contents.soup) == 2).sum())
        if not count:
            raise MeshError(f"{path}: it has neither tets nor a surface")
        raise MeshError(
            f"{path}: it holds a surface of {count:,} cells, and no tets; fill it with them: supple mesh {path.name}, "
            "or tetrahedralize(SurfaceMesh.load(...))"
        )
    try:
        split = tets_of(contents.soup)
    except FormatError as error:
        raise located(path, error) from None
    for note in split.notes:
        logger.warning("%s: %s", path, note)
    sets = {name: np.flatnonzero(np.isin(split.cells, rows)) for name, rows in contents.cell_sets.items()}
    tet_sets = {name: rows for name, rows in sets.items() if len(rows)}
    return TetFile(split.points, split.tets, path, contents.node_sets, tet_sets)


def write_surface(path: str | Path, vertices: NDArray[np.float64], triangles: NDArray[np.int32]) -> None:
    """Write a surface; see `SurfaceMesh.save`."""
    path = Path(path)
    writer = SURFACE_WRITERS.get(path.suffix.lower())
    if writer is None:
        raise _unknown_extension(path, tuple(SURFACE_WRITERS))
    _write_whole(path, lambda temporary: temporary.write_bytes(writer(vertices, triangles)))


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
    elif extension in TET_WRITERS:
        data = TET_WRITERS[extension](vertices, tets)
        _write_whole(path, lambda temporary: temporary.write_bytes(data))
    else:
        raise _unknown_extension(path, TET_EXTENSIONS)


def _write_whole(path: Path, write: Callable[[Path], object]) -> None:
    with whole_files(path, error=MeshError) as fresh:
        write(fresh[path])


def _unknown_extension(path: Path, known: tuple[str, ...]) -> MeshError:
    hint = "; unpack it first" if path.suffix.lower() in (".gz", ".bz2", ".xz", ".zst", ".zip", ".7z") else ""
    listed = ", ".join(sorted(known))
    found = f"the extension '{path.suffix}' is not one of" if path.suffix else "it has no extension; use one of"
    return MeshError(f"{path}: {found} {listed}{hint}")


def located(path: Path, error: FormatError) -> MeshError:
    """The error with the file, and the line where it is known."""
    where = f"{path}:{error.line}" if error.line is not None else f"{path}"
    return MeshError(f"{where}: {error.reason}")
