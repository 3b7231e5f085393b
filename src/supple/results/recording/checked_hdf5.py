"""An HDF5 file from an unknown source: every array is checked before it is read."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from supple.errors import OutputError
from supple.results.recording.file import Series

# An HDF5 header can claim more data than the file contains. gzip compresses at most 1032 to one, so that a claim beyond
# this factor is wrong.
_MOST_EXPANSION = 1100


def is_of_another_program(path: Path) -> bool:
    """Whether a file is VTKHDF that Supple did not write."""
    try:
        with h5py.File(path, "r", locking=False) as file:
            return "VTKHDF" in file and "supple" not in file
    except (OSError, RuntimeError, ValueError):
        return False


class CheckedFile:
    """A file, opened for reading. Its errors name the file, what is wrong with it, and the remedy.

    Raises
    ------
    OutputError : where it is missing, a folder, cut off or not HDF5.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        if not path.exists():
            raise OutputError(f"{path}: the file does not exist; a simulation writes one with Recorder, or supple run")
        if path.is_dir():
            raise OutputError(f"{path}: is a folder; give the recording in it, such as {path / 'recording.vtkhdf'}")
        try:
            self._bytes = path.stat().st_size
            # No lock: another process may be writing the file, which its layout allows.
            self._file = h5py.File(path, "r", locking=False)
        except PermissionError:
            raise OutputError(f"{path}: cannot be read: permission denied") from None
        except (OSError, RuntimeError, ValueError) as error:
            raise self._not_opened(str(error)) from None

    def _not_opened(self, reason: str) -> OutputError:
        try:
            with self.path.open("rb") as file:
                start = file.read(8)
        except OSError as error:
            return OutputError(f"{self.path}: cannot be read: {error.strerror or error}")
        if not start:
            return OutputError(f"{self.path}: is empty; record the simulation again")
        if start != b"\x89HDF\r\n\x1a\n":
            return OutputError(
                f"{self.path}: is not a recording: it is not an HDF5 file; give a .vtkhdf that Supple wrote"
            )
        if "truncated" in reason:
            return OutputError(f"{self.path}: is cut off: it has only {self._bytes} bytes; copy all of it again")
        return self.broken(" ".join(reason.split()))

    def broken(self, what: str) -> OutputError:
        """The error for contradictory contents."""
        return OutputError(f"{self.path}: is damaged: {what}; copy or record it again")

    def of_another_version(self, what: str) -> OutputError:
        """The error for contents that this version does not write."""
        return OutputError(f"{self.path}: was written by another version ({what}); simulate it again")

    def other(self, what: str) -> OutputError:
        """The error for a file of another kind."""
        return OutputError(f"{self.path}: is not a recording of Supple: {what}; give a .vtkhdf that Supple wrote")

    def attribute(self, path: str, name: str) -> Any:
        """An attribute, or None where it does not exist."""
        try:
            return self._file[path].attrs.get(name)
        except (KeyError, OSError, RuntimeError, ValueError):
            return None

    def dataset(self, path: str) -> h5py.Dataset:
        """A dataset, which must exist."""
        try:
            item = self._file[path]
        except (KeyError, OSError, RuntimeError, ValueError):
            raise self.broken(f"{path} is missing") from None
        if not isinstance(item, h5py.Dataset):
            raise self.broken(f"{path} is not a dataset")
        return item

    def text(self, path: str) -> str:
        """A text."""
        dataset = self.dataset(path)
        try:
            short = dataset.shape == () and self._length_of_text(dataset) <= self._bytes
            value = dataset[()] if short else None
        except (OSError, RuntimeError, ValueError):
            value = None
        if not isinstance(value, bytes):
            raise self.broken(f"{path} is not a text")
        return value.decode("utf-8", errors="replace")

    def _length_of_text(self, dataset: h5py.Dataset) -> int:
        """The length that the file gives for a text; HDF5 takes memory for it before it reads."""
        place = dataset.id.get_offset()
        if place is None or dataset.dtype.kind != "O":
            return dataset.dtype.itemsize
        with self.path.open("rb") as file:
            file.seek(place)
            return int.from_bytes(file.read(4), "little")

    def array(self, path: str) -> NDArray[Any]:
        """A whole array of numbers."""
        dataset = self.dataset(path)
        if dataset.dtype.kind not in "biuf":
            raise self.broken(f"{path} holds {dataset.dtype}")
        self._check_size(path, dataset.size * dataset.dtype.itemsize)
        values = self._load(dataset, path, ())
        return values.astype(values.dtype.newbyteorder("="), copy=False)

    def check_series(self, series: Series, frames: int) -> h5py.Dataset:
        """The dataset of a series, which has the rows of at least this many frames."""
        dataset = self.dataset(series.path)
        got, needed = dataset.shape or (), series.shape(frames)
        if got[1:] != needed[1:] or not got[:1] >= needed[:1]:
            raise self.broken(f"{series.path} has shape {got}; {frames} frames need {needed}")
        if dataset.dtype.kind != np.dtype(series.dtype).kind:
            raise self.broken(f"{series.path} holds {dataset.dtype}")
        self._check_size(series.path, series.frame_bytes)
        return dataset

    def rows(self, series: Series, begin: int, end: int, what: str) -> NDArray[Any]:
        """The rows of the frames from `begin` to `end`; an error calls them `what`."""
        dataset = self.check_series(series, end)
        self._check_size(series.path, (end - begin) * series.frame_bytes)
        return self._load(dataset, what, slice(begin * series.rows, end * series.rows))

    def close(self) -> None:
        self._file.close()

    def _check_size(self, path: str, size: int) -> None:
        if size > _MOST_EXPANSION * self._bytes:
            raise self.broken(f"{path} claims more data than the file can contain")

    def _load(self, dataset: h5py.Dataset, what: str, rows: Any) -> NDArray[Any]:
        try:
            return np.asarray(dataset[rows])
        except (OSError, RuntimeError, ValueError) as error:
            raise self.broken(f"{what} cannot be read ({' '.join(str(error).split())})") from None
