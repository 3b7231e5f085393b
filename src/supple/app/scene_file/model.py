"""Common to all parts of a scene file: strict values, no unknown keys, errors that list the known ones; fractions."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

Number = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]
Vector = Annotated[list[Number], Field(min_length=3, max_length=3)]
Count = Annotated[int, Field(ge=1, le=1_000_000)]
Name = Annotated[str, Field(min_length=1, max_length=100)]
Extents = Annotated[list[Positive], Field(min_length=3, max_length=3)]
Index = Annotated[int, Field(ge=0, lt=2**31)]
FilePath = Annotated[str, Field(min_length=1, max_length=1000)]


class UnknownKeyError(ValueError):
    """A key that is not one of the known ones."""

    def __init__(self, key: str, known: list[str]) -> None:
        super().__init__(f"unknown key {key}")
        self.key, self.known = key, known


class Model(BaseModel):
    """Base of all parts of a scene file."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)

    alternatives: ClassVar[tuple[str, ...] | None] = None
    """Keys of which exactly one must be given, and last the message otherwise."""

    @model_validator(mode="before")
    @classmethod
    def _reject_unknown_keys(cls, data: Any) -> Any:
        """Before pydantic's own check, because here the known keys are available for a suggestion."""
        if isinstance(data, dict):
            for key in data:
                if key not in cls.model_fields:
                    raise UnknownKeyError(key, list(cls.model_fields))
        return data

    @model_validator(mode="after")
    def _one_of_the_alternatives(self) -> Self:
        if self.alternatives is not None:
            *keys, message = self.alternatives
            if sum(getattr(self, key) is not None for key in keys) != 1:
                raise ValueError(message)
        return self


def number_or_fraction(text: str) -> float:
    """The value of a number, or of a fraction of two numbers.

    Raises
    ------
    ValueError : where the text is neither, or divides by zero.
    """
    above, slash, below = text.partition("/")
    try:
        return float(above) / float(below) if slash else float(above)
    except ZeroDivisionError:
        raise ValueError(f"{text!r} divides by zero") from None
