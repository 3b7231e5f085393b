"""Elements of a URDF file: parsing, children, attributes and numbers.

The parser is Python's own. Document type declarations are refused, so that no entity is ever expanded.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from supple.app.scene_file.yaml_files import printable

_LARGEST = 16 * 2**20  # bytes
_LARGEST_NUMBER = 1e90  # products of three of them are numbers


class Problem(Exception):
    """What is wrong, without the name of the file."""


def parsed(path: Path) -> ElementTree.Element:
    """The root of a URDF file; raises `Problem` where it cannot be read."""
    try:
        data = path.read_bytes()
    except OSError as error:
        raise Problem(f"cannot be read: {error.strerror or error}") from None
    if len(data) > _LARGEST:
        raise Problem(f"larger than {_LARGEST // 2**20} MiB; a URDF names its meshes, it does not contain them")
    parser = ElementTree.XMLParser()
    try:
        # Entities need a declaration, and with it a document type.
        if "<!" in data.decode("utf-8-sig").replace("<!--", "").replace("<![CDATA[", ""):
            raise Problem("it has a document type declaration, which URDF does not need; remove it")
        parser.feed(data)
        root = parser.close()
    except (UnicodeDecodeError, LookupError):  # of what it says itself, too
        raise Problem("this is not UTF-8 text; save it as UTF-8") from None
    except (ElementTree.ParseError, ValueError) as error:
        line = getattr(error, "position", (0, 0))[0]
        raise Problem(f"it is not well-formed XML (line {line}): truncated, or not a URDF file") from None
    if root.tag != "robot":
        raise Problem(f"its root is <{printable(root.tag)}>; a URDF file has <robot>")
    return root


def child_of(element: ElementTree.Element, tag: str, what: str) -> ElementTree.Element:
    """The only child with a tag; raises `Problem`, which names `what`, where there is none or another one."""
    found = only(element, tag, what)
    if found is None:
        raise Problem(f"{what}: its <{element.tag}> has no <{tag}>")
    return found


def only(element: ElementTree.Element, tag: str, what: str) -> ElementTree.Element | None:
    """As `child_of`, None where there is none."""
    found = element.findall(tag)
    if len(found) > 1:
        raise Problem(f"{what}: its <{element.tag}> has {len(found)} <{tag}>; give one")
    return found[0] if found else None


def ignore_others(element: ElementTree.Element, known: tuple[str, ...], what: str, ignored: dict[str, None]) -> None:
    """Note children with other tags than the known ones."""
    for child in element:
        if child.tag not in known:
            ignored[f"<{printable(str(child.tag))}> of {what}"] = None


def attribute(element: ElementTree.Element, key: str, what: str) -> str:
    """The text of an attribute; raises `Problem` where there is none."""
    value = element.get(key, "").strip()
    if not value:
        raise Problem(f"{what}: its <{element.tag}> has no {key}")
    return value


def numbers(element: ElementTree.Element, key: str, what: str, count: int) -> tuple[float, ...]:
    """The numbers of an attribute, of 1e90 at most; raises `Problem` where there are others or not as many."""
    text = attribute(element, key, what)
    values = tuple(_floats(text))
    if len(values) != count or not np.isfinite(values).all():
        wanted = "one finite number" if count == 1 else f"{count} finite numbers"
        raise Problem(f"{what}: {key} of its <{element.tag}> is {printable(text)!r}; give {wanted}")
    if np.abs(values).max() > _LARGEST_NUMBER:
        raise Problem(f"{what}: {key} of its <{element.tag}> is {printable(text)!r}; give at most {_LARGEST_NUMBER:g}")
    return values


def _floats(text: str) -> Iterator[float]:
    for word in text.split():
        try:
            yield float("nan" if "_" in word else word)
        except ValueError:
            yield float("nan")
