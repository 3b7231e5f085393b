"""Contact pairs of a scene file."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BeforeValidator, Field, WithJsonSchema, model_validator

from supple.app.scene_file.model import Model, Name, NonNegative
from supple.scene.contact_pairs import ContactPair

_NAME = {"type": "string", "minLength": 1, "maxLength": 100}


def _as_list(value: Any) -> Any:
    """One name as a list of one, so that an error in a list names its entry."""
    if isinstance(value, str):
        return [value]
    if not isinstance(value, list):
        raise ValueError("give a name, or a list of names")
    return value


Names = Annotated[
    list[Name],
    Field(min_length=1, max_length=10_000),
    BeforeValidator(_as_list),
    WithJsonSchema({"anyOf": [_NAME, {"type": "array", "items": _NAME, "minItems": 1, "maxItems": 10_000}]}),
]


class ContactPairModel(Model):
    """A rule for the contact of two bodies, or a body and an obstacle: other friction, or no contact.

    It holds for each pair of a name of the first and a name of the second list.
    """

    first: Names = Field(description="name of a body or an obstacle, or a list of names; `*` matches any letters")
    second: Names = Field(description="the second of the pair; the same body again: contact with itself")
    friction: NonNegative | None = Field(default=None, description="Coulomb coefficient of these pairs")
    collide: bool = Field(default=True, description="false: these pairs pass through each other")

    @model_validator(mode="after")
    def _has_an_effect(self) -> ContactPairModel:
        if self.friction is None and self.collide:
            raise ValueError("this rule has no effect; give `friction`, or `collide: false`")
        return self

    def build(self) -> ContactPair:
        return ContactPair(self.first, self.second, self.friction, self.collide)
