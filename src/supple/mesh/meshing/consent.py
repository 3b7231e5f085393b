"""Asking whoever wants a mesh, where it becomes much larger than what was asked for."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

# The function that asks, and what says yes beforehand.
_ASK: ContextVar[tuple[Callable[[str], bool], str] | None] = ContextVar("ask", default=None)


@contextmanager
def asking(ask: Callable[[str], bool], beforehand: str) -> Iterator[None]:
    """Meshing inside puts its questions to `ask`, which returns whether to continue; an option says yes
    `beforehand`."""
    token = _ASK.set((ask, beforehand))
    try:
        yield
    finally:
        _ASK.reset(token)


def agreed(question: str) -> bool:
    """The answer; no where nobody is asked, as in a program or a scene file."""
    ask = _ASK.get()
    return ask is not None and ask[0](question)


def beforehand() -> str:
    """The option that says yes beforehand, with a comma; empty where nobody is asked."""
    ask = _ASK.get()
    return "" if ask is None else f", {ask[1]}"
