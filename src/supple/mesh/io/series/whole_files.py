"""Series in one file that a library reads in a child process."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

import numpy as np

from supple.errors import MeshError
from supple.mesh.io.cells import FormatError
from supple.mesh.io.in_child import arrays_in_child
from supple.mesh.io.libraries.usd import INSTALL
from supple.mesh.io.mesh_files import located
from supple.mesh.io.series.series import ArraySeries, Cells


def read_usd_series(path: Path) -> ArraySeries:
    """TetMesh and Mesh prims of a USD file, with their time samples."""
    if find_spec("pxr") is None:
        raise MeshError(f"{path}: {INSTALL}")
    return _read(path, "usd_series")


def read_glb_series(path: Path) -> ArraySeries:
    """Meshes of a binary glTF file, with animated morph targets and nodes."""
    return _read(path, "glb_series")


def read_vtkhdf_series(path: Path) -> ArraySeries:
    """An UnstructuredGrid or PolyData in VTKHDF, with its steps."""
    return _read(path, "vtkhdf_series")


def _read(path: Path, library: str) -> ArraySeries:
    try:
        facts, arrays, positions = arrays_in_child(path, library)
    except FormatError as error:
        raise located(path, error) from None
    n = positions.shape[1]
    cells = Cells(
        n,
        arrays["tets"].reshape(-1, 4).astype(np.int64),
        arrays["triangles"].reshape(-1, 3).astype(np.int64),
        arrays["part"].astype(np.int64),
        tuple(facts["names"]),
    )
    series = ArraySeries(path, cells, positions, arrays.get("times"))
    series.others = {int(frame): text for frame, text in facts["others"].items()}
    series.notes = tuple(facts["notes"])
    return series
