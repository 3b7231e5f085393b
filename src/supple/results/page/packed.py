"""Arrays as the client of the page reads them: one after the other in one block of bytes, described by JSON.

A block is the length of the JSON as 4 bytes, the JSON, and the arrays, little-endian, each at a multiple of 8 bytes.
"""

from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

_ALIGNMENT = 8  # of the widest number, which a browser reads where it lies


class Packer:
    """Collects arrays; equal ones, such as the skins of twelve bears, are there once."""

    def __init__(self) -> None:
        self._blocks: list[bytes] = []
        self._known: dict[tuple[str, bytes], dict[str, Any]] = {}
        self._size = 0

    def add(self, values: ArrayLike, kind: DTypeLike) -> dict[str, Any]:
        """Where the array will be, for the JSON: its type (as NumPy names it), first byte and number of values."""
        array = np.ascontiguousarray(values, dtype=np.dtype(kind).newbyteorder("<"))
        key = array.dtype.str[1:], array.tobytes()
        if key not in self._known:
            self._known[key] = {"type": key[0], "at": self._size, "count": array.size}
            self._blocks.append(key[1] + bytes(-len(key[1]) % _ALIGNMENT))
            self._size += len(self._blocks[-1])
        return self._known[key]

    def block(self, description: Any) -> bytes:
        """The description, which refers to the arrays, and the arrays."""
        text = json.dumps(description, allow_nan=False).encode()
        text += b" " * (-(4 + len(text)) % _ALIGNMENT)
        return b"".join([struct.pack("<I", len(text)), text, *self._blocks])


def quantized(x: NDArray[np.float64]) -> tuple[NDArray[np.uint16], list[float], float]:
    """Positions (frames, n, 3) as whole steps from a corner: these, the corner (3,) and the step [m].

    The step is a part in 65,535 of the longest side of the box about all positions.
    """
    low = x.min(axis=(0, 1))
    step = max(float((x.max(axis=(0, 1)) - low).max()) / 65535.0, 1e-300)
    return np.round((x - low) / step).astype(np.uint16), low.tolist(), step


def differences(values: NDArray[np.uint8] | NDArray[np.uint16]) -> NDArray[np.uint8]:
    """Bytes that compress well, of values (frames, ...): each is the difference to the frame before.

    Differences are modulo 2^8 or 2^16; their signs are in the lowest bit, so that small ones have small numbers. Of
    16 bits, all upper bytes stand before all lower ones.
    """
    kind = values.dtype
    bits, one = 8 * kind.itemsize, kind.type(1)
    change = np.diff(values, axis=0, prepend=np.zeros_like(values[:1]))
    folded = (change << one) ^ np.where(change >> kind.type(bits - 1), np.iinfo(kind).max, 0).astype(kind)
    return np.ascontiguousarray(folded.astype(kind.newbyteorder(">")).reshape(-1, 1).view(np.uint8).T)
