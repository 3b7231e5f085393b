"""A suggestion for an unknown name."""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from typing import TypeVar

from supple.errors import SceneError

# Symbols of formulas, for which no similar name exists.
_SYMBOLS = {"E": "youngs", "nu": "poisson", "rho": "density", "mu": "friction", "tau": "damping", "g": "gravity"}


def suggestion(name: str, known: Sequence[str]) -> str:
    """The known name most similar to `name`, or a list of known names."""
    name = _SYMBOLS.get(name, name) if _SYMBOLS.get(name) in known else name
    written = (name, name.lower().replace("-", "_").replace(" ", "_"))
    near = next((close for one in written if (close := difflib.get_close_matches(one, known, n=1, cutoff=0.6))), None)
    if near:
        return f"did you mean {near[0]!r}?"
    listed = ", ".join(map(repr, known[:12]))
    return f"there are {listed}{', ...' if len(known) > 12 else ''}"


class UnknownNameError(SceneError, KeyError):
    """A name that does not exist among those of one kind."""

    __str__ = Exception.__str__  # not that of KeyError, which puts quotes around the text


Value = TypeVar("Value")


class Named(dict[str, Value]):
    """Things by name; an unknown name is an error with a suggestion.

    Parameters
    ----------
    thing : what has a name: "body"; items : by name
    """

    def __init__(self, thing: str, items: Mapping[str, Value]) -> None:
        super().__init__(items)
        self._thing = thing

    def __missing__(self, name: str) -> Value:
        raise UnknownNameError(f"{self._thing} {name!r} does not exist; {suggestion(name, list(self))}")
