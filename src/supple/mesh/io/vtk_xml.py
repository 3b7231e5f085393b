"""VTK's XML files: PolyData (.vtp) and UnstructuredGrid (.vtu), in every encoding but LZ4.

Source: "VTK XML Formats" of the VTK documentation.
"""

from __future__ import annotations

import base64
import binascii
import lzma
import re
import zlib
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from supple.mesh.io.cells import CELL_OF_WIDTH, POLYGON, TRIANGLE_STRIP, Block, CellSoup, FormatError
from supple.mesh.io.text import shortened

SCALARS = {
    "Int8": "i1", "UInt8": "u1", "Int16": "i2", "UInt16": "u2", "Int32": "i4", "UInt32": "u4", "Int64": "i8",
    "UInt64": "u8", "Float32": "f4", "Float64": "f8",
}  # fmt: skip
POLYDATA_TAGS = {"Verts": 2, "Lines": 4, "Strips": TRIANGLE_STRIP, "Polys": POLYGON}
CELL_ARRAYS = ("connectivity", "offsets", "types")
# Largest size of a decompressed block [bytes]; writers use 32 KiB.
MAX_BLOCK = 2**30


class _Encoding(NamedTuple):
    order: str
    header: np.dtype
    compressor: str
    appended: bytes
    appended_is_text: bool


def read(data: bytes) -> CellSoup:
    """Points and cells of a .vtp or .vtu file, all its pieces together; other data is ignored."""
    root, appended, appended_is_text = _parsed(data)
    kind = root.get("type", "")
    if root.tag != "VTKFile" or kind not in ("PolyData", "UnstructuredGrid"):
        raise FormatError(
            f"it is not a VTK file of type PolyData or UnstructuredGrid, but '{shortened([kind or root.tag])}'"
        )
    header = SCALARS.get(root.get("header_type", "UInt32"), "")
    order = ">" if root.get("byte_order") == "BigEndian" else "<"
    compressor = root.get("compressor", "")
    if header not in ("u4", "u8"):
        raise FormatError(f"header_type '{shortened([root.get('header_type', '')])}' is neither UInt32 nor UInt64")
    if compressor not in ("", "vtkZLibDataCompressor", "vtkLZMADataCompressor"):
        raise FormatError(f"its compressor {shortened([compressor])} is not supported; save it with ZLib or none")
    encoding = _Encoding(order, np.dtype(order + header), compressor, appended, appended_is_text)
    pieces = [_piece(piece, encoding) for piece in root.iter("Piece")]
    points = np.concatenate([np.empty((0, 3)), *(points for points, _ in pieces)])
    if len(points) == 0:
        raise FormatError("it has no points")
    starts = np.cumsum([0] + [len(points) for points, _ in pieces])
    blocks = [
        (types, sizes, flat + start)
        for (own, cells), start in zip(pieces, starts[:-1], strict=True)
        for types, sizes, flat in cells
        if len(own)
    ]
    return CellSoup.of_blocks(points, blocks)


def _parsed(data: bytes) -> tuple[ElementTree.Element, bytes, bool]:
    """The tree, and the appended data, which may be raw bytes that no XML parser can read."""
    appended, is_text = b"", True
    found = re.search(rb"<AppendedData[^>]*>", data)
    if found:
        is_text = b"base64" in found.group()
        start, end = data.find(b"_", found.end()), data.rfind(b"</AppendedData>")
        if start < 0 or end < start:
            raise FormatError("its appended data has no end: it is truncated")
        appended = data[start + 1 : end]
        data = data[: found.start()] + data[end + len(b"</AppendedData>") :]
    try:
        return ElementTree.fromstring(data), appended, is_text
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        position = getattr(error, "position", None)
        raise FormatError(
            "it is not well-formed XML: truncated, or not a VTK XML file", position and position[0]
        ) from None


def _piece(piece: ElementTree.Element, encoding: _Encoding) -> tuple[NDArray[np.float64], list[Block]]:
    array = piece.find("Points/DataArray")
    points = np.empty((0, 3)) if array is None else _values(array, encoding).astype(np.float64)
    try:
        count = int(piece.get("NumberOfPoints", ""))
    except ValueError:
        raise FormatError("its Piece has no valid NumberOfPoints") from None
    if points.size != 3 * count:
        raise FormatError(f"it announces {piece.get('NumberOfPoints')} points and holds {points.size} coordinates")
    blocks: list[Block] = []
    for tag, cell_type in (*POLYDATA_TAGS.items(), ("Cells", 0)):
        block = piece.find(tag)
        if block is None or not len(block):
            continue
        arrays = {
            a.get("Name", ""): _values(a, encoding) for a in block.findall("DataArray") if a.get("Name") in CELL_ARRAYS
        }
        if not arrays.keys() >= {*CELL_ARRAYS[: 3 if tag == "Cells" else 2]}:
            raise FormatError(f"its {tag} lack 'connectivity', 'offsets' or 'types'")
        flat, ends = arrays["connectivity"].astype(np.int64), arrays["offsets"].astype(np.int64)
        types = arrays["types"] if tag == "Cells" else np.full(len(ends), cell_type)
        sizes = np.diff(ends, prepend=0)
        if len(types) != len(ends) or (sizes < 0).any() or sizes.sum() != len(flat):
            raise FormatError(f"the offsets of its {tag} contradict their connectivity: it is damaged")
        blocks.append((types.astype(np.uint8), sizes, flat))
    return points.reshape(-1, 3), blocks


def _values(array: ElementTree.Element, encoding: _Encoding) -> NDArray:
    """The numbers of a DataArray in any of the encodings."""
    name, kind = array.get("Name", "points"), SCALARS.get(array.get("type", ""))
    if kind is None:
        raise FormatError(f"array '{shortened([name])}' has an unknown type")
    dtype = np.dtype(encoding.order + kind)
    form = array.get("format", "ascii")
    try:
        if form == "ascii":
            return np.array((array.text or "").split(), dtype=np.float64 if kind[0] == "f" else np.int64)
        if form == "binary":
            raw = _bytes((array.text or "").strip().encode(), True, encoding)
        elif form == "appended":
            offset = int(array.get("offset", ""))
            if not 0 <= offset <= len(encoding.appended):
                raise ValueError
            raw = _bytes(encoding.appended[offset:], encoding.appended_is_text, encoding)
        else:
            raise ValueError
        return np.frombuffer(raw, dtype=dtype)
    except (ValueError, OverflowError, binascii.Error, zlib.error, lzma.LZMAError):
        raise FormatError(f"array '{shortened([name])}' cannot be decoded: the file is damaged or truncated") from None


def _bytes(source: bytes, is_text: bool, encoding: _Encoding) -> bytes:
    """Decoded bytes of one block: [length][data], or [blocks][size][last size][packed sizes][data] if compressed."""
    width = encoding.header.itemsize
    if not source:
        return b""
    head, used = _taken(source, 0, width, is_text)
    count = int(np.frombuffer(head, encoding.header)[0])
    if not encoding.compressor:
        if not is_text:
            return _taken(source, used, count, False)[0]
        return _taken(source, 0, width + count, True)[0][width:]
    if count == 0:
        return b""
    head, used = _taken(source, 0, (3 + count) * width, is_text)
    _, size, last, *packed = np.frombuffer(head, encoding.header).tolist()
    body = _taken(source, used, sum(packed), is_text)[0]
    out, at = [], 0
    for k, length in enumerate(packed):
        limit = last if k == count - 1 and last else size
        if limit > MAX_BLOCK:
            raise ValueError
        out.append(_unpacked(body[at : at + length], limit, encoding.compressor))
        at += length
    return b"".join(out)


def _unpacked(block: bytes, size: int, compressor: str) -> bytes:
    # One byte more shows whether the block is longer than it says; for zlib, a limit of 0 would be none.
    packed = zlib.decompressobj() if compressor == "vtkZLibDataCompressor" else lzma.LZMADecompressor()
    out = packed.decompress(block, size + 1)
    if len(out) != size or not packed.eof:
        raise ValueError
    return out


def _taken(source: bytes, start: int, count: int, is_text: bool) -> tuple[bytes, int]:
    """`count` bytes from position `start`, and the position after them; base64 comes in groups of four."""
    end = start + (-(-count // 3) * 4 if is_text else count)
    if end > len(source):
        raise ValueError
    piece = source[start:end]
    return (base64.b64decode(piece, validate=True)[:count] if is_text else piece), end


def _array(name: str, values: NDArray, kind: str, components: int = 1) -> bytes:
    """A DataArray with inline base64."""
    raw = np.ascontiguousarray(values, dtype="<" + SCALARS[kind]).tobytes()
    text = base64.b64encode(np.uint64(len(raw)).astype("<u8").tobytes() + raw)
    width = f' NumberOfComponents="{components}"' if components > 1 else ""
    return f'<DataArray type="{kind}" Name="{name}"{width} format="binary">'.encode() + text + b"</DataArray>\n"


def _file(kind: str, points: NDArray[np.float64], counts: str, cells: bytes) -> bytes:
    return b"".join(
        [
            f'<?xml version="1.0"?>\n<VTKFile type="{kind}" version="1.0" byte_order="LittleEndian" '
            f'header_type="UInt64">\n<{kind}>\n<Piece NumberOfPoints="{len(points)}" {counts}>\n<Points>\n'.encode(),
            _array("Points", points, "Float64", 3),
            b"</Points>\n" + cells,
            f"</Piece>\n</{kind}>\n</VTKFile>\n".encode(),
        ]
    )


def written_surface(vertices: NDArray[np.float64], triangles: NDArray[np.int32]) -> bytes:
    """PolyData (.vtp)."""
    m = len(triangles)
    arrays = _array("connectivity", triangles, "Int64") + _array("offsets", 3 * np.arange(1, m + 1), "Int64")
    counts = f'NumberOfVerts="0" NumberOfLines="0" NumberOfStrips="0" NumberOfPolys="{m}"'
    return _file("PolyData", vertices, counts, b"<Polys>\n" + arrays + b"</Polys>\n")


def written_cells(vertices: NDArray[np.float64], cells: NDArray[np.int32]) -> bytes:
    """Triangles or tets as an UnstructuredGrid (.vtu)."""
    m, width = cells.shape
    arrays = (
        _array("connectivity", cells, "Int64")
        + _array("offsets", width * np.arange(1, m + 1), "Int64")
        + _array("types", np.full(m, CELL_OF_WIDTH[width]), "UInt8")
    )
    return _file("UnstructuredGrid", vertices, f'NumberOfCells="{m}"', b"<Cells>\n" + arrays + b"</Cells>\n")
