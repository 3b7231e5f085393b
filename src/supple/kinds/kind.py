"""A kind of thing that a user describes is one class: a frozen dataclass whose fields declare what is known of them.

    @dataclass(frozen=True, eq=False)
    class Spring(Load):
        stiffness: Annotated[float, POSITIVE]

The validator beside the type checks the field and says how a scene file writes it. The text under "Parameters" in the
docstring describes it in the schema of scene files, in `supple info` and in the tables of the documentation. A function
whose parameters have validators is a kind as well, such as a shape that it makes.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import MISSING, dataclass, fields
from functools import cache
from typing import Annotated, Any, ClassVar, get_args, get_origin, get_type_hints

import numpy as np

from supple.errors import SceneError, SuppleError
from supple.kinds.described import Described, written_types
from supple.kinds.validators import Name, Validator

_HEADING = re.compile(r"^(Parameters|Attributes|Raises|Returns|Yields)\n-+\n", flags=re.M)
_ITEM = re.compile(r"(?:^|; )((?:[a-zA-Z_]\w*(?:, )?)+) : (.*?)(?=(?:; [a-z_]\w*(?:, \w+)* : )|^\S|\Z)", re.S | re.M)


def first_paragraph(kind: type | Callable[..., Any]) -> str:
    """The beginning of the docstring, on one line."""
    return " ".join(_docstring(kind).partition("\n\n")[0].split())


def _docstring(kind: type | Callable[..., Any]) -> str:
    """Its own, not that of a base class."""
    text = kind.__dict__.get("__doc__") if isinstance(kind, type) else kind.__doc__
    return inspect.cleandoc(text or "")


def descriptions(kind: type | Callable[..., Any]) -> dict[str, str]:
    """By name of the parameter, its text on one line; a class's own docstring comes before those of its bases."""
    by_name: dict[str, str] = {}
    for base in reversed(kind.__mro__) if isinstance(kind, type) else (kind,):
        _, *parts = _HEADING.split(_docstring(base))
        for heading, body in zip(parts[::2], parts[1::2], strict=True):
            if heading == "Parameters":
                for match in _ITEM.finditer(body):
                    text = " ".join(match[2].split()).removesuffix(".")
                    by_name |= dict.fromkeys(match[1].split(", "), text)
    return by_name


@dataclass(frozen=True)
class Declared:
    """One field of a kind.

    Attributes
    ----------
    validator : how it is checked; default : `MISSING` where it must be given; optional : whether it may be None
    """

    validator: Validator
    default: Any
    description: str
    optional: bool


@cache
def declared(kind: type | Callable[..., Any]) -> Mapping[str, Declared]:
    """The declared fields of a class, or parameters of a function, by name, in their order."""
    texts, fields_by_name = descriptions(kind), {}
    for name, hint, default in _fields(kind) if isinstance(kind, type) else _parameters(kind):
        validators = (
            [one for one in get_args(hint) if isinstance(one, Validator)] if get_origin(hint) is Annotated else []
        )
        if validators:
            required = name in getattr(kind, "required", ())
            optional = not required and (default is None or type(None) in get_args(get_args(hint)[0]))
            default = MISSING if required else default
            fields_by_name[name] = Declared(validators[0], default, texts.get(name, ""), optional)
    return fields_by_name


def _fields(kind: type) -> Iterator[tuple[str, Any, Any]]:
    hints = written_types(kind)
    for field in fields(kind):
        if field.init:
            default = field.default if field.default_factory is MISSING else field.default_factory()
            yield field.name, hints[field.name], default


def _parameters(function: Callable[..., Any]) -> Iterator[tuple[str, Any, Any]]:
    hints = get_type_hints(function, include_extras=True)
    for name, parameter in inspect.signature(function).parameters.items():
        yield name, hints[name], MISSING if parameter.default is parameter.empty else parameter.default


class Kind(metaclass=Described):
    """The base class of kinds.

    Attributes
    ----------
    kind : the value of `kind` in scene files; title : what it is called in messages, where that is another word
    required : fields that have a default only because those of a base class come before them
    exactly_one : fields of which exactly one must be given; error : what is raised for a wrong value
    """

    kind: ClassVar[str]
    title: ClassVar[str] = ""
    required: ClassVar[tuple[str, ...]] = ()
    exactly_one: ClassVar[tuple[str, ...]] = ()
    error: ClassVar[type[SuppleError]] = SceneError

    def __post_init__(self) -> None:
        all_declared = declared(type(self))
        for of_names in (True, False):
            for key, one in all_declared.items():
                value = getattr(self, key)
                if isinstance(one.validator, Name) != of_names or (value is None and one.optional):
                    continue
                if value is None and key in self.required:
                    raise self.error(f"{self.label}: {key} is missing; give {key}=..., {one.description}")
                what = (self.word if key == "name" else f"{self.word}: {key}") if of_names else f"{self.label}: {key}"
                try:
                    object.__setattr__(self, key, one.validator.checked(value, what))
                except SceneError as error:
                    raise self.error(str(error)) from None
        if self.exactly_one:
            given = [key for key in self.exactly_one if getattr(self, key) is not None]
            if len(given) != 1:
                *others, last = self.exactly_one
                text = " and ".join(given) or "none of them"
                raise self.error(f"{self.label}: {text} given; give exactly one of {', '.join(others)} and {last}")

    @property
    def word(self) -> str:
        """What the kind is called in messages."""
        return self.title or self.kind.replace("_", " ")

    @property
    def label(self) -> str:
        """The name of this object in messages."""
        name = getattr(self, "name", None)
        return f"{self.word} {name!r}" if name else self.word

    @property
    def bodies(self) -> tuple[str, ...]:
        """The names of the bodies, and of things that may stand for one, that it names."""
        given = ((one.validator, getattr(self, key)) for key, one in declared(type(self)).items())
        return tuple(name for validator, value in given if value is not None for name in validator.bodies(value))

    def facts(self, scene: Any) -> str:
        """What `supple info` says of it: what was given, and what follows from the scene that it is in."""
        return self.summary()

    def summary(self) -> str:
        """What was given, without names and what has its default."""
        parts = []
        for key, one in declared(type(self)).items():
            value = getattr(self, key)
            if not isinstance(one.validator, Name) and not same(value, one.default):
                parts.append(f"{key.replace('_', ' ')} {_short(value)}")
        return ", ".join(parts)


def same(value: Any, default: Any) -> bool:
    """Whether a value is the default."""
    try:
        return value is default or bool(np.array_equal(value, default))
    except (TypeError, ValueError):
        return False


def _short(value: Any) -> str:
    if isinstance(value, Kind):
        inner = value.summary()
        return f"{type(value).__name__}({inner})" if inner else type(value).__name__
    if isinstance(value, bool | str | None):
        return str(value)
    if callable(value):
        return "over time"
    array = np.asarray(value)
    if array.dtype.kind in "iuf" and array.size <= 4:
        return f"{array[()]:g}" if array.ndim == 0 else f"({', '.join(f'{x:g}' for x in array.ravel())})"
    return f"of {len(value)}" if hasattr(value, "__len__") else type(value).__name__
