"""How messages name the options of a meshing: as Python, as a scene file or as the shell does."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Literal

Writer = Literal["python", "yaml", "shell"]

_WRITER: ContextVar[Writer] = ContextVar("writer", default="python")


@contextmanager
def named_for(writer: Writer) -> Iterator[None]:
    """Messages inside are for the writer of a Python program, of a scene file (YAML) or of a command in the shell."""
    token = _WRITER.set(writer)
    try:
        yield
    finally:
        _WRITER.reset(token)


def option(name: str, value: bool | float | str | None = None) -> str:
    """An option, and its value where one is given: `repair=True`, `repair: true` or `--repair`."""
    writer = _WRITER.get()
    if writer == "shell":
        flag = f"--{name.replace('_', '-')}"
        return flag if value is None or value is True else f"{flag} {_number(value)}"
    if value is None:
        return name
    if writer == "yaml":
        return f"{name}: {_number(value)}"
    return f"{name}={json.dumps(value) if isinstance(value, str) else _number(value, python=True)}"


def _number(value: bool | float | str, *, python: bool = False) -> str:
    if isinstance(value, bool):
        return str(value) if python else str(value).lower()
    return f"{value:.6g}" if isinstance(value, float) else str(value)
