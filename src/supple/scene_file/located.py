"""Errors with the keys of the scene file at which they occurred."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from supple.errors import SceneError, SuppleError
from supple.scene_file.yaml_reader import Key


class LocatedError(SceneError):
    """An error in the part of a scene file at `keys`."""

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
