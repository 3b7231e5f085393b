"""TetGen's own files: .node (vertices), .ele (tets), .edge and .face, all of one name.

Layout: https://wias-berlin.de/software/tetgen/fformats.html. Each file has a header line, then one numbered row per
line. The number of the first vertex, 0 or 1, is the start of all numbering. `#` starts a comment.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.errors import MeshError
from supple.mesh.io.tetgen_table import Header, Table, read_header, read_rows
from supple.mesh.topology import TET_EDGES, TET_FACETS, edge_keys, facet_keys, has_vertex_twice
from supple.runtime.replacing import whole_files

SUFFIXES = (".node", ".ele", ".edge", ".face")


class TetgenFamily(NamedTuple):
    """The contents of a family of TetGen files, before anything is dropped or turned. Indices start at 0.

    Attributes
    ----------
    points : (n, 3) float [m], with `point_attributes` (n, a) and `point_markers` (n,) or None
    tets : (m, 4) int32, the corners as in the file, with `tet_attributes` (m, b), mostly regions
    edges, faces : (e, 2) and (f, 3) int32 or None where the file does not exist, with `edge_markers` and `face_markers`
    base_index : 0 or 1, as in the files
    order : 1, or 2 where the file holds ten-node tets, of which the four corners are kept here
    """

    points: NDArray[np.float64]
    tets: NDArray[np.int32]
    point_attributes: NDArray[np.float64]
    tet_attributes: NDArray[np.float64]
    point_markers: NDArray[np.int32] | None
    edges: NDArray[np.int32] | None
    edge_markers: NDArray[np.int32] | None
    faces: NDArray[np.int32] | None
    face_markers: NDArray[np.int32] | None
    base_index: int
    order: int


def read_tetgen_family(path: str | Path) -> TetgenFamily:
    """Read everything in a TetGen family, attributes and markers included, from the name of any one of its files.

    Raises
    ------
    MeshError : `file:line: reason`, or the name of the file that is missing.
    """
    path = Path(path)
    node, ele, edge, face = family_paths(path).values()
    _require(node, path)
    points, point_attributes, point_markers, base = _read_nodes(node)
    _require(ele, path)
    tets, tet_attributes, order = _read_tets(ele, len(points), base)
    edges, edge_markers = _read_simplices(edge, tets, len(points), base, (2, order + 1), "edge")
    faces, face_markers = _read_simplices(face, tets, len(points), base, (3, 3 * order), "face")
    return TetgenFamily(
        points, tets, point_attributes, tet_attributes, point_markers,
        edges, edge_markers, faces, face_markers, base, order,
    )  # fmt: skip


def write_tetgen_family(
    path: str | Path,
    vertices: NDArray[np.float64],
    tets: NDArray[np.int32],
    edges: NDArray[np.int32],
    triangles: NDArray[np.int32],
    base_index: int = 1,
) -> dict[str, Path]:
    """Write the four files of a family; see `write_tetgen`. `triangles` (f, 3): the boundary."""
    if base_index not in (0, 1):
        raise MeshError(f"{path}: base_index must be 0 or 1, not {base_index!r}")
    paths = family_paths(path)
    n = len(vertices)
    on_boundary = np.zeros(n, dtype=np.int64)
    on_boundary[triangles] = 1
    keys = edges[:, 0].astype(np.int64) * n + edges[:, 1]
    edge_marker = np.isin(keys, edge_keys(triangles, n)).astype(np.int64)
    face_marker = np.ones(len(triangles), dtype=np.int64)
    contents = (
        ("3 0 1", "%d %r %r %r %d\n", (vertices, on_boundary)),
        ("4 0", "%d %d %d %d %d\n", (tets + base_index,)),
        ("1", "%d %d %d %d\n", (edges + base_index, edge_marker)),
        ("1", "%d %d %d %d %d\n", (triangles + base_index, face_marker)),
    )
    with whole_files(*paths.values(), error=MeshError) as fresh:
        for member, (header, pattern, blocks) in zip(paths.values(), contents, strict=True):
            count = len(blocks[0])
            with fresh[member].open("w", encoding="ascii", newline="\n") as file:
                file.write(f"{count} {header}\n")
                file.writelines(_lines(pattern, np.arange(base_index, base_index + count), *blocks))
    return paths


def _lines(pattern: str, *blocks: NDArray) -> Iterator[str]:
    """Rows of numbers as text, 16384 lines at a time: one `%` for many rows is far faster than one for each."""
    for start in range(0, len(blocks[0]), 16384):
        parts = [block[start : start + 16384] for block in blocks]
        columns = [c.tolist() for part in parts for c in (part.T if part.ndim == 2 else [part])]
        yield pattern * len(parts[0]) % tuple(chain.from_iterable(zip(*columns, strict=True)))


def is_tetgen_path(path: str | Path) -> bool:
    """Whether a name has the suffix of one of TetGen's files."""
    return Path(path).suffix.lower() in SUFFIXES


def family_paths(path: str | Path) -> dict[str, Path]:
    """The four files {suffix: path} of the family that a name belongs to."""
    # "bear.1" without one of the suffixes is the family's own name; with_suffix would remove its ".1".
    stem = Path(path).with_suffix("") if is_tetgen_path(path) else Path(path)
    return {suffix: stem.with_name(stem.name + suffix) for suffix in SUFFIXES}


def _require(member: Path, given: Path) -> None:
    if member.exists() or member.is_symlink():
        return
    hint = ""
    stem = member.with_suffix("")
    if member != given and (iteration := stem.with_name(stem.name + ".1" + member.suffix)).exists():
        hint = f"; {iteration.name} exists: give that name"
    elif member != given:
        hint = f"; it belongs to {given.name}, and a tet mesh needs both .node and .ele"
    raise MeshError(f"{member}: the file does not exist{hint}")


def _read_nodes(
    path: Path,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int32] | None, int]:
    names = ("number of vertices", "dimension", "attributes", "boundary markers (0 or 1)")
    header = read_header(path, names, (3, 0, 0))
    count, dimension, n_attributes, n_markers = header.values
    if dimension != 3:
        raise header.error(f"dimension {dimension}; only meshes of dimension 3 can be read")
    further = _further_columns(header, n_attributes, n_markers)
    if count == 0:
        raise header.error("the header announces no vertices")
    table = read_rows(header, 4 + n_attributes + n_markers, f"index x y z{further}")
    base = table.rows[0, 0]
    if base not in (0.0, 1.0):
        raise table.error(0, f"the first vertex has the number {base:.17g}; numbering must start at 0 or 1")
    _check_numbering(table, int(base), "vertex")
    markers = _markers(table, slice(4 + n_attributes, None)) if n_markers else None
    points = np.ascontiguousarray(table.rows[:, 1:4])
    return points, np.ascontiguousarray(table.rows[:, 4 : 4 + n_attributes]), markers, int(base)


def _read_tets(path: Path, n_points: int, base: int) -> tuple[NDArray[np.int32], NDArray[np.float64], int]:
    header = read_header(path, ("number of tets", "nodes per tet", "attributes"), (4, 0))
    count, nodes, n_attributes = header.values
    if nodes not in (4, 10):
        raise header.error(f"{nodes} nodes per tet; only 4 and 10 can be read")
    further = _further_columns(header, n_attributes, 0)
    if count == 0:
        raise header.error("the header announces no tets")
    table = read_rows(header, 1 + nodes + n_attributes, f"index and {nodes} vertices{further}")
    _check_numbering(table, base, "tet")
    corners = _corners(table, nodes, n_points, base)[:, :4]
    table.raise_where(has_vertex_twice(corners), "the tet has the same vertex twice")
    return np.ascontiguousarray(corners), np.ascontiguousarray(table.rows[:, 1 + nodes :]), 1 if nodes == 4 else 2


def _read_simplices(
    path: Path, tets: NDArray[np.int32], n_points: int, base: int, nodes: tuple[int, int], what: str
) -> tuple[NDArray[np.int32] | None, NDArray[np.int32] | None]:
    """Edges or faces with their markers; each must belong to a tet. `nodes`: corners, and nodes on a line."""
    if not (path.exists() or path.is_symlink()):
        return None, None
    width, on_line = nodes
    header = read_header(path, (f"number of {what}s", "boundary markers (0 or 1)"), (0,))
    count, n_markers = header.values
    meaning = f"index and {on_line} vertices" + _further_columns(header, 0, n_markers)
    table = read_rows(header, 1 + on_line + n_markers, meaning, extra=width - 1)
    if count == 0:
        return np.empty((0, width), np.int32), np.empty(0, np.int32) if n_markers else None
    _check_numbering(table, base, what)
    corners = np.ascontiguousarray(_corners(table, on_line, n_points, base)[:, :width])
    of_tets = tets[:, TET_EDGES if width == 2 else TET_FACETS].reshape(-1, width)
    # Only keys of one call can be compared, so both go into one call.
    every = np.concatenate([corners, of_tets])
    # An edge (a, b), a < b, as (a, b, b), so that one key function serves both.
    keys = facet_keys(every if width == 3 else np.sort(every, axis=1)[:, [0, 1, 1]], n_points)
    own, known = keys[:count], np.sort(keys[count:])
    found = known[np.minimum(np.searchsorted(known, own), len(known) - 1)] == own
    table.raise_where(~found, f"the {what} belongs to no tet")
    order = np.argsort(own, kind="stable")
    again = np.zeros(count, dtype=bool)
    again[order[1:]] = own[order][1:] == own[order][:-1]
    table.raise_where(again, f"the {what} is given a second time")
    return corners, _markers(table, slice(1 + on_line, 2 + on_line)) if n_markers else None


def _further_columns(header: Header, n_attributes: int, n_markers: int) -> str:
    """What follows the vertices of a row, as text; `MeshError` where the header announces what cannot be."""
    if n_markers not in (0, 1):
        raise header.error(f"the header's boundary markers must be 0 or 1, not {n_markers}")
    if not 0 <= n_attributes < 10**6:
        raise header.error(f"{n_attributes} attributes")
    return (f", {n_attributes} attributes" if n_attributes else "") + (", a marker" if n_markers else "")


def _check_numbering(table: Table, base: int, what: str) -> None:
    given = table.rows[:, 0]
    wrong = given != np.arange(base, base + len(given))
    row = int(wrong.argmax())
    reason = f"{what} number {{}} where {base + row} must come; numbers run on from {base}, as in .node"
    table.raise_where(wrong, reason, given)


def _corners(table: Table, width: int, n_points: int, base: int) -> NDArray[np.int32]:
    corners = table.whole_numbers(slice(1, 1 + width), "vertex")
    for column in corners.T:
        bad = (column < base) | (column >= n_points + base)
        table.raise_where(bad, f"vertex {{}} does not exist: they run from {base} to {n_points + base - 1}", column)
    return (corners - base).astype(np.int32)


def _markers(table: Table, column: slice) -> NDArray[np.int32]:
    return table.whole_numbers(column, "marker")[:, 0].astype(np.int32)
