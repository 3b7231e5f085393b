"""STL, ASCII and binary: triangles without shared vertices."""

from __future__ import annotations

import logging
import struct
from array import array

import numpy as np
from numpy.typing import NDArray

from supple.mesh.io.cells import TRIANGLE, CellSoup, FormatError
from supple.mesh.io.text import decoded, meaningful_lines, numbers, shortened, without_mark

logger = logging.getLogger(__name__)

RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def read(data: bytes) -> CellSoup:
    """Triangles of an STL file. Binary files may begin with `solid` too: the length decides first."""
    if len(data) >= 84 and len(data) == 84 + 50 * struct.unpack_from("<I", data, 80)[0]:
        return _read_binary(data)
    if without_mark(data).lstrip()[:5].lower() == b"solid" and b"\0" not in data[:512]:
        return _read_text(data)
    return _read_binary(data)


def _soup(corners: NDArray[np.float64]) -> CellSoup:
    rows = np.arange(len(corners), dtype=np.int64).reshape(-1, 3)
    return CellSoup.of_rows(corners, rows, TRIANGLE)


def _read_binary(data: bytes) -> CellSoup:
    if len(data) < 84:
        raise FormatError(f"it is neither text nor binary STL: {len(data)} bytes are too few for a header")
    (count,) = struct.unpack_from("<I", data, 80)
    if 84 + 50 * count > len(data):
        raise FormatError(
            f"its header announces {count} triangles, but there are bytes for {(len(data) - 84) // 50}: "
            "it is truncated, or not an STL file"
        )
    if 84 + 50 * count < len(data):
        logger.warning(
            "%d bytes after the last triangle of a binary STL file were ignored", len(data) - 84 - 50 * count
        )
    records = np.frombuffer(data, dtype=RECORD, count=count, offset=84)
    with np.errstate(invalid="ignore"):  # of damaged numbers, which the mesh refuses
        corners = records["corners"].reshape(-1, 3).astype(np.float64)
    return _soup(corners)


def _read_text(data: bytes) -> CellSoup:
    corners = array("d")
    line = 0
    for line, words in meaningful_lines(decoded(data)):
        keyword = words[0].lower()
        if keyword == "vertex":
            corners.extend(numbers(words[1:], 3, line, "vertex"))
        elif keyword == "endloop":
            if len(corners) == 0 or len(corners) % 9:
                raise FormatError("the loop that ends here does not have three vertices", line)
        elif keyword not in ("solid", "facet", "outer", "endfacet", "endsolid", "end"):
            raise FormatError(f"'{shortened(words)}' does not belong in an STL file", line)
    if len(corners) % 9:
        raise FormatError("the file ends inside a triangle: it is truncated", line)
    return _soup(np.array(corners).reshape(-1, 3))


def written(vertices: NDArray[np.float64], triangles: NDArray[np.int32]) -> bytes:
    """Binary STL, in single precision, the only one of the format."""
    corners = vertices[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    records = np.zeros(len(triangles), dtype=RECORD)
    records["normal"] = normals / np.where(lengths > 0.0, lengths, 1.0)
    records["corners"] = corners
    return b"binary STL written by supple".ljust(80) + struct.pack("<I", len(triangles)) + records.tobytes()
