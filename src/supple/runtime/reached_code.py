"""A digest of all code that a kernel reaches, in any file.

It does not depend on lines, comments, docstrings, paths or times: what has the same digest is compiled to the same
machine code.
"""

from __future__ import annotations

import hashlib
import pickle
from collections.abc import Iterator
from functools import cache
from types import CodeType, FunctionType, ModuleType
from typing import Any

import numpy as np
from numba.core.dispatcher import Dispatcher

_NUMBERS_AND_ARRAYS = (int, float, complex, str, bytes, np.generic, np.ndarray)


def reached_code(kernel: FunctionType | Dispatcher) -> bytes:
    """A digest of the bytecode, constants and compiler options of a kernel and of all compiled functions it reaches.

    The code is that in memory, not that of the files: a file that is edited after its import cannot be mistaken for
    what is compiled.
    """
    digest = hashlib.sha256()
    visited: set[FunctionType] = set()
    pending: list[Any] = [kernel]
    while pending:
        value = pending.pop()
        if isinstance(value, Dispatcher):
            # Sets of options are not ordered.
            options = {k: sorted(v) if isinstance(v, (set, frozenset)) else v for k, v in value.targetoptions.items()}
            digest.update(repr(sorted(options.items())).encode())
            value = value.py_func
        if isinstance(value, tuple):
            pending += value
        elif isinstance(value, _NUMBERS_AND_ARRAYS):
            digest.update(pickle.dumps(value))
        elif isinstance(value, FunctionType) and value not in visited:
            visited.add(value)
            digest.update(_text(value.__code__, value.__doc__))
            pending += value.__defaults__ or ()
            pending += _used_values(value)
    return digest.digest()


@cache
def _text(code: CodeType, docstring: str | None) -> bytes:
    """The content of a code object and of those in it, without line numbers and without the docstring."""
    constants = [None if constant is docstring else _constant(constant) for constant in code.co_consts]
    return repr((code.co_code, code.co_names, code.co_varnames, code.co_freevars, constants)).encode()


def _constant(value: Any) -> Any:
    if isinstance(value, CodeType):
        return _text(value, None)
    return sorted(map(repr, value)) if isinstance(value, frozenset) else value


@cache
def _names(code: CodeType) -> tuple[str, ...]:
    inner = (name for item in code.co_consts if isinstance(item, CodeType) for name in _names(item))
    return tuple(dict.fromkeys([*code.co_names, *inner]))


def _used_values(function: FunctionType) -> Iterator[Any]:
    """What the names in a function mean, in an order that every process agrees on.

    Plain functions are left out: compiled code cannot call them.
    """
    cells = (cell.cell_contents for cell in function.__closure__ or ())
    closure = dict(zip(function.__code__.co_freevars, cells, strict=True))
    names = list(dict.fromkeys([*closure, *_names(function.__code__)]))
    for name in names:
        value = closure.get(name, function.__globals__.get(name))
        values = [getattr(value, member, None) for member in names] if isinstance(value, ModuleType) else [value]
        yield from (value for value in values if not isinstance(value, FunctionType))
