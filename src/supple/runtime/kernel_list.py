"""The list of kernels that standard scenes use, by name and signature: `kernels.json`, which `make kernels` writes.

It says what can be compiled ahead, by several processes, and how many kernels a scene needs.
"""

from __future__ import annotations

import json
from contextlib import suppress
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

from numba.core import types
from numba.core.errors import NumbaError

from supple.runtime.kernel_cache import KERNELS

PATH = Path(__file__).with_name("kernels.json")
_ARRAY, _NAMED, _TUPLE, _OMITTED = "array", "named", "tuple", "omitted"
_RECORD, _NESTED, _STRUCT = "record", "nested", "struct"


@cache
def kernels_of_scenes() -> dict[str, list[tuple[str, Any]]]:
    """Of each standard scene, the names of its kernels and their signatures as in the file, as they were compiled."""
    content = json.loads(PATH.read_text(encoding="utf-8"))
    kernels = [(name, signature) for name, signature in content["kernels"]]
    return {scene: [kernels[k] for k in numbers] for scene, numbers in content["scenes"].items()}


def write_list(scenes: dict[str, list[tuple[str, Any]]], path: Path = PATH) -> None:
    """Write the kernels of scenes, as `kernels_of_scenes` returns them."""
    numbers: dict[str, int] = {}
    for kernels in scenes.values():
        for kernel in kernels:
            numbers.setdefault(json.dumps(kernel), len(numbers))
    rows = ",\n".join(numbers)
    uses = {scene: [numbers[json.dumps(kernel)] for kernel in kernels] for scene, kernels in scenes.items()}
    path.write_text(f'{{"kernels": [\n{rows}\n],\n"scenes": {json.dumps(uses)}}}\n', encoding="utf-8")


def compile_kernel(name: str, signature: list[Any]) -> bool:
    """Compile a kernel of the list, or load it; whether it was compiled. What the list has wrong is left out."""
    kernel: Any = KERNELS.get(name)
    if kernel is None:
        return False
    before = sum(kernel.stats.cache_misses.values())
    with suppress(NumbaError, AttributeError, ImportError, TypeError):  # the code has another signature since
        kernel.compile(from_json(signature))
    return sum(kernel.stats.cache_misses.values()) > before


@cache
def _signature_of(signature: str) -> str:
    return str(from_json(json.loads(signature)))


def text_of(name: str, signature: list[Any]) -> str:
    """Name and signature in one text, as of a kernel that is loaded."""
    return f"{name} {_signature_of(json.dumps(signature))}"


def as_json(signature: tuple[types.Type, ...]) -> list[Any]:
    """A signature as lists and texts.

    Raises
    ------
    ValueError : where it contains what has no name in other processes, as a function.
    """
    return [_type_as_json(one) for one in signature]


def from_json(signature: list[Any]) -> tuple[types.Type, ...]:
    """The signature that `as_json` wrote."""
    return tuple(_type_from_json(one) for one in signature)


def _type_as_json(one: Any) -> Any:
    if isinstance(one, types.NestedArray):
        return [_NESTED, _type_as_json(one.dtype), list(one.shape)]
    if isinstance(one, types.Array) and one.aligned:
        return [_ARRAY, _type_as_json(one.dtype), one.ndim, one.layout, one.mutable]
    if isinstance(one, types.BaseNamedTuple):
        named: Any = one  # Numba's stubs do not know its attributes
        of = named.instance_class
        return [_NAMED, f"{of.__module__}:{of.__qualname__}", [_type_as_json(part) for part in named.types]]
    if isinstance(one, (types.UniTuple, types.Tuple)):
        return [_TUPLE, [_type_as_json(part) for part in one.types]]
    if isinstance(one, types.Record):
        fields = [[name, _type_as_json(f.type), f.offset, f.alignment] for name, f in one.fields.items()]
        return [_RECORD, fields, one.size, one.aligned]
    if isinstance(one, types.StructRef):
        shared: Any = one
        of, fields = type(one), [[name, _type_as_json(part)] for name, part in shared._fields]
        return [_STRUCT, f"{of.__module__}:{of.__qualname__}", fields]
    if isinstance(one, types.Omitted) and isinstance(one.value, (int, float, str, type(None))):
        return [_OMITTED, one.value]
    if isinstance(one, (types.Number, types.Boolean, types.NoneType)):
        name = {"bool": "boolean"}.get(str(one), str(one))
        if getattr(types, name, None) == one:
            return name
    raise ValueError(f"{one} cannot be listed")


def _type_from_json(one: Any) -> Any:
    if isinstance(one, str):
        return getattr(types, one)
    kind, *values = one
    if kind == _ARRAY:
        dtype, ndim, layout, mutable = values
        return types.Array(_type_from_json(dtype), ndim, layout, readonly=not mutable)
    if kind == _OMITTED:
        return types.Omitted(values[0])
    if kind == _RECORD:
        fields, size, is_aligned = values
        parts = [
            (name, {"type": _type_from_json(part), "offset": offset, "alignment": alignment, "title": None})
            for name, part, offset, alignment in fields
        ]
        return types.Record(parts, size, is_aligned)
    if kind == _NESTED:
        return types.NestedArray(_type_from_json(values[0]), tuple(values[1]))
    if kind == _STRUCT:
        module, _, name = values[0].partition(":")
        return getattr(import_module(module), name)([(field, _type_from_json(part)) for field, part in values[1]])
    parts = [_type_from_json(part) for part in values[-1]]
    if kind == _TUPLE:
        return types.BaseTuple.from_types(parts)
    module, _, name = values[0].partition(":")
    return types.BaseTuple.from_types(parts, getattr(import_module(module), name))
