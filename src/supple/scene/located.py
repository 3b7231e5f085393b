"""Errors with the part of a scene that is wrong, by its keys: `("pins", 1, "vertices")`, as in a scene file."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from supple.errors import SceneError, SuppleError

Key = str | int


class LocatedError(SceneError):
    """An error in the part of a scene at `keys`."""

    def __init__(self, keys: tuple[Key, ...], message: str) -> None:
        super().__init__(message)
        self.keys = keys


@contextmanager
def at(*keys: Key) -> Iterator[None]:
    """Prepend `keys` to those of an error raised in the block."""
    try:
        yield
    except LocatedError as error:
        raise LocatedError((*keys, *error.keys), str(error)) from None
    except SuppleError as error:
        raise LocatedError(keys, str(error)) from None
