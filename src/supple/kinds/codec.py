"""Values as JSON and arrays, and back with the same bits.

Known are None, truth values, numbers, texts, sets of texts, tuples, lists, slices, mappings from texts, NumPy's arrays
and scalars, and dataclasses and named tuples of these that are given as `classes`. An array is known by its path, such
as "bodies/0/triangles"; a short one can be among the JSON. Nothing that is read is executed.

What a user describes (`supple.kinds.kind`, bodies, scenes, meshes) is written as the arguments that make it, and read
by its constructor, which checks all of it. A function is written as a number; its values are elsewhere.

`check` compares a value with the types that its class declares.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields, is_dataclass
from types import UnionType
from typing import Any, Literal, Union, cast, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

from supple.errors import OutputError
from supple.kinds.described import Described
from supple.kinds.kind import Kind

_DTYPE = re.compile(r"[<>|][biuf]\d{1,2}")
_DEEPEST = 50

Classes = Mapping[str, type]


Arrays = Mapping[str, NDArray[Any]]


def kinds_by_name() -> dict[str, type]:
    """All kinds that are defined so far, also those of a user; of two with one name ours, or else the latest."""
    classes: dict[str, type] = {}
    for kind in _below(Kind):
        if _is_ours(kind) or not _is_ours(classes.get(kind.__name__, kind)):
            classes[kind.__name__] = kind
    return classes


def _is_ours(kind: type) -> bool:
    return kind.__module__.startswith("supple.")


def _below(kind: type) -> Iterator[type]:
    for one in kind.__subclasses__():
        yield one
        yield from _below(one)


def encoded(
    value: Any, classes: Classes, functions: list[Callable[..., Any]] | None = None, inline: int = 0
) -> tuple[Any, dict[str, NDArray[Any]]]:
    """A tree that JSON can hold, and the arrays that it refers to, by their path.

    Parameters
    ----------
    functions : gets the functions of the value, each once; where it is not given, there may be none
    inline : the largest number of entries of an array that is in the tree

    Raises
    ------
    OutputError : where a value is of no known kind.
    """
    arrays: dict[str, NDArray[Any]] = {}

    def tree_of(item: Any, path: str) -> Any:
        def inside(key: object) -> str:
            return f"{path}/{key}" if path else str(key)

        if item is None or (isinstance(item, (bool, int, float, str)) and type(item).__module__ == "builtins"):
            return item
        if isinstance(item, np.ndarray | np.generic) and item.dtype.kind in "biuf":
            if item.size <= inline:
                return {"numbers": [item.dtype.str, list(item.shape), np.ravel(item).tolist()]}
            arrays[path] = np.asarray(item)
            return {"array" if isinstance(item, np.ndarray) else "scalar": path}
        if isinstance(item, frozenset) and all(isinstance(part, str) for part in item):
            return {"frozenset": sorted(str(part) for part in item)}
        if isinstance(item, (tuple, list)) and type(item) in (tuple, list):
            return {type(item).__name__: [tree_of(part, inside(k)) for k, part in enumerate(item)]}
        if isinstance(item, slice):
            return {"slice": [int(item.start), int(item.stop)]}
        if isinstance(item, Mapping) and all(isinstance(key, str) for key in item):
            # By number: a key may contain any character, and two paths must differ.
            return {"mapping": {key: tree_of(part, inside(k)) for k, (key, part) in enumerate(item.items())}}
        item = getattr(item, "recorded", lambda item=item: item)()
        known = classes.get(type(item).__name__)
        # A notebook defines a class again when its cell is executed again.
        if known is type(item) or (known is not None and isinstance(item, Kind) and not _is_ours(known)):
            own = arguments(type(item))
            tree = {
                "class": type(item).__name__,
                "fields": {key: tree_of(getattr(item, own[key]), inside(key)) for key in own},
            }
            other = getattr(item, "otherwise", None)
            return tree if other is None else tree | {"otherwise": tree_of(other, inside("otherwise"))}
        if functions is not None and callable(item):
            number = next((k for k, function in enumerate(functions) if function is item), len(functions))
            if number == len(functions):
                functions.append(item)
            return {"function": number}
        raise OutputError(f"a {type(item).__name__} cannot be written to a file; register its class with its codec")

    return tree_of(value, ""), arrays


def decoded(tree: Any, arrays: Arrays, classes: Classes, function: Callable[[int], Any] | None = None) -> Any:
    """The value that `encoded` was given. Arrays are those given, not copies; `function` gives that of a number.

    Raises
    ------
    ValueError, TypeError, KeyError : where the tree is not one that `encoded` returns for these classes.
    SuppleError : of the constructors.
    """

    def value_of(item: Any, depth: int) -> Any:
        if depth > _DEEPEST:
            raise ValueError("it is nested too deeply")
        if item is None or isinstance(item, (bool, int, float, str)):
            return item
        if not isinstance(item, dict):
            raise ValueError("it holds a value of an unknown kind")
        if item.keys() >= {"class", "fields"}:
            name = item["class"]
            if name not in classes and "otherwise" in item:
                return value_of(item["otherwise"], depth + 1)
            if name not in classes:
                raise ValueError(f"the class {str(name)[:100]!r} is not known here; import the module that defines it")
            return _instance(classes[name], {key: value_of(part, depth + 1) for key, part in item["fields"].items()})
        ((kind, content),) = item.items()
        match kind:
            case "array":
                return arrays[content]
            case "scalar":
                return arrays[content][()]
            case "numbers":
                dtype, shape, values = content
                return np.array(values, dtype=_dtype(dtype)).reshape(shape)
            case "frozenset":
                return frozenset(str(part) for part in content)
            case "slice":
                begin, end = content
                return slice(int(begin), int(end))
            case "tuple":
                return tuple(value_of(part, depth + 1) for part in content)
            case "list":
                return [value_of(part, depth + 1) for part in content]
            case "mapping":
                return {key: value_of(part, depth + 1) for key, part in content.items()}
            case "function" if function is not None:
                return function(int(content))
        raise ValueError(f"kind {kind!r} does not exist")

    return value_of(tree, 0)


def arguments(made: type) -> dict[str, str]:
    """The arguments that make an instance, and the names of its fields that have them."""
    if isinstance(made, Described):
        return {field.name: field.name for field in fields(cast("Any", made)) if field.init}
    return getattr(made, "_arguments", None) or {name: name for name in field_names(made)}


def field_names(made: type) -> tuple[str, ...]:
    """Of a dataclass or a named tuple."""
    return tuple(field.name for field in fields(made)) if is_dataclass(made) else made._fields


def _instance(made: type, given: dict[str, Any]) -> Any:
    """A dataclass or named tuple with these fields; all must be given, and none beside them."""
    if arguments(made).keys() != given.keys():
        raise ValueError(f"{made.__name__} has other fields in this version")
    if isinstance(made, Described) or hasattr(made, "_arguments"):
        return made(**given)
    later = [field.name for field in fields(made) if not field.init] if is_dataclass(made) else []
    instance = made(**{key: value for key, value in given.items() if key not in later})
    for key in later:
        object.__setattr__(instance, key, given[key])
    return instance


def described(arrays: Arrays) -> dict[str, list[Any]]:
    """Type and shape of each array, as JSON can hold them."""
    return {path: [array.dtype.str, list(array.shape)] for path, array in arrays.items()}


def restored(description: Any, data: memoryview) -> dict[str, NDArray[Any]]:
    """The arrays with these types and shapes, whose bytes follow each other in `data`.

    Raises
    ------
    ValueError, TypeError, AttributeError : where description and bytes do not agree.
    """
    arrays, place = {}, 0
    for path, (dtype, shape) in description.items():
        kind, count = _dtype(dtype), 1
        if not all(isinstance(length, int) and 0 <= length < 1 << 40 for length in shape):
            raise ValueError(f"an array has the shape {shape!r}")
        for length in shape:
            count *= length
        end = place + count * kind.itemsize
        if end > len(data):
            raise ValueError("an array is longer than the file")
        arrays[path] = np.frombuffer(data[place:end], dtype=kind).reshape(shape).copy()
        place = end
    if place != len(data):
        raise ValueError("bytes remain after its arrays")
    return arrays


def _dtype(text: Any) -> np.dtype[Any]:
    if not isinstance(text, str) or _DTYPE.fullmatch(text) is None:
        raise ValueError(f"an array is of type {text!r}")
    return np.dtype(text)


def check(value: Any, hint: Any, where: str) -> None:
    """Raise `ValueError` where a value is not what an annotation says; `where` names the value."""
    origin, args = get_origin(hint), get_args(hint)
    if hint in (Any, object):
        return
    if origin in (Union, UnionType):
        _check_union(value, args, where)
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
            check(item, args[0] if args[-1] is Ellipsis else args[k], f"{where}/{k}")
    elif origin in (dict, Mapping):
        if not isinstance(value, dict):
            raise ValueError(f"{where} is not a mapping")
        for key, item in value.items():
            check(item, args[1], f"{where}/{key}")
    elif not isinstance(value, (int, float) if hint is float else origin or hint) or (
        isinstance(value, bool) and hint in (int, float)
    ):
        raise ValueError(f"{where} is {str(value)[:40]!r}, not of the type {getattr(hint, '__name__', hint)}")
    elif isinstance(hint, Described):
        return  # its constructor has checked it
    elif is_dataclass(hint) or hasattr(hint, "_fields"):
        hints = get_type_hints(hint)
        for name in field_names(hint):
            check(getattr(value, name), hints[name], f"{where}/{name}")


def _check_union(value: Any, hints: tuple[Any, ...], where: str) -> None:
    """The error is that of the first type, or of the one that the value is of."""
    if value is None and type(None) in hints:
        return
    hints = tuple(hint for hint in hints if hint is not type(None))
    of_its_class = [hint for hint in hints if isinstance(hint, type) and isinstance(value, hint)]
    check(value, (of_its_class or hints)[0], where)
