"""Checks that a value has the types, shapes and ranges of indices that the annotations of its class declare.

    triangles: Annotated[NDArray[np.int32], Rows("t", 3, below="n")]

are rows of three numbers below n. The lengths "t" and "n" are those of the property `sizes` of the class, or of a class
that holds it; a length with another name is the same wherever the class itself uses it.
"""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Mapping
from dataclasses import dataclass, is_dataclass
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

import numpy as np

from supple.results.checkpoint.values import field_names

Sizes = dict[str, int]
Known = ChainMap[str, int]
"""First the lengths that a class itself has shown, then those of `sizes`."""


@dataclass(frozen=True, init=False)
class Rows:
    """Of an array: the length of each axis, a number or a name; below what its indices are; whether it is finite."""

    lengths: tuple[int | str, ...]
    below: str | None
    finite: bool

    def __init__(self, *lengths: int | str, below: str | None = None, finite: bool = False) -> None:
        for name, value in (("lengths", lengths), ("below", below), ("finite", finite)):
            object.__setattr__(self, name, value)

    def check(self, array: Any, sizes: Known, where: str) -> None:
        """Raise `ValueError` where an array differs; names without a length get it."""
        if array.ndim != len(self.lengths):
            raise ValueError(f"{where} has shape {array.shape}, not {self.lengths}")
        for length, known in zip(array.shape, self.lengths, strict=True):
            if length != (sizes.setdefault(known, length) if isinstance(known, str) else known):
                wanted = tuple(sizes.get(name, name) if isinstance(name, str) else name for name in self.lengths)
                raise ValueError(f"{where} has shape {array.shape}, not {wanted}")
        if self.below is not None and array.size and not 0 <= array.min() <= array.max() < sizes[self.below]:
            row = array.max() if array.max() >= sizes[self.below] else array.min()
            raise ValueError(f"{where} points to row {row} of {sizes[self.below]}")
        if self.finite and not np.isfinite(array).all():
            raise ValueError(f"{where} is not finite")


def check(value: Any, hint: Any, sizes: Known, where: str) -> None:
    """Raise `ValueError` where a value is not what an annotation says; `where` names the value."""
    origin, args = get_origin(hint), get_args(hint)
    if hint in (Any, object):
        return
    if origin is Annotated:
        check(value, args[0], sizes, where)
        for rows in args[1:]:
            rows.check(value, sizes, where)
    elif origin in (Union, UnionType):
        _check_union(value, args, sizes, where)
    elif origin is np.ndarray:
        kind = get_args(args[1])[0]
        if not isinstance(value, np.ndarray) or not np.issubdtype(value.dtype, kind):
            raise ValueError(f"{where} holds {getattr(value, 'dtype', value)}, not {kind.__name__}")
    elif origin is Literal:
        if value not in args:
            raise ValueError(f"{where} is {value!r}, not one of {args}")
    elif origin is tuple:
        if not isinstance(value, tuple) or (args[-1] is not Ellipsis and len(value) != len(args)):
            raise ValueError(f"{where} is not the tuple that it should be")
        for k, item in enumerate(value):
            check(item, args[0] if args[-1] is Ellipsis else args[k], sizes, f"{where}/{k}")
    elif origin in (dict, Mapping):
        if not isinstance(value, dict):
            raise ValueError(f"{where} is not a mapping")
        for key, item in value.items():
            check(item, args[1], sizes, f"{where}/{key}")
    elif not isinstance(value, (int, float) if hint is float else origin or hint) or (
        isinstance(value, bool) and hint in (int, float)
    ):
        raise ValueError(f"{where} is {str(value)[:40]!r}, not of the type {getattr(hint, '__name__', hint)}")
    elif is_dataclass(hint) or hasattr(hint, "_fields"):
        own = Known({}, getattr(value, "sizes", {}), *sizes.maps[1:])
        hints = get_type_hints(hint, include_extras=True)
        for name in field_names(hint):
            check(getattr(value, name), hints[name], own, f"{where}/{name}")


def _check_union(value: Any, hints: tuple[Any, ...], sizes: Known, where: str) -> None:
    """The error is that of the first type, or of the one that the value is of."""
    if value is None and type(None) in hints:
        return
    hints = tuple(hint for hint in hints if hint is not type(None))
    of_its_class = [hint for hint in hints if isinstance(hint, type) and isinstance(value, hint)]
    check(value, (of_its_class or hints)[0], sizes, where)
