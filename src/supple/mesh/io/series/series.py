"""A series of frames: cells that all frames share, and for each frame the positions of their points."""

from __future__ import annotations

from abc import ABC, abstractmethod
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.mesh.io.cells import (
    CELL_NAMES,
    QUADRATIC_EDGE,
    QUADRATIC_TETRA,
    QUADRATIC_TRIANGLE,
    TETRA,
    CellSoup,
    FormatError,
    checked,
)
from supple.mesh.io.polygons import SURFACE_TYPES, triangles_of

_CORNERS = {QUADRATIC_TRIANGLE: 3, TETRA: 4, QUADRATIC_TETRA: 4}


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
    notes : what was left out or assumed, one sentence each
    """

    path: Path
    cells: Cells
    times: NDArray[np.float64] | None = None
    numbers: NDArray[np.int64] | None = None
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


def cells_of(soup: CellSoup) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The tets (m, 4) and triangles (t, 3) of a soup; of quadratic cells the corners."""
    soup = checked(soup)
    known = np.isin(soup.types, (*SURFACE_TYPES, *_CORNERS, QUADRATIC_EDGE)) | (soup.types <= 4)
    if not known.all():
        kind = int(soup.types[~known][0])
        raise FormatError(
            f"it has {CELL_NAMES.get(kind, f'type {kind}')} cells; tetrahedra and surfaces can be checked: convert it"
        )
    tets = np.concatenate([_corners(soup, kind) for kind in (TETRA, QUADRATIC_TETRA)])
    flat = np.isin(soup.types, SURFACE_TYPES)
    triangles = _corners(soup, QUADRATIC_TRIANGLE)
    if flat.any():
        rows = np.flatnonzero(flat)
        sizes = np.diff(soup.offsets)[rows]
        chosen = np.repeat(flat, np.diff(soup.offsets))
        block = soup.types[rows], sizes, soup.connectivity[chosen]
        triangles = np.concatenate([triangles, triangles_of(CellSoup.of_blocks(soup.points, [block]))])
    if len(tets) + len(triangles) == 0:
        raise FormatError("it has neither tetrahedra nor triangles")
    return tets, triangles


def _corners(soup: CellSoup, kind: int) -> NDArray[np.int64]:
    rows = np.flatnonzero(soup.types == kind)
    width = _CORNERS[kind]
    if (np.diff(soup.offsets)[rows] < width).any():
        raise FormatError(f"a {CELL_NAMES[kind]} has fewer than {width} corners")
    return soup.connectivity[soup.offsets[rows][:, None] + np.arange(width)]
