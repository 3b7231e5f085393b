"""Values as JSON and arrays, and back with the same bits.

Known are None, truth values, numbers, texts, sets of texts, tuples, lists, mappings from texts, NumPy's arrays and
scalars, and frozen dataclasses and named tuples of these that are given as `classes`. Nothing that is read is executed.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.errors import OutputError

_DTYPE = re.compile(r"[<>|][biuf]\d{1,2}")
_DEEPEST = 50

Classes = Mapping[str, type]


def encoded(value: Any, classes: Classes) -> tuple[Any, list[NDArray[Any]]]:
    """A tree that JSON can hold, and the arrays that it refers to by their number.

    Raises
    ------
    OutputError : where a value is of no known kind.
    """
    arrays: list[NDArray[Any]] = []

    def tree_of(item: Any) -> Any:
        if item is None or (isinstance(item, (bool, int, float, str)) and type(item).__module__ == "builtins"):
            return item
        if isinstance(item, np.ndarray | np.generic) and item.dtype.kind in "biuf":
            arrays.append(np.asarray(item))
            return {"array" if isinstance(item, np.ndarray) else "scalar": len(arrays) - 1}
        if isinstance(item, frozenset) and all(isinstance(part, str) for part in item):
            return {"frozenset": sorted(str(part) for part in item)}
        if isinstance(item, (tuple, list)) and type(item) in (tuple, list):
            return {type(item).__name__: [tree_of(part) for part in item]}
        if isinstance(item, Mapping) and all(isinstance(key, str) for key in item):
            return {"mapping": {key: tree_of(part) for key, part in item.items()}}
        if classes.get(type(item).__name__) is type(item):
            made_of = {name: tree_of(getattr(item, name)) for name in _field_names(type(item))}
            return {"class": type(item).__name__, "fields": made_of}
        raise OutputError(
            f"a checkpoint cannot hold a {type(item).__name__}; register its class in "
            "supple.results.checkpoint.memories"
        )

    return tree_of(value), arrays


def decoded(tree: Any, arrays: list[NDArray[Any]], classes: Classes) -> Any:
    """The value that `encoded` was given. Arrays are those given, not copies.

    Raises
    ------
    ValueError, TypeError, KeyError, IndexError : where the tree is not one that `encoded` returns for these classes.
    """

    def value_of(item: Any, depth: int) -> Any:
        if depth > _DEEPEST:
            raise ValueError("it is nested too deeply")
        if item is None or isinstance(item, (bool, int, float, str)):
            return item
        if not isinstance(item, dict):
            raise ValueError("it holds a value of an unknown kind")
        if item.keys() == {"class", "fields"}:
            return _instance(
                classes[item["class"]], {key: value_of(part, depth + 1) for key, part in item["fields"].items()}
            )
        ((kind, content),) = item.items()
        match kind:
            case "array" | "scalar":
                if isinstance(content, bool) or not isinstance(content, int) or content < 0:
                    raise ValueError("the number of an array is wrong")
                return arrays[content] if kind == "array" else arrays[content][()]
            case "frozenset":
                return frozenset(str(part) for part in content)
            case "tuple":
                return tuple(value_of(part, depth + 1) for part in content)
            case "list":
                return [value_of(part, depth + 1) for part in content]
            case "mapping":
                return {key: value_of(part, depth + 1) for key, part in content.items()}
        raise ValueError(f"there is no kind {kind!r}")

    return value_of(tree, 0)


def _field_names(made: type) -> tuple[str, ...]:
    """Of a dataclass or a named tuple."""
    return tuple(field.name for field in fields(made)) if is_dataclass(made) else made._fields


def _instance(made: type, given: dict[str, Any]) -> Any:
    """A dataclass or named tuple with these fields; all must be given, and none beside them."""
    if set(_field_names(made)) != given.keys():
        raise ValueError(f"{made.__name__} has other fields in this version")
    later = [field.name for field in fields(made) if not field.init] if is_dataclass(made) else []
    instance = made(**{key: value for key, value in given.items() if key not in later})
    for key in later:
        object.__setattr__(instance, key, given[key])
    return instance


def described(arrays: list[NDArray[Any]]) -> list[list[Any]]:
    """Type and shape of each array, as JSON can hold them."""
    return [[array.dtype.str, list(array.shape)] for array in arrays]


def restored(description: Any, data: memoryview) -> list[NDArray[Any]]:
    """The arrays with these types and shapes, whose bytes follow each other in `data`.

    Raises
    ------
    ValueError, TypeError : where description and bytes do not agree.
    """
    arrays, place = [], 0
    for dtype, shape in description:
        if not isinstance(dtype, str) or _DTYPE.fullmatch(dtype) is None:
            raise ValueError(f"an array is of type {dtype!r}")
        if not all(isinstance(length, int) and 0 <= length < 1 << 40 for length in shape):
            raise ValueError(f"an array has the shape {shape!r}")
        kind, count = np.dtype(dtype), 1
        for length in shape:
            count *= length
        end = place + count * kind.itemsize
        if end > len(data):
            raise ValueError("an array is longer than the file")
        arrays.append(np.frombuffer(data[place:end], dtype=kind).reshape(shape).copy())
        place = end
    if place != len(data):
        raise ValueError("bytes are left over after its arrays")
    return arrays
