"""The bytes and lines of files, with errors that name the file or the line."""

from __future__ import annotations

import codecs
import re
from collections.abc import Iterator, Sequence
from pathlib import Path

from supple.errors import MeshError
from supple.mesh.io.cells import FormatError

# What begins so is not a mesh: what it is, and what to do.
_OTHERS = {
    b"version https://git-lfs": "it is a pointer of Git LFS, not the file itself; fetch that: git lfs pull",
    b"/annex/objects/": "it is a pointer of git-annex, not the file itself; fetch that: git annex get",
    b"<!doctype html": "it is a web page, not the file itself; download that again",
    b"<html": "it is a web page, not the file itself; download that again",
    b"<error>": "it is the error of a server, not the file itself; download that again",
    b"404: not found": "it is the error of a server, not the file itself; download that again",
    b"%pdf-": "it is a PDF",
    b"\x89hdf": "it is an HDF5 file; a recording ends in .vtkhdf",
    b"\x1f\x8b": "it is compressed by gzip; unpack it first",
    b"bzh": "it is compressed by bzip2; unpack it first",
    b"\xfd7zxz": "it is compressed by xz; unpack it first",
    b"\x28\xb5\x2f\xfd": "it is compressed by zstd; unpack it first",
    b"7z\xbc\xaf": "it is a 7z archive; unpack it first",
}
_XML_HEAD = re.compile(rb"\s*<\?xml[^>]*>\s*")


def file_contents(path: Path) -> bytes:
    """All bytes of a regular file that is not blank; text in UTF-16 as UTF-8.

    Raises
    ------
    MeshError : naming the file and the reason, also where its beginning shows that it is something else than a mesh.
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
    begin = _XML_HEAD.sub(b"", without_mark(data[:1000]), count=1).lstrip()[:32].lower()
    for sign, reason in _OTHERS.items():
        if begin.startswith(sign):
            raise MeshError(f"{path}: {reason}")
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        try:
            return data.decode("utf-16").encode()
        except UnicodeError:
            raise MeshError(f"{path}: it is text in UTF-16, and damaged; save it as UTF-8") from None
    return data


def file_beside(path: Path, name: str) -> bytes:
    """The contents of a file that another one, `path`, names: only from the folder of that file, and those below it.

    Raises
    ------
    FormatError : where the name leads elsewhere. MeshError : as of `file_contents`.
    """
    folder, shown = path.parent.resolve(), shortened([name])
    relative = Path(name.replace("\\", "/"))
    try:
        there = (folder / relative).resolve()
        inside = not relative.is_absolute() and ":" not in name and there.is_relative_to(folder)
    except (OSError, ValueError, RuntimeError):
        inside = False
    if not inside:
        raise FormatError(
            f"it names the file '{shown}', which is outside of its folder; put it there, name it by its name"
        )
    return file_contents(path.parent / relative)


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


def numbers(words: Sequence[str], count: int, line: int | str, what: str) -> list[float]:
    """The first `count` words as floats."""
    if len(words) < count:
        raise FormatError(f"{what} needs {count} numbers, but the line has {len(words)}", line)
    try:
        return [float(w) for w in words[:count]]
    except ValueError:
        raise FormatError(f"{what} is '{shortened(words[:count])}', which is not {count} numbers", line) from None


def integer(word: str, line: int | str, what: str) -> int:
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
