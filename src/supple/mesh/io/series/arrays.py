"""Series in arrays of NumPy: an .npz file, or a folder of .npy files.

Positions (frames, n, 3) are called positions, vertices, points, x, q or flexvert_xpos; tets (m, 4) tets, elements or
flex_elem; triangles (t, 3) triangles, faces or indices; masses (n,) masses or particle_mass. MuJoCo's arrays are as
`mjData` and `mjModel` have them.
"""

from __future__ import annotations

import zipfile
import zlib
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.errors import MeshError
from supple.mesh.io.series.series import ArraySeries, Cells

_POSITIONS = ("positions", "vertices", "points", "x", "q", "flexvert_xpos", "particle_q")
_TETS = ("tets", "elements", "tetrahedra", "flex_elem", "tet_indices")
_TRIANGLES = ("triangles", "faces", "indices", "tri_indices")
_TIMES = ("times", "time", "t")
_MASSES = ("masses", "particle_mass")
_DIMENSION = ("flex_dim",)
_NAMES = {*_POSITIONS, *_TETS, *_TRIANGLES, *_TIMES, *_MASSES, *_DIMENSION}
_MOST_BYTES = 2**36


def read_npz(path: Path) -> ArraySeries:
    """The series in an .npz file."""
    try:
        with np.load(path, allow_pickle=False) as arrays:
            if not isinstance(arrays, np.lib.npyio.NpzFile):
                raise MeshError(f"{path}: it is not an .npz file; give the folder of .npy files")
            assert arrays.zip is not None
            sizes = {info.filename.removesuffix(".npy"): info.file_size for info in arrays.zip.infolist()}
            wanted = [name for name in arrays.files if name in _NAMES]
            if sum(sizes.get(name, 0) for name in wanted) > _MOST_BYTES:
                raise MeshError(
                    f"{path}: its arrays are larger than 64 GiB; save positions.npy and tets.npy in a folder"
                )
            return _series(path, wanted, lambda name: arrays[name])
    except FileNotFoundError:
        raise MeshError(f"{path}: the file does not exist") from None
    except (OSError, ValueError, EOFError, KeyError, zipfile.BadZipFile, zlib.error, NotImplementedError) as error:
        raise MeshError(f"{path}: it cannot be read as .npz: {' '.join(str(error).split())[:200]}") from None


def is_array_folder(folder: Path) -> bool:
    """Whether a folder has an array of positions."""
    return any((folder / f"{name}.npy").exists() for name in _POSITIONS)


def read_folder(folder: Path) -> ArraySeries:
    """The series in a folder of .npy files; positions are mapped, so that one frame at a time is in memory."""

    def load(name: str) -> NDArray[Any]:
        file = folder / f"{name}.npy"
        try:
            return np.load(file, mmap_mode="r" if name in _POSITIONS else None, allow_pickle=False)
        except (OSError, ValueError, EOFError) as error:
            raise MeshError(f"{file}: it cannot be read: {' '.join(str(error).split())[:200]}") from None

    return _series(folder, sorted(file.stem for file in folder.glob("*.npy") if file.stem in _NAMES), load)


def _series(path: Path, there: Iterable[str], load: Callable[[str], NDArray[Any]]) -> ArraySeries:
    there = list(there)

    def first_of(names: tuple[str, ...]) -> NDArray[Any] | None:
        name = next((name for name in names if name in there), None)
        if name is None:
            return None
        array = load(name)
        if array.dtype.kind not in "iuf":
            raise MeshError(f"{path}: its {name} are not numbers but {array.dtype}")
        return array

    x = first_of(_POSITIONS)
    if x is None:
        raise MeshError(f"{path}: it has no positions (frames, n, 3); save an array named positions")
    if x.ndim == 2 and x.shape[1] == 3:
        x = x[None]
    if x.ndim != 3 or x.shape[2] != 3 or 0 in x.shape:
        raise MeshError(f"{path}: its positions have the shape {x.shape}; (frames, n, 3) is needed")
    tets, triangles, dimension = first_of(_TETS), first_of(_TRIANGLES), first_of(_DIMENSION)
    if tets is not None and dimension is not None and int(dimension.flat[0]) == 2:  # of MuJoCo
        tets, triangles = None, tets
    if tets is None and triangles is None:
        raise MeshError(f"{path}: it has neither tets (m, 4) nor triangles (t, 3); save an array of one of these names")
    n = x.shape[1]
    cells = Cells(
        n,
        _rows(path, tets, 4, n, "tet"),
        _rows(path, triangles, 3, n, "triangle"),
        np.zeros(n, dtype=np.int64),
        ("",),
    )
    times = first_of(_TIMES)
    if times is not None and times.shape != (len(x),):
        raise MeshError(f"{path}: it has {times.size} times for {len(x)} frames")
    series = ArraySeries(path, cells, x, None if times is None else times.astype(np.float64))
    masses = first_of(_MASSES)
    if masses is not None:
        if masses.shape != (n,) or not (np.isfinite(masses) & (masses >= 0.0)).all():
            raise MeshError(f"{path}: its masses are not {n} numbers of zero or more")
        series.masses = masses.astype(np.float64)
    return series


def _rows(path: Path, array: NDArray[Any] | None, width: int, count: int, kind: str) -> NDArray[np.int64]:
    if array is None:
        return np.zeros((0, width), dtype=np.int64)
    flat = array.ndim == 1 and array.size % width == 0
    if not (flat or array.shape[1:] == (width,)) or array.dtype.kind not in "iu":
        raise MeshError(
            f"{path}: its {kind}s have the shape {array.shape} of {array.dtype}; whole numbers in rows of {width}"
        )
    rows = array.reshape(-1, width).astype(np.int64)
    outside = ((rows < 0) | (rows >= count)).any(axis=1)
    if outside.any():
        k = int(np.flatnonzero(outside)[0])
        raise MeshError(f"{path}: {kind} {k} names point {rows[k].max()}, but points run from 0 to {count - 1}")
    return rows
