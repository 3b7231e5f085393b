"""What docstrings say about the parameters of a class: the one description of a parameter, wherever it is shown."""

from __future__ import annotations

import inspect
import re

_HEADING = re.compile(r"^(Parameters|Attributes|Raises|Returns|Yields)\n-+\n", flags=re.M)
_ITEM = re.compile(r"(?:^|; )((?:[a-zA-Z_]\w*(?:, )?)+) : (.*?)(?=(?:; [a-z_]\w*(?:, \w+)* : )|^\S|\Z)", re.S | re.M)


def first_paragraph(kind: type) -> str:
    """The beginning of the class's docstring, on one line."""
    return " ".join(inspect.cleandoc(kind.__dict__.get("__doc__") or "").partition("\n\n")[0].split())


def descriptions(kind: type) -> dict[str, str]:
    """By name of the parameter, its text on one line; a class's own docstring comes before those of its bases."""
    found: dict[str, str] = {}
    for base in reversed(kind.__mro__):
        _, *parts = _HEADING.split(inspect.cleandoc(base.__dict__.get("__doc__") or ""))
        for heading, body in zip(parts[::2], parts[1::2], strict=True):
            if heading == "Parameters":
                for match in _ITEM.finditer(body):
                    text = " ".join(match[2].split()).removesuffix(".")
                    found |= dict.fromkeys(match[1].split(", "), text)
    return found
