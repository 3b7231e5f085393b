"""VTKHDF of other programs: UnstructuredGrid and PolyData with steps.

Source: "VTKHDF File Format" of the VTK documentation, versions 1 and 2.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.mesh.io.cells import POLYGON, TRIANGLE_STRIP, CellSoup, FormatError
from supple.mesh.io.libraries.positions_file import Facts, written_series
from supple.mesh.io.splitting import cells_of

_KINDS = {"Polygons": POLYGON, "Strips": TRIANGLE_STRIP}


def read_series(path: Path, out: Path) -> Facts:
    """All steps; of several pieces, all together."""
    import h5py

    try:
        return _read(h5py.File(path, "r", locking=False), out)
    except OSError as error:
        raise FormatError(f"it is damaged: {' '.join(str(error).split())}") from None


def _read(opened: Any, out: Path) -> Facts:
    with opened as file:
        if "VTKHDF" not in file:
            raise FormatError("it is an HDF5 file without a group VTKHDF")
        root = file["VTKHDF"]
        kind = root.attrs.get("Type", b"")
        kind = kind.decode() if isinstance(kind, bytes) else str(kind)
        if kind not in ("UnstructuredGrid", "PolyData"):
            raise FormatError(f"it is a VTKHDF {kind[:40]}; an UnstructuredGrid or PolyData can be checked")
        steps = _Steps(root)
        first = _soup(root, steps, 0, kind)
        tets, triangles = cells_of(first)

        def points_of(k: int) -> NDArray[Any] | str:
            if k and steps.moves_cells:
                soup = _soup(root, steps, k, kind)
                if not all(np.array_equal(a, b) for a, b in zip(soup[1:], first[1:], strict=True)):
                    return "it has other cells"
                return soup.points
            return steps.points(k)

        cells = {"tets": tets, "triangles": triangles, "part": np.zeros(len(first.points), dtype=np.int64)}
        if steps.times is not None:
            cells["times"] = steps.times
        return written_series(out, steps.count, points_of, cells, [""], [])


class _Steps:
    """Where the pieces of each step begin."""

    def __init__(self, root: Any) -> None:
        self._root = root
        group = root.get("Steps")
        self.count = 1 if group is None else int(group.attrs["NSteps"])
        self.times = None if group is None else np.asarray(group["Values"], dtype=np.float64)[: self.count]
        self.sizes = np.asarray(root["NumberOfPoints"], dtype=np.int64).ravel()
        if self.count < 1 or (self.times is not None and len(self.times) != self.count):
            raise FormatError("its number of steps is not that of their times")

        def of(name: str, without: int) -> NDArray[np.int64]:
            if group is None or name not in group:
                return np.full(self.count, without)
            return np.asarray(group[name], dtype=np.int64)[: self.count].reshape(self.count, -1)[:, 0]

        self.part = of("PartOffsets", 0)
        self.parts = of("NumberOfParts", len(self.sizes) if group is None else 1)
        self.point, self.cell, self.flat = of("PointOffsets", 0), of("CellOffsets", 0), of("ConnectivityIdOffsets", 0)
        self.moves_cells = any(len(np.unique(rows)) > 1 for rows in (self.part, self.cell, self.flat))

    def pieces(self, k: int) -> range:
        return range(int(self.part[k]), int(self.part[k] + self.parts[k]))

    def points(self, k: int) -> NDArray[np.float64]:
        count = int(self.sizes[self.part[k] : self.part[k] + self.parts[k]].sum())
        begin = int(self.point[k])
        return np.asarray(self._root["Points"][begin : begin + count], dtype=np.float64)


def _soup(root: Any, steps: _Steps, k: int, kind: str) -> CellSoup:
    blocks, start = [], 0
    cell, flat = int(steps.cell[k]), int(steps.flat[k])
    for piece in steps.pieces(k):
        groups = [(root, None)] if kind == "UnstructuredGrid" else [(root[name], _KINDS[name]) for name in _KINDS]
        for group, fixed in groups:
            cells = int(group["NumberOfCells"][piece])
            ids = int(group["NumberOfConnectivityIds"][piece])
            if cells == 0:
                continue
            # A piece has one more offset than cells.
            ends = np.asarray(group["Offsets"][cell + piece - steps.pieces(k)[0] + _extra(steps, k) :][: cells + 1])
            own = np.asarray(group["Connectivity"][flat : flat + ids], dtype=np.int64) + start
            types = np.asarray(group["Types"][cell : cell + cells]) if fixed is None else fixed
            if len(ends) != cells + 1 or len(own) != ids or int(ends[-1]) != ids:
                raise FormatError("its offsets contradict its cells: it is damaged")
            blocks.append((types, np.diff(ends.astype(np.int64)), own))
            if fixed is None:
                cell, flat = cell + cells, flat + ids
        start += int(steps.sizes[piece])
    return CellSoup.of_blocks(steps.points(k), blocks)


def _extra(steps: _Steps, k: int) -> int:
    """How many pieces lie before those of a step, each of which has one more offset."""
    return int(steps.part[k])
