"""Every public name is documented: what it is, every parameter, units of what has a dimension, and errors."""

import inspect
import operator
import re

import pytest

import supple as sp

SPACES = ("obstacles", "studies")
NAMES = [name for name in sp.__all__ if name not in ("shapes", "__version__", *SPACES)]
NAMES += [f"{space}.{name}" for space in SPACES for name in getattr(sp, space).__all__ if name not in NAMES]
_HEADING = re.compile(r"^(Parameters|Attributes|Raises|Returns|Yields)\n-+$", flags=re.M)
# They take what they are given.
_NEVER_RAISE = ("ProgressBar",)
# Numbers with a dimension, by the types that signatures give them.
_NUMBER = re.compile(r"\bfloat\b|ArrayLike|NDArray\[np.float|\bPlace\b")
_UNIT = re.compile(
    r"\[[^\]]+\]|\b(share|fraction|ratio|coefficient|factor|angle|indices|rows|unit vectors?|in the unit|see)\b"
)


def docs_of(thing):
    """The docstrings of a function, or of a class and its bases."""
    kinds = [c for c in thing.__mro__ if c.__module__.startswith("supple")] if inspect.isclass(thing) else [thing]
    return [
        inspect.cleandoc(kind.__dict__.get("__doc__") or "" if inspect.isclass(kind) else kind.__doc__ or "")
        for kind in kinds
    ]


def items(doc):
    """Text by name of what the sections Parameters and Attributes of a docstring describe."""
    _, *parts = _HEADING.split(doc)
    found = {}
    for heading, body in zip(parts[::2], parts[1::2], strict=True):
        if heading in ("Parameters", "Attributes"):
            for match in re.finditer(
                r"(?:^|; )((?:\*{0,2}[a-zA-Z_]\w*(?:, )?)+) : (.*?)(?=(?:; [a-z_]\w*(?:, \w+)* : )|^\S|\Z)",
                body,
                flags=re.S | re.M,
            ):
                found |= dict.fromkeys(match[1].replace("*", "").split(", "), match[2])
    return found


def parameters(thing):
    signature = inspect.signature(thing)
    return {name: p for name, p in signature.parameters.items() if not name.startswith("_")}


@pytest.mark.parametrize("name", NAMES)
def test_a_public_name_is_documented(name):
    thing = operator.attrgetter(name)(sp)
    docs = docs_of(thing)
    assert docs[0], "no docstring"
    if inspect.isclass(thing) and issubclass(thing, (Exception, str)):
        return
    described: dict[str, str] = {}
    for doc in reversed(docs):
        described |= items(doc)
    problems = []
    for parameter, given in parameters(thing).items():
        text = described.get(parameter)
        if text is None:
            problems.append(f"{parameter} is not described")
        elif _NUMBER.search(str(given.annotation)) and not _UNIT.search(text):
            problems.append(f"{parameter} ({given.annotation}) has no unit: {text!r}")
    all_docs = "\n".join(docs)
    if (inspect.isfunction(thing) or "Parameters\n---" in all_docs) and (
        "Raises\n---" not in all_docs and name not in _NEVER_RAISE
    ):
        problems.append("the section Raises is missing")
    assert not problems, "; ".join(problems)
