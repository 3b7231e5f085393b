"""Output appears whole or not at all: written under a temporary name in the same folder, then renamed."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from supple.errors import OutputError
from supple.replacing import put_in_place, remove_abandoned, temporary_name


def output_error(path: Path, error: OSError) -> OutputError:
    """The one line for a path that the system does not let us write."""
    return OutputError(f"{path}: cannot be written: {error.strerror or error}; choose another place or make room there")


def parent_folder(path: Path) -> Path:
    """The folder that `path` goes to, made where it is missing.

    Raises
    ------
    OutputError : where it cannot be made.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except FileExistsError:
        raise OutputError(f"{path.parent}: is no folder, and must be one to hold {path.name}; give another") from None
    except OSError as error:
        raise output_error(path.parent, error) from None
    return path.parent


def refuse_to_replace(source: Path, output: Path) -> None:
    """Raise `OutputError` where `output` is the very file that is read."""
    with suppress(OSError):  # of files that are not there, or cannot be reached: others will say so
        if output.samefile(source):
            raise OutputError(f"{output}: is {source} itself, which is read; give another name")


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """A temporary path to write to; it becomes `path` where the block ends well, and vanishes where it does not.

    Raises
    ------
    OutputError : where the system refuses.
    """
    parent_folder(path)
    if path.is_dir():
        raise OutputError(f"{path}: is a folder; give the name of a file")
    if path.exists() and not path.is_file():
        raise OutputError(f"{path}: is not an ordinary file; give the name of one")
    fresh = temporary_name(path)
    try:
        yield fresh
        put_in_place(fresh, path)
    except OSError as error:
        raise output_error(path, error) from None
    finally:
        fresh.unlink(missing_ok=True)
    remove_abandoned(path)


@contextmanager
def whole_folder(path: Path) -> Iterator[Path]:
    """A temporary folder to fill; it becomes `path`, in place of a folder of that name that we made before.

    A folder that holds anything else than files with the same suffixes is left alone.

    Raises
    ------
    OutputError : where the system refuses, or `path` is there already and is not ours.
    """
    parent_folder(path)
    if path.exists() and not path.is_dir():
        raise OutputError(f"{path}: is a file; give the name of a folder")
    fresh, aside = temporary_name(path), temporary_name(path)
    try:
        fresh.mkdir()
        yield fresh
        if path.exists():
            kinds = {file.suffix for file in fresh.iterdir()}
            foreign = [file.name for file in path.iterdir() if file.is_dir() or file.suffix not in kinds]
            if foreign:
                raise OutputError(f"{path}: holds {foreign[0]!r}, which is not ours to delete; give a new folder")
            os.replace(path, aside)
        put_in_place(fresh, path)
    except OSError as error:
        if aside.exists() and not path.exists():
            os.replace(aside, path)
        raise output_error(path, error) from None
    finally:
        shutil.rmtree(fresh, ignore_errors=True)
        shutil.rmtree(aside, ignore_errors=True)
    remove_abandoned(path)
