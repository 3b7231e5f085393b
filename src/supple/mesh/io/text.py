"""The bytes and lines of files, with errors that name the file or the line."""

from __future__ import annotations

import codecs
from collections.abc import Iterator, Sequence
from pathlib import Path

from supple.errors import MeshError
from supple.mesh.io.cells import FormatError


def file_contents(path: Path) -> bytes:
    """All bytes of a regular file that is not blank.

    Raises
    ------
    MeshError : naming the file and the reason.
    """
    try:
        if path.is_dir():
            raise MeshError(f"{path}: it is a folder; give the path of a mesh file")
        if path.exists() and not path.is_file():
            raise MeshError(f"{path}: it is not a regular file")
        data = path.read_bytes()
    except FileNotFoundError:
        raise MeshError(f"{path}: the file does not exist") from None
    except MemoryError:
        raise MeshError(f"{path}: it is too large for the memory of this machine") from None
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else error
        raise MeshError(f"{path}: it cannot be read: {reason}") from None
    if not data.strip():
        raise MeshError(f"{path}: it is empty")
    return data


def without_mark(data: bytes) -> bytes:
    """The data after the byte order mark that some editors write at the start.

    As a part of the first word, the mark would hide an OBJ file's first vertex.
    """
    return data.removeprefix(codecs.BOM_UTF8)


def decoded(data: bytes) -> str:
    """Text of a file with lines that end in a line feed, or a `FormatError` where it is binary."""
    if b"\0" in data:
        raise FormatError("it is not a text file; is the extension right?", data[: data.index(b"\0")].count(b"\n") + 1)
    text = without_mark(data).decode("utf-8", errors="replace")
    # Lines of old Macs end in a carriage return alone.
    return text if "\n" in text else text.replace("\r", "\n")


def meaningful_lines(text: str) -> Iterator[tuple[int, list[str]]]:
    """Number (1-based) and words of each line that is neither blank nor a comment after `#`."""
    number, start = 0, 0
    while start <= len(text):  # not text.split("\n"): a list of all lines takes several times the memory of the file
        end = text.find("\n", start)
        end = len(text) if end < 0 else end
        words = text[start:end].split("#", 1)[0].split()
        number, start = number + 1, end + 1
        if words:
            yield number, words


def numbers(words: Sequence[str], count: int, line: int, what: str) -> list[float]:
    """The first `count` words as floats."""
    if len(words) < count:
        raise FormatError(f"{what} needs {count} numbers, but the line has {len(words)}", line)
    try:
        return [float(w) for w in words[:count]]
    except ValueError:
        raise FormatError(f"{what} is '{shortened(words[:count])}', which is not {count} numbers", line) from None


def integer(word: str, line: int, what: str) -> int:
    """A word as an integer."""
    try:
        value = int(word)
        if abs(value) >= 2**62:
            raise ValueError
        return value
    except ValueError:
        raise FormatError(f"{what} is '{shortened([word])}', which is not an integer in range", line) from None


def shortened(words: Sequence[str]) -> str:
    """Words as printable text of bounded length, to be quoted in an error."""
    text = " ".join(words)
    text = "".join(c if c.isprintable() else "?" for c in text)
    return text if len(text) <= 60 else text[:57] + "..."
