"""A VTKHDF file that is valid at every moment, also when its writer is killed.

The HDF5 library alone does not guarantee this (notes/decisions.md, 4). Therefore it first lays out the whole file, with
room for many frames, and closes it. Every series of frames then has a fixed position ("contiguous" layout), and a frame
is written there as plain bytes. The last writes of a frame are a few numbers of eight bytes: our count of frames, and
the same number as the `NSteps` attribute and as the lengths of the series in VTKHDF/Steps, for VTK, which allows no
more entries than steps. Room that is not used takes no disk space where the file system supports holes.

When the room is used up, the file is copied to a file with twice the room, which then replaces it.

Sources: VTKHDF file format 2.x (docs.vtk.org); HDF5 file format specification 3.0, sections IV.A.1.a (object header,
version 1) and IV.A.2.b (dataspace message, version 1).
"""

from __future__ import annotations

import copy
import errno
import mmap
import os
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import h5py
import h5py.h5o
import numpy as np
from numpy.typing import ArrayLike

from supple.errors import OutputError
from supple.runtime.replacing import put_in_place, temporary_name

WRITTEN = "supple/frames_written"
STEP_TIMES, _TIMES = "VTKHDF/Steps/Values", "supple/frames/time"
_STEPS_MARK = 0x7375_7070_6C65_2121  # the value of NSteps until its position is known
_COPY_BYTES = 1 << 20  # more would remain in the memory of the process
_STEP_COLUMNS = 5  # different columns in VTKHDF/Steps
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
    """What a recording's frames hold, and how many points and tets each has."""

    points: int
    tets: int
    series: tuple[Series, ...]

    @property
    def frame_bytes(self) -> int:
        return sum(series.frame_bytes for series in self.series)


class RecordingFile:
    """Writes frames to their positions in a file that `create` laid out.

    Parameters
    ----------
    path : the file; layout : of its frames; capacity : how many frames it has room for; written : how many it has.
    """

    def __init__(self, path: Path, layout: Layout, capacity: int, written: int = 0) -> None:
        self.path, self.layout, self.capacity, self.written = path, layout, capacity, written
        with h5py.File(path, "r") as file:
            self._series = {s.path: (s, _place(file, s)) for s in layout.series}
            self._counter = _dataset(file, WRITTEN).id.get_offset()
            header = h5py.h5o.get_info(file["VTKHDF/Steps"].id).addr
            lengths = {h5py.h5o.get_info(item.id).addr for item in _step_datasets(file)}
        self._file: BinaryIO = open(path, "r+b", buffering=0)  # noqa: SIM115
        self._steps = _place_of_mark(self._file, header)
        self._lengths = sorted(_place_of_length(self._file, address, capacity) for address in lengths)

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
        """Write the number of frames to every position that stores it."""
        number = self.written.to_bytes(8, "little")
        # NSteps before the lengths: VTK can read series that are shorter than the number of steps, but not longer ones.
        for place in (self._counter, self._steps, *self._lengths):
            self._write(place, number)

    @property
    def is_in_place(self) -> bool:
        """Whether `path` still leads to this file: writing to one that was deleted is no error of the system."""
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
    """Lay out a file with room for `capacity` frames and no frame; `write_static` adds all that does not change."""
    # A draft in memory gives the size.
    with h5py.File(path, "w", driver="core", backing_store=False) as draft:
        write_static(draft)
        draft.flush()
        static_bytes = len(draft.id.get_file_image())
    fixed = static_bytes + _STEP_COLUMNS * 8 * capacity
    _require_room(path, fixed + layout.frame_bytes, length=fixed + layout.frame_bytes * capacity)
    with h5py.File(path, "w", libver=("earliest", "v110")) as file:
        _write_step_count(file, _STEPS_MARK)
        write_static(file)
        file.create_dataset(WRITTEN, data=np.int64(0))
        for series in layout.series:
            _reserve(file, series, series.shape(capacity))
        _write_steps(file, layout, capacity)


def rewrite(source: Path, target: Path, layout: Layout, capacity: int | None, *, compress: bool = False) -> None:
    """Copy the complete frames of a recording to a file with another capacity; None leaves no room for more frames.

    With `compress`, the series are stored in gzip chunks, one per frame; nothing can be added to them then.

    Raises
    ------
    OSError : where there is no room.
    RuntimeError, TypeError, ValueError, KeyError : from HDF5, where the source is damaged.
    """
    fixed = _STEP_COLUMNS * 8 * (capacity or 1)
    _require_room(target, fixed, length=fixed + layout.frame_bytes * (capacity or 0))
    with h5py.File(source, "r", locking=False) as old, h5py.File(target, "w", libver=("earliest", "v110")) as new:
        written = int(_dataset(old, WRITTEN)[()])
        present = [series for series in layout.series if series.path in old]  # earlier versions wrote fewer
        _write_step_count(new, _STEPS_MARK if capacity else written)
        _copy_static(old, new, "", {series.path for series in present})
        new.create_dataset(WRITTEN, data=np.int64(written))
        for series in present:
            # Where the writer was killed between two writes, VTK's copy of the times can be one frame short.
            source_data = _dataset(old, _TIMES if series.path == STEP_TIMES else series.path)
            rows = written * series.rows
            shape = (max(rows, (capacity or 0) * series.rows), *series.row_shape)
            if compress and 0 not in shape:
                chunk = (series.rows if series.rows > 1 else min(rows, 1024), *series.row_shape)
                data = new.create_dataset(
                    series.path, shape, series.dtype, chunks=chunk, compression="gzip", compression_opts=4, shuffle=True
                )
            else:
                data = _reserve(new, series, shape)
            step = max(1, _COPY_BYTES // max(1, series.frame_bytes)) * series.rows
            for row in range(0, rows if 0 not in shape else 0, step):
                _require_room(target, step * series.frame_bytes // max(1, series.rows))
                data[row : min(row + step, rows)] = source_data[row : min(row + step, rows)]
        _write_steps(new, layout, capacity or written)


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
            _require_room(Path(new.file.filename), item.id.get_storage_size())
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


def _write_step_count(file: h5py.File, value: int) -> None:
    """Write NSteps, before everything else: HDF5 then stores its value near the header of the group."""
    file.require_group("VTKHDF/Steps").attrs.create("NSteps", value, dtype="<i8")


def _write_steps(file: h5py.File, layout: Layout, capacity: int) -> None:
    """Write VTKHDF/Steps: where each step's rows begin. Equal columns are one dataset under several names."""
    steps = file.require_group("VTKHDF/Steps")
    index = np.arange(capacity, dtype=np.int64)
    steps["PartOffsets"] = np.zeros(capacity, dtype=np.int64)
    steps["NumberOfParts"] = np.ones(capacity, dtype=np.int64)
    steps["PointOffsets"] = index * layout.points
    for name in ("CellOffsets", "ConnectivityIdOffsets"):
        steps[name] = steps["PartOffsets"]
    steps.create_group("PointDataOffsets")
    steps["PointDataOffsets/body"] = steps["PartOffsets"]
    steps["CellDataOffsets/det_F"] = index * layout.tets
    steps["CellDataOffsets/body"] = steps["PartOffsets"]
    for series in layout.series:
        _, group, *name = series.path.split("/")
        if group == "PointData":
            steps[f"PointDataOffsets/{name[0]}"] = steps["PointOffsets"]
        elif group == "CellData" and name[0] != "det_F":
            steps[f"CellDataOffsets/{name[0]}"] = steps["CellDataOffsets/det_F"]


def _step_datasets(file: h5py.File) -> list[h5py.Dataset]:
    found: list[h5py.Dataset] = []
    file["VTKHDF/Steps"].visititems(lambda _, item: found.append(item) if isinstance(item, h5py.Dataset) else None)  # pyright: ignore[reportAttributeAccessIssue]
    # An object with several hard links is visited once.
    return found


def _dataset(file: h5py.File, path: str) -> h5py.Dataset:
    item = file[path]
    assert isinstance(item, h5py.Dataset)
    return item


def _place(file: h5py.File, series: Series) -> int:
    offset = _dataset(file, series.path).id.get_offset()
    return 0 if offset is None else int(offset)


def _place_of_mark(file: BinaryIO, header: int) -> int:
    """Where the value of NSteps is: near the object header of the group, or in a continuation of it elsewhere."""
    mark = _STEPS_MARK.to_bytes(8, "little")
    near = max(0, header - (1 << 20))
    file.seek(near)
    block = file.read(1 << 21)
    if block.count(mark) == 1:
        return near + block.index(mark)
    with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as whole:
        place = whole.find(mark)
        if place < 0 or whole.find(mark, place + 1) >= 0:
            raise OutputError(f"{file.name}: HDF5 wrote NSteps in an unknown layout; install another version of h5py")
    return place


def _place_of_length(file: BinaryIO, header: int, length: int) -> int:
    """Where the length of a one-dimensional dataset is: in the first message of its object header."""
    file.seek(header)
    block = file.read(40)
    known = block[0] == 1 and block[16:18] == b"\x01\x00" and block[24:26] == b"\x01\x01"
    if not known or int.from_bytes(block[32:40], "little") != length:
        raise OutputError(f"{file.name}: HDF5 wrote a length in an unknown layout; install another version of h5py")
    return header + 32
