"""The part of a recording that no frame changes: the scene as it was described, and how it was simulated.

It is written by the codec of kinds: a tree of JSON, and beside it an array for each path in the tree.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from supple.errors import SuppleError
from supple.kinds.codec import Arrays, check, decoded, encoded, kinds_by_name
from supple.materials.elastic_tets.regions import Regions
from supple.materials.own.formula import Formula
from supple.materials.registry import MATERIALS
from supple.mesh.surface import SurfaceMesh
from supple.mesh.tetmesh import TetMesh
from supple.model.state import Status
from supple.results.recording.checked_hdf5 import CheckedFile
from supple.results.recording.details import RecordedDetails, RecordedField
from supple.results.recording.thin_cells import ThinCells
from supple.scene.rigid.rigid_body import RigidBody
from supple.scene.rows import rows_of
from supple.scene.scene import Scene

FORMAT_VERSION = 9
_GROUP, _HEADER = "supple", "supple/header"
_INLINE = 16  # entries of arrays that are in the tree: vectors and matrices
# What a scene does not contain, such as solvers and studies.
_OF_PROGRAM = re.compile(r"supple\.(?!scene|materials)")
# The types of VTK of cells by their number of nodes: lines, triangles, tets, quadratic tets.
_KINDS = {2: 3, 3: 5, 4: 10, 10: 24}


@dataclass(eq=False, repr=False)
class Description:
    """All that no frame changes; see `Recording`."""

    supple_version: str
    dt: float
    steps: int
    solver: str | None
    scene_text: str | None
    scene: Scene
    functions: tuple[NDArray[np.float64] | None, ...]
    details: RecordedDetails
    field_names: tuple[str, ...]
    statuses_of_codes: tuple[str, ...]


def _classes() -> dict[str, type]:
    own = Scene, TetMesh, SurfaceMesh, Formula, Description, RecordedDetails, RecordedField, Regions
    described = {name: kind for name, kind in kinds_by_name().items() if not _OF_PROGRAM.match(kind.__module__)}
    return described | {kind.__name__: kind for kind in (*MATERIALS, *own)}


def described(scene: Scene) -> tuple[Any, Arrays, list[Callable[..., Any]]]:
    """A scene as a tree of JSON, the arrays beside it, and its functions of time, each once.

    Raises
    ------
    OutputError : where the scene has what a recording cannot keep.
    """
    functions: list[Callable[..., Any]] = []
    return *encoded(scene, _classes(), functions, _INLINE), functions


def write_description(file: h5py.File, description: Description) -> None:
    """Write the part that no frame changes to its group, and for VTK the tets."""
    _write_grid(file.require_group("VTKHDF"), description.scene)
    own = file.require_group(_GROUP)
    own.attrs["format_version"] = FORMAT_VERSION
    tree, arrays = encoded(description, _classes(), [], _INLINE)
    file[_HEADER] = json.dumps(tree)
    for path, array in arrays.items():
        own[path] = array


def read_description(file: CheckedFile, function: Callable[[int], Any]) -> Description:
    """The part that no frame changes. All of it is checked.

    Parameters
    ----------
    function : what stands for the function of time with a number

    Raises
    ------
    OutputError : where the file is not a recording, of another version, or contradictory.
    """
    version = file.attribute(_GROUP, "format_version")
    if version is None:
        kind = file.attribute("VTKHDF", "Type")
        foreign = f"a VTKHDF {kind.decode()} of another program" if isinstance(kind, bytes) else "an HDF5 file"
        raise file.other(foreign)
    if not isinstance(version, (int, np.integer)):
        raise file.broken(f"its format version is {str(version)[:20]!r}")
    if version != FORMAT_VERSION:
        raise file.of_another_version(f"format {version}, this one reads {FORMAT_VERSION}")
    used: list[int] = []

    def numbered(number: int) -> Any:
        used.append(number)
        return function(number)

    try:
        found = decoded(json.loads(file.text(_HEADER)), _Arrays(file), _classes(), numbered)
        check(found, Description, _GROUP)
        _check_consistency(found, used)
    except (
        ArithmeticError,
        AssertionError,
        AttributeError,
        LookupError,
        RecursionError,
        TypeError,
        ValueError,
    ) as error:
        raise file.broken(_what(error)) from None
    except SuppleError as error:
        if str(error).startswith(str(file.path)):
            raise
        raise file.broken(_what(error)) from None
    return found


def _what(error: Exception) -> str:
    return f"its description of the scene: {' '.join(str(error).split())[:300]}"


class _Arrays(dict[str, NDArray[Any]]):
    """The arrays beside the tree, read when they are asked for."""

    def __init__(self, file: CheckedFile) -> None:
        super().__init__()
        self._file = file

    def __missing__(self, path: str) -> NDArray[Any]:
        return self._file.array(f"{_GROUP}/{path}")


def _check_consistency(found: Description, functions: list[int]) -> None:
    """Raise `ValueError` for what the annotations, and the constructors of what is described, cannot say."""
    if not found.dt > 0.0:
        raise ValueError("it has no time step")
    if not set(found.statuses_of_codes) <= {str(status) for status in Status}:
        raise ValueError("it has a status that is not known here")
    if not all(0 <= number < len(found.functions) for number in functions):
        raise ValueError("it has a function of time without values")
    for body in found.scene.bodies:
        shape = body.shape if isinstance(body, RigidBody) else body.mesh
        if isinstance(shape, TetMesh) and shape.reoriented:  # those that are written have been reoriented
            raise ValueError(f"{shape.reoriented} tets of body {body.name!r} are inverted at rest")
    _ = found.scene.stitching  # raises where a pair does not exist
    found.details.check()


def _write_grid(grid: h5py.Group, scene: Scene) -> None:
    """Write what VTK needs to know of the tets, of the triangles of shells and of the edges of rods."""
    parts = rows_of(scene.bodies)
    thin = ThinCells(parts)
    n, m = parts[-1].vertices.stop, parts[-1].tets.stop + len(thin.owners)
    grid.attrs.create("Version", np.array([2, 2], dtype=np.int64))
    grid.attrs.create("Type", np.bytes_("UnstructuredGrid"))
    cells = [*(part.body.mesh.nodes + part.vertices.start for part in parts)]
    cells += [own + part.vertices.start for part, own in thin.parts]
    widths = np.concatenate([np.full(len(nodes), nodes.shape[1], dtype=np.int64) for nodes in cells])
    for name, count in (("NumberOfPoints", n), ("NumberOfCells", m), ("NumberOfConnectivityIds", widths.sum())):
        grid[name] = np.array([count], dtype=np.int64)
    grid["Connectivity"] = np.concatenate([nodes.ravel() for nodes in cells]).astype(np.int64)
    grid["Offsets"] = np.concatenate([[0], np.cumsum(widths)])
    grid["Types"] = np.array([_KINDS[width] for width in widths], dtype=np.uint8)
    of_point, of_cell = np.zeros(n, dtype=np.int32), np.zeros(m, dtype=np.int32)
    of_cell[m - len(thin.owners) :] = thin.owners
    for part in parts:
        of_point[part.vertices], of_cell[part.tets] = part.number, part.number
    grid["PointData/body"], grid["CellData/body"] = of_point, of_cell
