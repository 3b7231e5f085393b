"""Keeping compiled kernels honest: a cached kernel must be compiled anew when anything that it calls has changed."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from pathlib import Path


def fingerprint(sources: Iterable[Path]) -> int:
    """A number that changes with the text of the source files.

    Numba compares only the file that a kernel stands in with its cache, not the files of the functions that it calls. A
    kernel with this number in its closure has it in its cache key.
    """
    digest = hashlib.sha256()
    for path in sorted(sources):
        if path.is_file():
            digest.update(path.name.encode())
            digest.update(path.read_bytes())
    return int.from_bytes(digest.digest()[:7], "big")
