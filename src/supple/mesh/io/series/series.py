"""A series of frames: cells that all frames share, and for each frame the positions of their points."""

from __future__ import annotations

from abc import ABC, abstractmethod
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray


class OtherCells(Exception):
    """A frame has other cells than the first one; the text says what differs."""


class Cells(NamedTuple):
    """What all frames share.

    Attributes
    ----------
    count : number of points; tets : (m, 4); triangles : (t, 3), of surfaces that are given as such
    part : (count,) the number of the named part that each point belongs to; names : of the parts, "" without one
    """

    count: int
    tets: NDArray[np.int64]
    triangles: NDArray[np.int64]
    part: NDArray[np.int64]
    names: tuple[str, ...]


class Series(ABC):
    """Frames from files of any program.

    Attributes
    ----------
    path : as the user gave it; cells : see `Cells`
    times : (frames,) [s], or None where the files have none
    numbers : (frames,) whole numbers in the names of files, or None
    masses : (count,) of the points [kg], or None
    notes : what was left out or assumed, one sentence each
    """

    path: Path
    cells: Cells
    times: NDArray[np.float64] | None = None
    numbers: NDArray[np.int64] | None = None
    masses: NDArray[np.float64] | None = None
    notes: tuple[str, ...] = ()

    @abstractmethod
    def __len__(self) -> int:
        """How many frames there are."""

    @abstractmethod
    def positions(self, frame: int) -> NDArray[np.float64]:
        """(count, 3) of a frame.

        Raises
        ------
        OtherCells : where the frame has other cells than the first one.
        MeshError : where its file cannot be read.
        """


class ArraySeries(Series):
    """Frames that lie in one array (frames, n, 3), which may be mapped from a file."""

    def __init__(self, path: Path, cells: Cells, frames: NDArray[Any], times: NDArray[np.float64] | None) -> None:
        self.path, self.cells, self.times, self._frames = path, cells, times, frames
        self.others: dict[int, str] = {}

    def __len__(self) -> int:
        return len(self._frames)

    def positions(self, frame: int) -> NDArray[np.float64]:
        if frame in self.others:
            raise OtherCells(self.others[frame])
        return np.array(self._frames[frame], dtype=np.float64)
