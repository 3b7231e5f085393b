"""A VTKHDF file of which a killed writer loses at most the frame that it writes.

The HDF5 library alone does not guarantee this (notes/decisions.md, 4). Therefore it first lays out the whole file, with
capacity for many frames, and closes it. Every series of frames then has a fixed position ("contiguous" layout), and a
frame is written there as plain bytes; the last write of a frame is the count of frames. Capacity that is not used takes
no disk space where the file system supports holes.

When the capacity is used up, the file is copied to a file with twice the capacity, which then replaces it. When the
simulation ends, it is copied to a file without spare capacity, which has the steps of VTK: until then ParaView shows
the first frame.

Source: VTKHDF file format 2.x (docs.vtk.org).
"""

from __future__ import annotations

import copy
import errno
import os
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import h5py
import numpy as np
from numpy.typing import ArrayLike

from supple.runtime.replacing import put_in_place, temporary_name

WRITTEN = "supple/frames_written"
TIMES = "supple/frames/time"
_COPY_BYTES = 1 << 20  # more would remain in the memory of the process
_STEP_COLUMNS = 5  # different columns in VTKHDF/Steps
_HEADER = 1 << 12  # of one dataset, at most
_SPARE_ROOM = 1 << 16  # for what HDF5 writes beside the arrays


@dataclass(frozen=True)
class Series:
    """An array of which every frame has `rows` rows of one shape."""

    path: str
    rows: int
    row_shape: tuple[int, ...] = ()
    dtype: str = "<f8"

    @property
    def frame_bytes(self) -> int:
        return self.rows * int(np.prod(self.row_shape, dtype=np.int64)) * np.dtype(self.dtype).itemsize

    def shape(self, frames: int) -> tuple[int, ...]:
        return (frames * self.rows, *self.row_shape)


@dataclass(frozen=True)
class Layout:
    """What a recording's frames hold, and its points and cells: tets, triangles of shells, edges of rods."""

    points: int
    cells: int
    series: tuple[Series, ...]

    @property
    def frame_bytes(self) -> int:
        return sum(series.frame_bytes for series in self.series)


class RecordingFile:
    """Writes frames to their positions in a file that `create` laid out.

    Parameters
    ----------
    path : the file; layout : of its frames; capacity : its frames; written : how many it has.
    """

    def __init__(self, path: Path, layout: Layout, capacity: int, written: int = 0) -> None:
        self.path, self.layout, self.capacity, self.written = path, layout, capacity, written
        with h5py.File(path, "r") as file:
            self._series = {s.path: (s, _place(file, s)) for s in layout.series}
            self._counter = int(_dataset(file, WRITTEN).id.get_offset())
        self._file: BinaryIO = open(path, "r+b", buffering=0)  # noqa: SIM115

    def put(self, path: str, values: ArrayLike) -> None:
        """Write the next frame's rows of one series; readers see them after `commit`."""
        series, place = self._series[path]
        data = np.ascontiguousarray(values, dtype=series.dtype)
        if data.nbytes != series.frame_bytes:
            raise ValueError(f"{path}: a frame has {series.frame_bytes} bytes, not {data.nbytes}")
        self._write(place + self.written * series.frame_bytes, data.tobytes())

    def get(self, path: str, number: int) -> bytes:
        """The bytes of one frame's rows of a series."""
        series, place = self._series[path]
        self._file.seek(place + number * series.frame_bytes)
        return self._file.read(series.frame_bytes)

    def commit(self) -> None:
        """Add the frame that was put to the count of frames."""
        self.written += 1
        self.write_count()

    def write_count(self) -> None:
        """Write the number of frames."""
        self._write(self._counter, self.written.to_bytes(8, "little"))

    @property
    def is_in_place(self) -> bool:
        """Whether `path` still leads to this file: writing to one that was deleted is not an error of the system."""
        try:
            return os.path.samestat(os.fstat(self._file.fileno()), self.path.stat())
        except OSError:
            return False

    def sync(self) -> None:
        """Bring everything that was written to the disk."""
        os.fsync(self._file.fileno())

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def moved(self, path: Path) -> RecordingFile:
        """Rename the file; returns a writer under the new name. Some systems cannot rename an open file."""
        self.close()
        put_in_place(self.path, path)
        there = copy.copy(self)
        there.path, there._file = path, open(path, "r+b", buffering=0)  # noqa: SIM115
        return there

    def _write(self, place: int, data: bytes) -> None:
        self._file.seek(place)
        rest = memoryview(data)
        while rest:
            rest = rest[self._file.write(rest) :]


def create(path: Path, layout: Layout, capacity: int, write_static: Callable[[h5py.File], None]) -> None:
    """Lay out a file for `capacity` frames, with none yet; `write_static` adds all that does not change."""
    # A draft in memory gives the size.
    with h5py.File(path, "w", driver="core", backing_store=False) as draft:
        write_static(draft)
        draft.flush()
        static_bytes = len(draft.id.get_file_image())
    _require_room(path, static_bytes + layout.frame_bytes, length=static_bytes + layout.frame_bytes * capacity)
    with h5py.File(path, "w", libver=("earliest", "v110")) as file:
        write_static(file)
        file.create_dataset(WRITTEN, data=np.int64(0))
        for series in layout.series:
            _reserve(file, series, series.shape(capacity))


def rewrite(source: Path, target: Path, layout: Layout, capacity: int | None, *, compress: bool = False) -> None:
    """Copy the complete frames of a recording to a file with another capacity; None: to one for ParaView, without spare
    capacity.

    With `compress`, the series are stored in gzip chunks, one per frame; nothing can be added to them then.

    Raises
    ------
    OSError : where the disk is full.
    RuntimeError, TypeError, ValueError, KeyError : from HDF5, where the source is damaged.
    """
    _require_room(target, 0, length=layout.frame_bytes * (capacity or 0))
    with h5py.File(source, "r", locking=False) as old, h5py.File(target, "w", libver=("earliest", "v110")) as new:
        written = int(_dataset(old, WRITTEN)[()])
        paths, sizes = {series.path for series in layout.series}, [written * layout.frame_bytes]
        old.visititems(
            lambda path, item: sizes.append(
                _HEADER + item.id.get_storage_size() if isinstance(item, h5py.Dataset) and path not in paths else 0
            )
        )
        small = sizes[0] <= _COPY_BYTES  # then it is tried once whether there is space, which takes milliseconds
        _require_room(target, sum(sizes if small else sizes[1:]))
        _copy_static(old, new, "", paths)
        new.create_dataset(WRITTEN, data=np.int64(written))
        for series in layout.series:
            source_data = _dataset(old, series.path)
            rows = written * series.rows
            shape = (max(rows, (capacity or 0) * series.rows), *series.row_shape)
            if compress and 0 not in shape:
                chunk = (series.rows if series.rows > 1 else min(rows, 1024), *series.row_shape)
                data = new.create_dataset(
                    series.path, shape, series.dtype, chunks=chunk, compression="gzip", compression_opts=4, shuffle=True
                )
            else:
                data = _reserve(new, series, shape)
            step = max(1, _COPY_BYTES // max(1, series.frame_bytes)) * max(1, series.rows)
            for row in range(0, rows if 0 not in shape else 0, step):
                if not small:
                    _require_room(target, step * series.frame_bytes // max(1, series.rows))
                data[row : min(row + step, rows)] = source_data[row : min(row + step, rows)]
        if capacity is None:
            _require_room(target, _STEP_COLUMNS * 8 * written)
            _write_steps(new, layout, written)


def _require_room(path: Path, size: int, *, length: int = 0) -> None:
    """Raise `OSError` unless `path` may grow by `size` bytes, and be `length` bytes long.

    HDF5 crashes where it finds the disk full, a quota or a limit of file sizes.
    """
    if shutil.disk_usage(path.parent).free < size + _SPARE_ROOM:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    before = path.stat().st_size if path.exists() else 0
    probe = temporary_name(path)
    try:
        with probe.open("wb") as file:
            file.truncate(max(length, before + size) + _SPARE_ROOM)
            if hasattr(os, "posix_fallocate"):
                os.posix_fallocate(file.fileno(), 0, size + _SPARE_ROOM)
    finally:
        probe.unlink(missing_ok=True)


def _copy_static(old: h5py.Group, new: h5py.Group, where: str, series: set[str]) -> None:
    for key, value in old.attrs.items():
        new.attrs.create(key, value)
    for name, item in old.items():
        path = f"{where}{name}"
        if path in series or path in ("VTKHDF/Steps", WRITTEN):
            continue
        if isinstance(item, h5py.Group):
            _copy_static(item, new.require_group(name), f"{path}/", series)
        else:
            old.copy(item, new, name)


def _reserve(file: h5py.File, series: Series, shape: tuple[int, ...]) -> h5py.Dataset:
    parent, _, name = series.path.rpartition("/")
    if 0 in shape:
        return file.create_dataset(series.path, shape, series.dtype)
    properties = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    properties.set_layout(h5py.h5d.CONTIGUOUS)
    properties.set_alloc_time(h5py.h5d.ALLOC_TIME_EARLY)
    properties.set_fill_time(h5py.h5d.FILL_TIME_NEVER)
    kind = h5py.h5t.py_create(np.dtype(series.dtype))
    group = file.require_group(parent)
    made = h5py.h5d.create(group.id, name.encode(), kind, h5py.h5s.create_simple(shape), dcpl=properties)
    return h5py.Dataset(made)


def _write_steps(file: h5py.File, layout: Layout, written: int) -> None:
    """Write VTKHDF/Steps: where each step's rows begin. Equal columns are one dataset under several names."""
    steps = file.create_group("VTKHDF/Steps")
    steps.attrs.create("NSteps", written, dtype="<i8")
    steps["Values"] = file[TIMES]
    index = np.arange(written, dtype=np.int64)
    steps["PartOffsets"] = np.zeros(written, dtype=np.int64)
    steps["NumberOfParts"] = np.ones(written, dtype=np.int64)
    steps["PointOffsets"] = index * layout.points
    for name in ("CellOffsets", "ConnectivityIdOffsets"):
        steps[name] = steps["PartOffsets"]
    steps.create_group("PointDataOffsets")
    steps["PointDataOffsets/body"] = steps["PartOffsets"]
    steps["CellDataOffsets/det_F"] = index * layout.cells
    steps["CellDataOffsets/body"] = steps["PartOffsets"]
    for series in layout.series:
        _, group, *name = series.path.split("/")
        if group == "PointData":
            steps[f"PointDataOffsets/{name[0]}"] = steps["PointOffsets"]
        elif group == "CellData" and name[0] != "det_F":
            steps[f"CellDataOffsets/{name[0]}"] = steps["CellDataOffsets/det_F"]


def _dataset(file: h5py.File, path: str) -> h5py.Dataset:
    item = file[path]
    assert isinstance(item, h5py.Dataset)
    return item


def _place(file: h5py.File, series: Series) -> int:
    offset = _dataset(file, series.path).id.get_offset()
    return 0 if offset is None else int(offset)
