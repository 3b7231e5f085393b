"""What a path names: a folder, a pattern, a list of frames, or one file with all frames."""

from __future__ import annotations

import glob
import json
import re
from collections import defaultdict
from collections.abc import Callable, Iterable
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from supple.errors import MeshError
from supple.mesh.io.cells import FormatError
from supple.mesh.io.in_child import arrays_in_child
from supple.mesh.io.libraries.usd import INSTALL, USD_SUFFIXES
from supple.mesh.io.mesh_files import READERS, located
from supple.mesh.io.series.arrays import is_array_folder, read_folder, read_npz
from supple.mesh.io.series.file_series import MAX_FRAMES, FileSeries
from supple.mesh.io.series.series import ArraySeries, Cells, Series
from supple.mesh.io.text import file_contents


def _read_in_child(path: Path, library: str) -> ArraySeries:
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


def _read_usd(path: Path) -> ArraySeries:
    """TetMesh and Mesh prims of a USD file, with their time samples."""
    if find_spec("pxr") is None:
        raise MeshError(f"{path}: {INSTALL}")
    return _read_in_child(path, "usd_series")


WHOLE: dict[str, Callable[[Path], Series]] = {
    ".npz": read_npz,
    ".glb": partial(_read_in_child, library="glb_series"),
    ".vtkhdf": partial(_read_in_child, library="vtkhdf_series"),
    ".hdf": partial(_read_in_child, library="vtkhdf_series"),
    **dict.fromkeys(USD_SUFFIXES, _read_usd),
}
_NUMBER = re.compile(r"(\d+)(?!.*\d)")


def open_series(path: str | Path, *more: Path) -> Series:
    """The series at a path.

    Parameters
    ----------
    more : further files of the same series.
    path : a folder of files with numbers in their names, or of .npy files; a pattern such as out/frame_*.obj; a .pvd
        or .series file; a .vtkhdf, USD, .glb or .npz file.

    Raises
    ------
    MeshError : where none exists, or it cannot be read.
    """
    path = Path(path)
    if more:
        return _numbered(path, (path, *more))
    if path.is_dir():
        if is_array_folder(path):
            return read_folder(path)
        found = [file for file in path.iterdir() if file.suffix.lower() in READERS and file.is_file()]
        return _numbered(path, found)
    suffix = path.suffix.lower()
    if any(sign in path.name for sign in "*?[") and not path.exists():
        return _numbered(path, map(Path, glob.glob(str(path))))
    if suffix == ".npy":
        raise MeshError(f"{path}: give the folder with positions.npy and tets.npy or triangles.npy")
    if suffix == ".pvd":
        return _listed(path, _pvd_entries(path))
    if suffix == ".series":
        return _listed(path, _json_entries(path))
    if suffix in WHOLE:
        file_contents_exist(path)
        return WHOLE[suffix](path)
    if suffix in READERS:
        if not path.exists():
            raise MeshError(f"{path}: the file does not exist")
        raise MeshError(
            f"{path}: it is one mesh; give a pattern of all frames, such as {_pattern(path)}, or their folder"
        )
    known = ", ".join(sorted({*READERS, *WHOLE, ".pvd", ".series"}))
    raise MeshError(
        f"{path}: there is nothing to check; give a recording, a folder or pattern of frames, or one of {known}"
    )


def file_contents_exist(path: Path) -> None:
    """Raise `MeshError` where a file is missing, not a regular one, or empty."""
    if not path.exists():
        raise MeshError(f"{path}: the file does not exist")
    if not path.is_file():
        raise MeshError(f"{path}: it is not a regular file")
    if path.stat().st_size == 0:
        raise MeshError(f"{path}: it is empty")


def _pattern(path: Path) -> str:
    return (
        str(path.with_name(_NUMBER.sub("*", path.stem) + path.suffix))
        if _NUMBER.search(path.stem)
        else "*" + path.suffix
    )


def _numbered(path: Path, files: Iterable[Path]) -> Series:
    """Files with the last number of their names as the frame, and the rest as the part."""
    parts: dict[tuple[str, str], dict[int, Path]] = defaultdict(dict)
    alone: list[Path] = []
    for file in files:
        match = _NUMBER.search(file.stem)
        if match is None or file.suffix.lower() not in READERS:
            alone.append(file)
            continue
        key = file.stem[: match.start()] + "#" + file.stem[match.end() :], file.suffix.lower()
        parts[key][int(match[0])] = file
    parts = {key: own for key, own in parts.items() if len(own) > 1} or parts
    if not parts:
        hint = f"; {alone[0].name} has no number" if alone else ""
        raise MeshError(
            f"{path}: there is neither a recording.vtkhdf nor frames, which are files such as frame_0001.obj, with a "
            f"number in their names{hint}"
        )
    suffixes = sorted({suffix for _, suffix in parts})
    if len(suffixes) > 1:
        raise MeshError(
            f"{path}: there are frames as {' and '.join(suffixes)}; name those to check, such as *{suffixes[0]}"
        )
    numbers = sorted(set.intersection(*(set(own) for own in parts.values())))
    if not numbers:
        raise MeshError(f"{path}: no frame has files of all parts: {', '.join(sorted(stem for stem, _ in parts))}")
    if len(numbers) > MAX_FRAMES:
        raise MeshError(f"{path}: there are more than {MAX_FRAMES} frames")
    order = sorted(parts)
    names = [stem.replace("#", "").strip("_-. ") for stem, _ in order] if len(order) > 1 else [""]
    frames = [[parts[key][number] for key in order] for number in numbers]
    return FileSeries(path, frames, names, numbers=np.array(numbers, dtype=np.int64))


def _listed(path: Path, entries: list[tuple[float, str, str]]) -> Series:
    """Frames of a list of (time, part, file)."""
    by_time: dict[float, dict[str, Path]] = defaultdict(dict)
    for time, part, name in entries:
        file = path.parent / name
        if Path(name).is_absolute() or ".." in Path(name).parts:
            raise MeshError(f"{path}: it lists {name[:80]!r}, which is outside of its folder")
        if file.suffix.lower() not in READERS:
            raise MeshError(f"{path}: it lists {name[:80]!r}, which is not a mesh that can be read")
        by_time[time][part] = file
    if not by_time:
        raise MeshError(f"{path}: it lists no frames")
    times = sorted(by_time)
    parts = sorted(by_time[times[0]])
    for time in times:
        if sorted(by_time[time]) != parts:
            raise MeshError(f"{path}: at {time:g} s it lists other parts than at first")
    frames = [[by_time[time][part] for part in parts] for time in times]
    return FileSeries(path, frames, parts if len(parts) > 1 else [""], times=np.array(times))


def _pvd_entries(path: Path) -> list[tuple[float, str, str]]:
    try:
        root = ElementTree.fromstring(file_contents(path))
        sets = list(root.iter("DataSet"))
        return [
            (float(one.get("timestep", k)), one.get("part", "0"), one.get("file", "")) for k, one in enumerate(sets)
        ]
    except (ElementTree.ParseError, ValueError, LookupError):
        raise MeshError(
            f"{path}: it is not a .pvd file: XML with a DataSet, timestep and file for each frame"
        ) from None


def _json_entries(path: Path) -> list[tuple[float, str, str]]:
    try:
        files = json.loads(file_contents(path))["files"]
        return [(float(entry["time"]), "0", str(entry["name"])) for entry in files]
    except (ValueError, LookupError, TypeError, RecursionError):
        raise MeshError(f"{path}: it is not a list of a series: JSON with a name and a time for each file") from None
