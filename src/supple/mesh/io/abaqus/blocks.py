"""The syntax of Abaqus's input files: keywords with options and data lines, and files that they include; their writer.

Source: Abaqus Analysis User's Guide, "Input syntax rules".
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.mesh.io.cells import FormatError
from supple.mesh.io.text import decoded, file_beside, integer, numbers

# Of all files that a deck includes: a file that includes two, each of which includes two ... grows without end.
_MOST_FILES, _MOST_BYTES = 1000, 2**30
# Their data lines may be empty: nothing is moved.
_PLACED = ("INSTANCE", "NCOPY", "SYSTEM")


class Line(NamedTuple):
    """The place of a data line, and its words, of which some may be empty."""

    place: int | str
    words: list[str]

    def integers(self, defaults: list[int | None], what: str) -> list[int]:
        """Whole numbers, as many as there are defaults; a default of None must be given."""
        words = [*self.words, *[""] * len(defaults)][: len(defaults)]
        for word, default in zip(words, defaults, strict=True):
            if not word and default is None:
                raise FormatError(f"{what} lacks a number", self.place)
        return [int(d or 0) if not w else integer(w, self.place, what) for w, d in zip(words, defaults, strict=True)]

    def floats(self, count: int, what: str) -> list[float]:
        """`count` numbers; those that are left out are zero. An exponent may be written with a D."""
        words = [*(word.upper().replace("D", "E") or "0" for word in self.words), *["0"] * count]
        if any("<" in word for word in words[:count]):
            raise FormatError(f"{what} is a value of *PARAMETER, which is not read", self.place)
        return numbers(words, count, self.place, what)


class Block(NamedTuple):
    """A keyword in capitals, its options, their names in capitals, its data lines, and its place."""

    keyword: str
    options: dict[str, str]
    lines: list[Line]
    place: int | str

    def named(self, option: str) -> str:
        """The value of an option that must be given."""
        value = self.options.get(option)
        if not value:
            raise FormatError(f"*{self.keyword} has no name; give {option}=...", self.place)
        return value

    def refuse(self, *options: str) -> None:
        """Raise where one of these options is given."""
        for option in options:
            if option in self.options:
                value = self.options[option]
                raise FormatError(
                    f"*{self.keyword}, {option}{'=' + value if value else ''} changes the mesh, and is not read; write "
                    "the deck with all its nodes and elements (as Abaqus/CAE does)",
                    self.place,
                )


def blocks(data: bytes, path: Path, with_data: frozenset[str]) -> Iterator[Block]:
    """The keywords of a deck and of the files that it includes, with the data lines of those in `with_data`.

    path : of the deck; it may include files of its folder, and of folders below
    """
    lines = _Lines(path)
    block, joined = Block("", {}, [], 0), ""
    for place, line in lines.of(decoded(data), ""):
        stripped = joined + line
        joined = ""
        if stripped.startswith("*") and stripped.endswith(","):  # a keyword line continues in the next one
            joined = stripped
        elif stripped.startswith("*"):
            yield block
            keyword, options = _keyword(stripped)
            block = Block(keyword, options, [], place)
            if keyword in with_data and options.get("INPUT"):
                more = (_data(*item) for item in lines.included(options["INPUT"], place))
                block.lines.extend(item for item in more if item.words)
        elif block.keyword in with_data:
            own = _data(place, stripped)
            if own.words or block.keyword in _PLACED:
                block.lines.append(own)
    if joined:
        yield block
        block = Block(*_keyword(joined), [], 0)
    yield block


def _keyword(line: str) -> tuple[str, dict[str, str]]:
    words = [word.strip() for word in line.split(",")]
    pairs = (word.partition("=") for word in words[1:])
    options = {" ".join(name.upper().split()): value.strip().strip('"') for name, _, value in pairs}
    return " ".join(words[0][1:].upper().split()), options


def _data(place: int | str, line: str) -> Line:
    words = [word.strip() for word in line.split(",")]
    while words and not words[-1]:
        words.pop()
    return Line(place, words)


class _Lines:
    """Lines that are neither blank nor comments, with those of included files in the place of *INCLUDE."""

    def __init__(self, path: Path) -> None:
        self._path, self._files, self._bytes = path, 0, 0

    def of(self, text: str, name: str) -> Iterator[tuple[int | str, str]]:
        for number, line in enumerate(text.split("\n"), start=1):
            stripped = line.strip()
            if not stripped or stripped.startswith("**"):
                continue
            place = f"{name}:{number}" if name else number
            if stripped[:8].upper() == "*INCLUDE":
                keyword, options = _keyword(stripped)
                if keyword == "INCLUDE":
                    if not options.get("INPUT"):
                        raise FormatError("*INCLUDE has no INPUT=...", place)
                    yield from self.included(options["INPUT"], place)
                    continue
            yield place, stripped

    def included(self, name: str, place: int | str) -> Iterator[tuple[int | str, str]]:
        self._files += 1
        try:
            data = file_beside(self._path, name)
            text = decoded(data)
        except FormatError as error:
            raise FormatError(error.reason, place) from None
        self._bytes += len(data)
        if self._files > _MOST_FILES or self._bytes > _MOST_BYTES:
            raise FormatError("it includes too many files: does one include itself?", place)
        try:
            yield from self.of(text, name)
        except RecursionError:
            raise FormatError(f"{name} includes itself", place) from None


def written(vertices: NDArray[np.float64], tets: NDArray[np.int32]) -> bytes:
    """A tet mesh as one part with its nodes and elements, and the set ALL of the latter."""
    name = "C3D4" if tets.shape[1] == 4 else "C3D10"
    out = ["*HEADING", "written by supple", "*NODE"]
    out += [f"{k}, {x!r}, {y!r}, {z!r}" for k, (x, y, z) in enumerate(vertices.tolist(), start=1)]
    out.append(f"*ELEMENT, TYPE={name}, ELSET=ALL")
    out += [f"{k}, " + ", ".join(str(i + 1) for i in row) for k, row in enumerate(tets.tolist(), start=1)]
    return ("\n".join(out) + "\n").encode()
