"""Wavefront OBJ: positions and faces; normals, texture coordinates, materials and groups are ignored."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.mesh.io.cells import CellSoup, FormatError
from supple.mesh.io.text import decoded, integer, meaningful_lines, numbers


def read(data: bytes) -> CellSoup:
    """Polygons of an OBJ file; indices may be negative (counted from the last vertex)."""
    points: list[list[float]] = []
    polygons: list[list[int]] = []
    # A backslash at a line's end continues the line. Later line numbers are too small by the number of joins.
    text = decoded(data).replace("\r\n", "\n").replace("\\\n", " ")
    for line, words in meaningful_lines(text):
        if words[0] == "v":
            points.append(numbers(words[1:], 3, line, "vertex"))
        elif words[0] == "f":
            polygons.append(_face(words[1:], len(points), line))
    if not points:
        raise FormatError("it has no vertices (lines 'v x y z'); is it an OBJ file?")
    soup = CellSoup.of_polygons(np.array(points, dtype=np.float64), polygons)
    outside = soup.connectivity >= len(points)
    if outside.any():
        k = int(np.searchsorted(soup.offsets, np.flatnonzero(outside)[0], side="right")) - 1
        raise FormatError(
            f"face {k} names vertex {max(polygons[k]) + 1}, but there are {len(points)} (indices start at 1)"
        )
    return soup


def _face(words: list[str], count: int, line: int) -> list[int]:
    if len(words) < 3:
        raise FormatError(f"face has {len(words)} corners; it needs at least three", line)
    corners = []
    for word in words:
        index = integer(word.split("/", 1)[0], line, "face index")
        if index == 0 or index < -count:
            raise FormatError(f"face names vertex {index}; indices start at 1, or run from -1 back to -{count}", line)
        corners.append(index - 1 if index > 0 else count + index)
    return corners


def written(vertices: NDArray[np.float64], triangles: NDArray[np.int32]) -> bytes:
    """OBJ text with every digit."""
    lines = ["# written by supple"]
    lines += ["v {!r} {!r} {!r}".format(*row) for row in vertices.tolist()]
    lines += ["f {} {} {}".format(*row) for row in (triangles + 1).tolist()]
    return ("\n".join(lines) + "\n").encode()
