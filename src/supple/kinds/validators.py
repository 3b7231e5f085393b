"""Validators of values: how the fields of a kind are checked. What a scene file writes for each validator is in
`supple.app.scene_file.entries.schema_types`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.errors import SceneError
from supple.kinds.checks import check_name, finite_vector, float_array, number, unit_vector


class Validator(ABC):
    """How one value is checked and stored."""

    @abstractmethod
    def checked(self, value: Any, what: str) -> Any:
        """The value as it is stored.

        Raises
        ------
        SceneError : where it is impossible; the text begins with `what`.
        """

    def bodies(self, value: Any) -> tuple[str, ...]:
        """The names of bodies, or of things that may stand for one, that a checked value has."""
        return ()


@dataclass(frozen=True)
class Number(Validator):
    """A finite number within bounds; those of `above` and `below` are excluded."""

    above: float | None = None
    least: float | None = None
    below: float | None = None
    most: float | None = None

    def checked(self, value: Any, what: str) -> float:
        given = number(value, what)
        self.check_bounds(given, what)
        return given

    def check_bounds(self, given: float, what: str) -> None:
        """Raise `SceneError` for a number beyond the bounds."""
        if not self.allows(given):
            raise SceneError(f"{what} is {given:g}; it must be {self.needed(given)}")

    def allows(self, given: float) -> bool:
        """Whether a number is finite and within the bounds."""
        return (
            bool(np.isfinite(given))
            and (self.above is None or given > self.above)
            and (self.least is None or given >= self.least)
            and (self.below is None or given < self.below)
            and (self.most is None or given <= self.most)
        )

    def needed(self, given: float) -> str:
        """What a number that is not allowed must be, in words."""
        ends = sum(end is not None for end in (self.above, self.least, self.below, self.most))
        # Bounds on both sides already exclude it.
        return f"finite and {self.bounds}" if ends == 1 and not np.isfinite(given) else self.bounds

    @property
    def bounds(self) -> str:
        """In words."""
        if self.least is not None and self.most is not None:
            return f"from {self.least:g} to {self.most:g}"
        words = {"above": self.above, "below": self.below, "at most": self.most}
        parts = [f"{word} {_word(end)}" for word, end in words.items() if end is not None]
        if self.least is not None:
            parts.insert(0, f"{_word(self.least)} or more")
        return " and ".join(parts) or "finite"


def _word(end: float) -> str:
    return "zero" if end == 0.0 else f"{end:g}"


POSITIVE, NON_NEGATIVE, ANY_NUMBER = Number(above=0.0), Number(least=0.0), Number()
SHARE = Number(above=0.0, below=1.0)


@dataclass(frozen=True)
class NumberPerTet(Validator):
    """A number within bounds, which is stored as it is given, or an array with one for each tet of a body."""

    bounds: Number

    def checked(self, value: Any, what: str) -> Any:
        within = "" if self.bounds == ANY_NUMBER else f" {self.bounds.bounds}"
        values = float_array(value, what, f"give a number{within}, or one per tetrahedron")
        if values.ndim > 1:
            raise SceneError(f"{what} has shape {values.shape}; give one number, or one per tetrahedron")
        if values.size:
            # The first that is not finite, or the smallest and the largest, decide.
            unlike = np.flatnonzero(~np.isfinite(values.ravel()))
            for tet in unlike[:1] if len(unlike) else (int(values.argmin()), int(values.argmax())):
                entry = float(values.ravel()[tet])
                if not self.bounds.allows(entry):
                    where = f" (tet {tet})" if values.ndim else ""
                    raise SceneError(f"{what} is {entry:g}{where}; it must be {self.bounds.needed(entry)}")
        return values if values.ndim else value


@dataclass(frozen=True)
class Integer(Validator):
    """A whole number of at least `least`, and at most `most`."""

    least: int = 0
    most: int | None = None

    def checked(self, value: Any, what: str) -> int:
        if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < self.least:
            beginning = "from 0" if self.least == 0 else f"of {'one' if self.least == 1 else self.least} or more"
            raise SceneError(f"{what} is {value!r}; give a whole number {beginning}")
        if self.most is not None and value > self.most:
            raise SceneError(f"{what} is {value!r}; give at most {self.most}")
        return int(value)


COUNT = Integer(1, 100_000)


@dataclass(frozen=True)
class Counts(Validator):
    """A number of whole numbers of one or more."""

    count: int

    def checked(self, value: Any, what: str) -> tuple[int, ...]:
        try:
            numbers = tuple(value)
        except TypeError:
            numbers = ()
        if len(numbers) != self.count or not all(isinstance(n, (int, np.integer)) and n >= 1 for n in numbers):
            words = ("one", "two", "three")[self.count - 1]
            raise SceneError(f"{what} is {value!r}; give {words} whole numbers of 1 or more")
        return tuple(map(int, numbers))


@dataclass(frozen=True)
class Boolean(Validator):
    """True or False."""

    def checked(self, value: Any, what: str) -> bool:
        if not isinstance(value, (bool, np.bool_)):
            raise SceneError(f"{what} is {value!r}; give True or False")
        return bool(value)


@dataclass(frozen=True)
class Choice(Validator):
    """One of several words, or in Python an object of the class `instead`."""

    words: tuple[str, ...]
    instead: type | None = None

    def checked(self, value: Any, what: str) -> Any:
        if self.instead is not None and isinstance(value, self.instead):
            return value
        if not isinstance(value, str) or value not in self.words:
            *others, last = map(repr, self.words)
            raise SceneError(f"{what} is {value!r}; give {', '.join(others)} or {last}")
        return value


@dataclass(frozen=True)
class Union(Validator):
    """A value of a validator, or one word."""

    validator: Validator
    word: str

    def checked(self, value: Any, what: str) -> Any:
        if isinstance(value, str) and value == self.word:
            return value
        try:
            return self.validator.checked(value, what)
        except SceneError as error:
            raise SceneError(f"{error}, or {self.word!r}") from None


@dataclass(frozen=True)
class Name(Validator):
    """A name; see `check_name`. Kinds check their names first, because messages contain them."""

    def checked(self, value: Any, what: str) -> str:
        check_name(value, what)
        return value


@dataclass(frozen=True)
class BodyName(Name):
    """The name of a body. A scene checks that such a body exists.

    Attributes
    ----------
    obstacles : whether it may also be the name of an obstacle
    soft : whether the body must be soft, or must be rigid; None where it may be either; why : of that, in messages
    """

    obstacles: bool = False
    soft: bool | None = None
    why: str = ""

    def bodies(self, value: Any) -> tuple[str, ...]:
        return (value,)


@dataclass(frozen=True)
class Vector(Validator):
    """Three finite numbers (3,)."""

    def checked(self, value: Any, what: str) -> NDArray[np.float64]:
        return finite_vector(value, what)


@dataclass(frozen=True)
class Direction(Validator):
    """A vector (3,) of any length above zero, stored as a unit vector."""

    def checked(self, value: Any, what: str) -> NDArray[np.float64]:
        return unit_vector(value, what)


@dataclass(frozen=True)
class Extents(Validator):
    """Three numbers (3,) above zero."""

    def checked(self, value: Any, what: str) -> NDArray[np.float64]:
        vector = finite_vector(value, what)
        if np.any(vector <= 0.0):
            raise SceneError(f"{what} is {vector.tolist()}; every edge must be above zero")
        return vector


@dataclass(frozen=True)
class Limits(Validator):
    """Two numbers (low, high), the first below the second; an end may be infinite."""

    remedy: str = "exchange them"

    def checked(self, value: Any, what: str) -> tuple[float, float]:
        ends = float_array(value, what, "give two numbers (low, high)")
        if ends.shape != (2,) or np.isnan(ends).any():
            raise SceneError(f"{what} is {value!r}; give two numbers (low, high)")
        low, high = float(ends[0]), float(ends[1])
        if not low < high:
            raise SceneError(f"{what} are ({low:g}, {high:g}), and the first is not below the second; {self.remedy}")
        return low, high


@dataclass(frozen=True)
class ListOf(Validator):
    """A list of numbers, vectors, pairs of positive numbers, or pairs of rows; the kind checks shapes and values.

    Attributes
    ----------
    things : "numbers", "vectors", "pairs" or "rows", or several of them; most : the largest length in a scene file
    """

    things: tuple[str, ...] = ("numbers",)
    most: int | None = None

    def checked(self, value: Any, what: str) -> NDArray[Any]:
        numbers = float_array(value, what, "give a list of numbers")
        if numbers.ndim == 0:
            raise SceneError(f"{what} is {value!r}; give a list of numbers")
        if self.things == ("rows",):
            if numbers.shape[1:] != (2,) or not np.array_equal(numbers, np.abs(numbers).astype(np.int32)):
                raise SceneError(f"{what} are not pairs of whole numbers from 0; give rows such as [0, 1]")
            return numbers.astype(np.int32)
        return numbers


NUMBERS, VECTORS = ListOf(), ListOf(("vectors",))


@dataclass(frozen=True)
class Instance(Validator):
    """An object of one of several classes, for each of which scene files have keys of their own; give : the remedy."""

    classes: tuple[type, ...]
    give: str

    def checked(self, value: Any, what: str) -> Any:
        if not isinstance(value, self.classes):
            raise SceneError(f"{what} is a {type(value).__name__}; give {self.give}")
        return value


@dataclass(frozen=True)
class OneOf(Validator):
    """An object of one of several classes; a scene file names them by their `kind`, or one alone without.

    Attributes
    ----------
    classes : all of them; give : the remedy where the object is of another one
    base : of what Python may give besides
    """

    classes: Sequence[type]
    give: str
    base: type | None = None

    def checked(self, value: Any, what: str) -> Any:
        if not isinstance(value, self.base or tuple(self.classes)):
            raise SceneError(f"{what} is {value!r}; give {self.give}")
        return value
