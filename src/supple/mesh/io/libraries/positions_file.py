"""The positions of all frames of a series, written to a file frame by frame."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.mesh.io.cells import FormatError

_MOST_BYTES = 2**35

Facts = tuple[dict[str, Any], dict[str, Any]]


def written_series(
    out: Path,
    frames: int,
    points_of: Callable[[int], NDArray[Any] | str],
    cells: dict[str, Any],
    names: list[str],
    notes: list[str],
) -> Facts:
    """Facts and arrays of a series, of which the positions are written.

    Parameters
    ----------
    points_of : the points (n, 3) of a frame, or what differs in it from the first frame
    cells : arrays "tets", "triangles" and "part", and "times" where they are known
    names : of the parts; notes : what was left out
    """
    first = points_of(0)
    if isinstance(first, str):
        raise FormatError(f"its first frame: {first}")
    if len(first) == 0 or len(cells["tets"]) + len(cells["triangles"]) == 0:
        raise FormatError("it has neither tetrahedra nor triangles")
    if frames * first.size * 8 > _MOST_BYTES:
        raise FormatError(f"its {frames} frames of {len(first)} points are more than 32 GiB: save fewer frames")
    for name, width in (("tets", 4), ("triangles", 3)):
        rows = cells[name]
        if len(rows) and not (rows.min() >= 0 and rows.max() < len(first)):
            raise FormatError(f"one of its {name} names a point outside of 0 to {len(first) - 1}")
        cells[name] = rows.reshape(-1, width)
    file = np.lib.format.open_memmap(out, "w+", np.dtype(np.float64), (frames, len(first), 3))
    others: dict[int, str] = {}
    for k in range(frames):
        x = first if k == 0 else points_of(k)
        if isinstance(x, str):
            others[k] = x
        elif x.shape != first.shape:
            others[k] = f"{len(x)} points, not {len(first)}"
        else:
            file[k] = x
    file.flush()
    return {"names": names, "others": others, "notes": notes}, cells
