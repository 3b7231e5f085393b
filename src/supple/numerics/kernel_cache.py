"""Keeping compiled kernels honest: a cached kernel must be compiled anew when anything that it calls has changed."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from pathlib import Path
from types import FunctionType


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


def called_functions(function: FunctionType) -> list[FunctionType]:
    """The Python functions of a kernel and of all compiled functions that it calls, from globals and closures."""
    found: list[FunctionType] = []
    waiting = [function]
    while waiting:
        one = waiting.pop()
        if one in found:
            continue
        found.append(one)
        cells = [cell.cell_contents for cell in one.__closure__ or ()]
        names = [one.__globals__.get(name) for name in one.__code__.co_names]
        waiting += [
            value.py_func for value in cells + names if isinstance(getattr(value, "py_func", None), FunctionType)
        ]
    return found


def fingerprint_of(functions: Iterable[FunctionType]) -> int:
    """A number that changes with which functions these are, and with the text of their source files."""
    digest = hashlib.sha256()
    described = {(one.__code__.co_filename, one.__module__, one.__qualname__) for one in functions}
    for path, module, name in sorted(described):
        digest.update(f"{module}.{name}".encode())
        digest.update(Path(path).read_bytes() if Path(path).is_file() else b"")
    return int.from_bytes(digest.digest()[:7], "big")
