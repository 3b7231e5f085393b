"""Contact pairs of a scene file."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BeforeValidator, Field, WithJsonSchema, model_validator

from supple.scene.contact_pairs import ContactPair, PairRules
from supple.scene.scene import Scene
from supple.scene_file.located import at
from supple.scene_file.model import Model, Name, NonNegative

_NAME = {"type": "string", "minLength": 1, "maxLength": 100}


def _as_list(value: Any) -> Any:
    """One name as a list of one, so that what is wrong with a list is said of its own entry."""
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
    """A rule for the contact of two things: other friction, or none of it. Groups are every pair of the two lists."""

    first: Names = Field(description="name of a body or an obstacle, or a list of names; `*` stands for any letters")
    second: Names = Field(description="the others; the same body again is its contact with itself")
    friction: NonNegative | None = Field(default=None, description="Coulomb coefficient of these pairs")
    collide: bool = Field(default=True, description="false, and these pairs pass through each other")

    @model_validator(mode="after")
    def _says_something(self) -> ContactPairModel:
        if self.friction is None and self.collide:
            raise ValueError("this rule says nothing; give `friction`, or `collide: false`")
        return self

    def build(self) -> ContactPair:
        return ContactPair(self.first, self.second, self.friction, self.collide)


def built_pairs(described: list[ContactPairModel], scene: Scene) -> list[ContactPair]:
    """The contact pairs, checked one by one against the scene: here, where their places in the file are known."""
    rules, pairs = PairRules(scene), []
    for i, model in enumerate(described):
        with at("contact_pairs", i):
            pairs.append(model.build())
            rules.add(pairs[-1])
    return pairs
