"""Every kind of a scene as a part of a scene file: its keys are the declared fields of its class."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import MISSING
from functools import cache, singledispatch
from typing import Annotated, Any, ClassVar, Literal, Protocol, Self, Union

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, create_model, model_validator

from supple.app.scene_file.model import Model
from supple.kinds.kind import Kind, declared, first_paragraph
from supple.kinds.validators import Validator
from supple.scene.located import at


class Meshes(Protocol):
    """What the keys of kinds need of the meshes of a scene file."""

    def vertices_of(self, body: str, name: str) -> NDArray[np.integer]:
        """Numbers (k,) of the vertices of a body that are in a set of its mesh file."""
        ...


class KindModel(Model):
    """One object of a kind.

    Attributes
    ----------
    made : the kind, a class or a function; choices : keys of which at most one may be given, for each selection
    """

    made: ClassVar[Callable[..., Any]]
    choices: ClassVar[tuple[tuple[str, ...], ...]] = ()

    def build(self, meshes: Any) -> Any:
        """The object; errors get the key that is wrong."""
        return self.made(**self.built_values(meshes))

    def built_values(self, meshes: Any) -> dict[str, Any]:
        """Its parameters, by name."""
        return values_of(self, declared(self.made), meshes)

    @model_validator(mode="after")
    def _one_of_the_choices(self) -> Self:
        for *others, last in self.choices:
            if sum(getattr(self, key) is not None for key in (*others, last)) > 1:
                raise ValueError(f"give the {last if last != 'set' else others[0]} by either {_listed(others, last)}")
        return self


def values_of(model: Any, fields: Any, meshes: Meshes) -> dict[str, Any]:
    """The values of declared fields of a part of a scene file; errors get the key that is wrong."""
    values = {}
    for name, one in fields.items():
        keys = list(keys_of(one.validator, name))
        key = next((key for key in keys if getattr(model, key) is not None), keys[0])
        with at(key):
            value = getattr(model, key)
            values[name] = meshes.vertices_of(model.body, value) if key == "set" else built(value, meshes)
    return values


def _listed(others: Sequence[str], last: str) -> str:
    return f"{', '.join(f'`{key}`' for key in others)} or `{last}`"


@singledispatch
def schema_type(validator: Validator) -> Any:
    """The type of the value of a key; see `supple.app.scene_file.entries.schema_types`."""
    raise TypeError(f"scene files do not know how to write a {type(validator).__name__}; register it beside the others")


@singledispatch
def keys_of(validator: Validator, name: str) -> dict[str, tuple[Any, str]]:
    """The keys that a field of this name has, with their types, and descriptions where the field's does not fit."""
    return {name: (schema_type(validator), "")}


def typed_keys(kind: Callable[..., Any], names: Collection[str], *, null: bool = False) -> dict[str, tuple[Any, Any]]:
    """The keys of some declared fields as fields of a model; null : whether all have that as their default."""
    keys: dict[str, tuple[Any, Any]] = {}
    for name, one in declared(kind).items():
        if name not in names:
            continue
        own = keys_of(one.validator, name)
        text = one.description.replace("None", "null")
        for key, (written, words) in own.items():
            description = words or text
            if one.default is MISSING and len(own) == 1 and not null:
                keys[key] = (written, Field(description=description))
                continue
            default = None if len(own) > 1 or null else _default(one.default)
            optional = default is None or one.optional
            keys[key] = (written | None if optional else written, Field(default=default, description=description))
    return keys


@cache
def model_of(kind: Any, tagged: bool) -> type[KindModel]:
    """The part of a scene file that describes an object of a kind; tagged : whether it has a key `kind`."""
    keys: dict[str, Any] = {"kind": (Literal[kind.kind], ...)} if tagged else {}
    keys |= typed_keys(kind, declared(kind).keys())
    # The names in the schema differ where a kind is one of several in one list, and alone in another.
    name = f"{kind.__name__}{'' if tagged else 'Entry'}Model"
    if not isinstance(kind, type):
        name = "".join(word.capitalize() for word in kind.__name__.split("_")) + "ShapeModel"
    model = create_model(name, __base__=KindModel, __doc__=first_paragraph(kind), __module__=__name__, **keys)
    several = (tuple(keys_of(one.validator, name)) for name, one in declared(kind).items())
    model.made, model.choices = staticmethod(kind), tuple(own for own in several if len(own) > 1)
    return model


def entry_of(kinds: Collection[Any]) -> Any:
    """The type of an entry that is of one of several kinds: distinguished by their key `kind`, or of one alone."""
    if len(kinds) == 1:
        return model_of(*kinds, False)
    return Annotated[Union[tuple(model_of(kind, True) for kind in kinds)], Field(discriminator="kind")]  # noqa: UP007


def _default(value: Any) -> Any:
    """A default of a class as a scene file has it."""
    if isinstance(value, Kind):
        return model_of(type(value), False)()
    return list(value) if isinstance(value, (tuple, np.ndarray)) else value


def built(value: Any, meshes: Any) -> Any:
    """What a part of a scene file describes: a value as it is, or the object that it builds."""
    if isinstance(value, list):
        found = []
        for i, item in enumerate(value):
            with at(i):
                found.append(built(item, meshes))
        return found
    if isinstance(value, dict):
        return {key: built(item, meshes) for key, item in value.items()}
    build = getattr(value, "build", None)
    return value if build is None else build(meshes)
