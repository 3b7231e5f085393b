"""Errors that know at which keys of the scene file they arose."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from supple.errors import SceneError, SuppleError
from supple.scene_file.yaml_reader import Key


class LocatedError(SceneError):
    """An error in building what stands at `keys` of a scene file."""

    def __init__(self, keys: tuple[Key, ...], message: str) -> None:
        super().__init__(message)
        self.keys = keys


@contextmanager
def at(*keys: Key) -> Iterator[None]:
    """Puts `keys` before those of an error that comes out of the block."""
    try:
        yield
    except LocatedError as error:
        raise LocatedError((*keys, *error.keys), str(error)) from None
    except SuppleError as error:
        raise LocatedError(keys, str(error)) from None
