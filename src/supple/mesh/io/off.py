"""Object File Format (Geomview's OFF), ASCII, with or without colours."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.mesh.io.cells import CellSoup, FormatError
from supple.mesh.io.text import decoded, integer, meaningful_lines, numbers, shortened


def read(data: bytes) -> CellSoup:
    """Polygons of an OFF file."""
    lines = meaningful_lines(decoded(data))
    line, words = next(lines, (1, ["nothing"]))
    if words[0] not in ("OFF", "COFF", "NOFF", "CNOFF", "STOFF"):
        raise FormatError(f"it begins with '{shortened(words)}' instead of 'OFF'", line)
    counts = words[1:]
    if counts and counts[0].upper() == "BINARY":
        raise FormatError("binary OFF cannot be read; save it as text, or as PLY", line)
    if not counts:
        line, counts = next(lines, (line, []))
    if len(counts) < 2:
        raise FormatError("the counts of vertices and faces are missing", line)
    n, m = integer(counts[0], line, "vertex count"), integer(counts[1], line, "face count")
    if n < 0 or m < 0 or n + m > len(data):
        raise FormatError(f"{n} vertices and {m} faces cannot be in a file of {len(data)} bytes", line)
    points: list[list[float]] = []
    polygons: list[list[int]] = []
    for line, words in lines:
        if len(points) < n:
            points.append(numbers(words, 3, line, "vertex"))
        elif len(polygons) < m:
            polygons.append(_face(words, n, line))
    if len(points) < n or len(polygons) < m:
        raise FormatError(
            f"it ends after {len(points)} of {n} vertices and {len(polygons)} of {m} faces: it is truncated", line
        )
    return CellSoup.of_polygons(np.array(points, dtype=np.float64).reshape(-1, 3), polygons)


def _face(words: list[str], n: int, line: int) -> list[int]:
    size = integer(words[0], line, "number of corners")
    if size < 3 or len(words) < size + 1:
        raise FormatError(f"face announces {size} corners and lists {len(words) - 1}; it needs at least three", line)
    corners = [integer(word, line, "face index") for word in words[1 : size + 1]]
    if min(corners) < 0 or max(corners) >= n:
        raise FormatError(
            f"face names a vertex that does not exist: '{shortened(words)}'; indices run to {n - 1}", line
        )
    return corners


def written(vertices: NDArray[np.float64], triangles: NDArray[np.int32]) -> bytes:
    """OFF text with every digit."""
    lines = ["OFF", f"{len(vertices)} {len(triangles)} 0"]
    lines += ["{!r} {!r} {!r}".format(*row) for row in vertices.tolist()]
    lines += ["3 {} {} {}".format(*row) for row in triangles.tolist()]
    return ("\n".join(lines) + "\n").encode()
