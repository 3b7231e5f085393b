"""Stops a long computation from outside, at points where nothing is half done.

A solver calls `interruption_point` where its data are consistent: at the start of a substep or of a Newton iteration.
The caller of the solver may set a check, which may raise there. An exception at an arbitrary instruction could leave a
setting of the process changed, such as the number of threads.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

_check: ContextVar[Callable[[], None] | None] = ContextVar("interruption check", default=None)


def interruption_point() -> None:
    """Run the check of the caller, if there is one; it may raise."""
    check = _check.get()
    if check is not None:
        check()


@contextmanager
def interruptible(check: Callable[[], None]) -> Iterator[None]:
    """Run `check` at every interruption point that this thread reaches within the block."""
    token = _check.set(check)
    try:
        yield
    finally:
        _check.reset(token)
