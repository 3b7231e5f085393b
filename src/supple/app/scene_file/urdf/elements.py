"""Elements of a URDF file, each with its line; their attributes and numbers.

The parser is Python's own. A document type declaration is refused where it begins, so that no entity is ever expanded.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

import numpy as np

from supple.app.scene_file.yaml_files import MAX_DEPTH, printable

_LARGEST = 16 * 2**20  # bytes
_LARGEST_NUMBER = 1e90  # products of three of them are numbers


class Problem(Exception):
    """What is wrong, and in which line; without the name of the file."""

    def __init__(self, text: str, line: int | None = None) -> None:
        super().__init__(text)
        self.line = line


@dataclass(eq=False)
class Element:
    """One element: its attributes as texts, and its children. owner : the link or joint that it is or belongs to."""

    tag: str
    attributes: dict[str, str]
    line: int
    owner: str
    children: list[Element] = field(default_factory=list)

    def problem(self, text: str) -> Problem:
        """What is wrong with this element."""
        return Problem(f"{self.owner}: {text}", self.line)

    def all(self, tag: str) -> list[Element]:
        """The children with a tag."""
        return [child for child in self.children if child.tag == tag]

    def only(self, tag: str) -> Element | None:
        """The child with a tag, or None; raises `Problem` where there are several."""
        found = self.all(tag)
        if len(found) > 1:
            raise found[1].problem(f"its <{self.tag}> has {len(found)} <{tag}>; give one")
        return found[0] if found else None

    def child(self, tag: str) -> Element:
        """The only child with a tag; raises `Problem` where none exists, or another one."""
        found = self.only(tag)
        if found is None:
            raise self.problem(f"its <{self.tag}> has no <{tag}>")
        return found

    def text(self, key: str) -> str:
        """An attribute; raises `Problem` where none exists."""
        value = self.attributes.get(key, "").strip()
        if not value:
            raise self.problem(f"its <{self.tag}> has no {key}")
        return value

    def numbers(self, key: str, count: int, default: float | None = None) -> tuple[float, ...]:
        """The numbers of an attribute, of 1e90 at most; `default` where it is missing, unless it is None.

        Raises
        ------
        Problem : where there are others, or not as many.
        """
        if default is not None and key not in self.attributes:
            return (default,) * count
        text = self.text(key)
        what = f"{key} of its <{self.tag}> is {printable(text)!r}"
        values = tuple(_floats(text))
        if "${" in text or "$(" in text:
            raise self.problem(f"{what}, a macro; {EXPAND}")
        if len(values) != count or not np.isfinite(values).all():
            raise self.problem(f"{what}; give {'one finite number' if count == 1 else f'{count} finite numbers'}")
        if np.abs(values).max() > _LARGEST_NUMBER:
            raise self.problem(f"{what}; give at most {_LARGEST_NUMBER:g}")
        return values

    def number(self, key: str, default: float | None = None) -> float:
        """As `numbers`, one of them."""
        return self.numbers(key, 1, default)[0]


EXPAND = "expand it first: xacro robot.urdf.xacro > robot.urdf (of ROS, or `pip install xacro`)"


def parsed(path: Path) -> Element:
    """The root of a URDF file; raises `Problem` where it cannot be read."""
    try:
        data = path.read_bytes()
    except OSError as error:
        raise Problem(f"cannot be read: {error.strerror or error}") from None
    if len(data) > _LARGEST:
        raise Problem(f"larger than {_LARGEST // 2**20} MiB; a URDF names its meshes, it does not contain them")
    reader = _Reader()
    try:
        data.decode("utf-8-sig")
        reader.parser.Parse(data.strip(), True)
    except (UnicodeDecodeError, LookupError):  # of what it says itself, too
        raise Problem("this is not UTF-8 text; save it as UTF-8") from None
    except (expat.ExpatError, ValueError):
        line = reader.parser.ErrorLineNumber
        raise Problem("it is not well-formed XML: truncated, or not a URDF file", line) from None
    root = reader.root
    assert root is not None
    if root.tag != "robot":
        raise Problem(f"its root is <{printable(root.tag)}>; a URDF file has <robot>", root.line)
    return root


class _Reader:
    """Makes elements of what the parser finds."""

    def __init__(self) -> None:
        self.root: Element | None = None
        self.open: list[Element] = []
        self.parser = expat.ParserCreate()
        self.parser.StartElementHandler = self._begin
        self.parser.EndElementHandler = lambda _: self.open.pop()
        self.parser.StartDoctypeDeclHandler = self._refuse

    def _begin(self, tag: str, attributes: dict[str, str]) -> None:
        line = self.parser.CurrentLineNumber
        if tag.startswith("xacro:"):
            raise Problem(f"<{printable(tag)}> is a macro; {EXPAND}", line)
        if len(self.open) == MAX_DEPTH:
            raise Problem(f"elements are nested too deeply; at most {MAX_DEPTH} levels are allowed", line)
        owner = self.open[-1].owner if len(self.open) > 1 else _owner(tag, attributes)
        element = Element(tag, attributes, line, owner)
        if self.open:
            self.open[-1].children.append(element)
        else:
            self.root = element
        self.open.append(element)

    def _refuse(self, *_: object) -> None:
        line = self.parser.CurrentLineNumber
        raise Problem("it has a document type declaration, which URDF does not need; remove it", line)


def _owner(tag: str, attributes: dict[str, str]) -> str:
    name = attributes.get("name", "").strip()
    return f"{printable(tag)} {printable(name)!r}" if name else f"a <{printable(tag)}> without a name"


def _floats(text: str) -> Iterator[float]:
    """The words of a text as numbers; files of robots also have commas between them."""
    for word in text.replace(",", " ").split():
        try:
            yield float("nan" if "_" in word else word)
        except ValueError:
            yield float("nan")
