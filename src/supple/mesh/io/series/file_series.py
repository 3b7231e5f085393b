"""Series of files: one file for each frame, or one for each part and frame."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from supple.errors import MeshError
from supple.mesh.io.cells import CellSoup, FormatError
from supple.mesh.io.mesh_files import located, read_contents
from supple.mesh.io.series.series import Cells, OtherCells, Series
from supple.mesh.io.splitting import cells_of

MAX_FRAMES = 1_000_000


class FileSeries(Series):
    """Frames of which each one is read from its files when it is asked for.

    Parameters
    ----------
    path : as the user gave it
    frames : for each frame the file of each part
    names : of the parts; times, numbers : see `Series`
    """

    def __init__(
        self,
        path: Path,
        frames: Sequence[Sequence[Path]],
        names: Sequence[str],
        times: NDArray[np.float64] | None = None,
        numbers: NDArray[np.int64] | None = None,
    ) -> None:
        self.path, self._frames, self.times, self.numbers = path, frames, times, numbers
        self._first = [soup_of(file) for file in frames[0]]
        tets, triangles, part, count = [], [], [], 0
        for k, (file, soup) in enumerate(zip(frames[0], self._first, strict=True)):
            try:
                own = cells_of(soup)
            except FormatError as error:
                raise located(file, error) from None
            tets.append(own[0] + count)
            triangles.append(own[1] + count)
            part.append(np.full(len(soup.points), k))
            count += len(soup.points)
        parts = tuple(names)
        self.cells = Cells(count, np.concatenate(tets), np.concatenate(triangles), np.concatenate(part), parts)

    def __len__(self) -> int:
        return len(self._frames)

    def positions(self, frame: int) -> NDArray[np.float64]:
        if frame == 0:
            return np.concatenate([soup.points for soup in self._first])
        points = []
        for file, first in zip(self._frames[frame], self._first, strict=True):
            if not file.exists():
                raise OtherCells(f"{file.name} is missing")
            soup = soup_of(file)
            if len(soup.points) != len(first.points):
                raise OtherCells(f"{file.name} has {len(soup.points)} points, not {len(first.points)}")
            if len(soup.types) != len(first.types):
                raise OtherCells(f"{file.name} has {len(soup.types)} cells, not {len(first.types)}")
            same = zip(soup[1:], first[1:], strict=True)
            if not all(np.array_equal(own, other) for own, other in same):
                raise OtherCells(f"{file.name} joins its points to other cells than the first frame")
            points.append(soup.points)
        return np.concatenate(points)


def soup_of(path: Path) -> CellSoup:
    """The points and cells of a file, as its reader for the extension finds them."""
    soup = read_contents(path).soup
    if len(soup.points) == 0:
        raise MeshError(f"{path}: it has no points")
    return soup
