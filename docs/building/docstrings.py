"""An extension of griffe that reads the docstrings of Supple.

Their sections are those of NumPy's style, with the text of an item on its own line: `youngs : stiffness [Pa]`. Griffe
expects it on lines of its own below the name. Public names in backticks become links.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

from griffe import Docstring, Extension, Object

sys.path.append(str(Path(__file__).parent))  # griffe loads this file alone

from api import path_of, public_names

_HEADING = re.compile(r"^(Parameters|Attributes|Raises|Returns|Yields)\n-+\n", flags=re.M)
# The next of several items on one line.
_NEXT = re.compile(r"; (?=[a-z]\w*(?:, [a-z]\w*)* : )")
_ITEM = re.compile(r"[\w, *.]+ : ")
_NAMES = public_names()


class OneLineItems(Extension):
    """Rewrite each docstring before it is parsed."""

    def on_object(self, *, obj: Object, **_: Any) -> None:
        if isinstance(obj.docstring, Docstring):
            obj.docstring.value = rewritten(obj.docstring.value)


def rewritten(text: str) -> str:
    """The docstring with the text of every item below its name, and with links."""
    first, *parts = _HEADING.split(text)
    texts, sections = [_linked(first.rstrip())], []
    for heading, body in zip(parts[::2], parts[1::2], strict=True):
        if heading in ("Returns", "Yields"):  # often without a name
            texts.append(f"**{heading}:** {_linked(body.strip())}")
            continue
        items, after = _items(body)
        sections.append(f"{heading}\n{'-' * len(heading)}\n" + "\n".join(items))
        texts += [_linked(after)] if after else []  # griffe has no text after a section
    return "\n\n".join([*texts, *sections])


def _items(body: str) -> tuple[list[str], str]:
    """The items of a section, and the text after them, which begins at the first line that is not an item."""
    lines, items = body.rstrip().split("\n"), []
    for number, line in enumerate(lines):
        if line and not line.startswith(" "):
            if not _ITEM.match(line):
                return items, "\n".join(lines[number:])
            for item in _NEXT.split(line):
                name, _, description = item.partition(" : ")
                items.append(name.strip())
                items.append("    " + _linked(description.strip()))
        else:
            items.append(_linked(line))
    return items, ""


def _linked(text: str) -> str:
    def link(match: re.Match[str]) -> str:
        name = match[1].removeprefix("supple.")
        return f"[`{match[1]}`][{path_of(name)}]" if name in _NAMES else match[0]

    return re.sub(r"(?<!\[)`([A-Za-z_.]+)`", link, text)
