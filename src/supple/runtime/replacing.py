"""Writing files so that each is whole or not there: under a temporary name in the same folder, then renamed.

A file that is there before is replaced in one moment, also where the power fails. Several files that belong together,
and folders, are replaced together. What killed writers left behind is deleted by the next writer of the same file.
"""

from __future__ import annotations

import os
import platform
import re
import shutil
import time
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from uuid import uuid4

from supple.errors import OutputError, SuppleError

_A_DAY = 86_400.0


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """A temporary path to write to; it becomes `path` where the block succeeds, and is deleted where it fails.

    Raises
    ------
    OutputError : where the system refuses.
    """
    parent_folder(path)
    with whole_files(path) as fresh:
        yield fresh[path]


@contextmanager
def whole_files(*paths: Path, error: type[SuppleError] = OutputError) -> Iterator[dict[Path, Path]]:
    """A temporary path for each path; all of them replace `paths` where the block succeeds, and none where it fails.

    Where the process is killed between two renames, files are missing; old and new files are never there together.

    Raises
    ------
    error : where the system refuses; the text names the file.
    """
    for path in paths:
        if path.is_dir():
            raise error(f"{path}: is a folder; give the name of a file")
        if path.exists() and not path.is_file():
            raise error(f"{path}: is not an ordinary file; give the name of one")
    with _replacements(paths, error) as fresh:
        yield fresh


@contextmanager
def whole_folder(path: Path) -> Iterator[Path]:
    """A temporary folder to fill; it becomes `path`, instead of a folder of that name that was written before.

    A folder that holds anything other than files with the same suffixes is left alone.

    Raises
    ------
    OutputError : where the system refuses, or `path` exists and holds other files.
    """
    parent_folder(path)
    if path.exists() and not path.is_dir():
        raise OutputError(f"{path}: is a file; give the name of a folder")
    with _replacements((path,), OutputError) as fresh:
        fresh[path].mkdir()
        yield fresh[path]
        suffixes = {file.suffix for file in fresh[path].iterdir()}
        for file in path.iterdir() if path.exists() else ():
            if file.is_dir() or file.suffix not in suffixes:
                raise OutputError(f"{path}: holds {file.name!r}, which Supple did not write; give a new folder")


def output_error(path: Path, error: OSError) -> OutputError:
    """The one line for a path that the system does not let us write."""
    return OutputError(_cannot_be_written(path, error))


def parent_folder(path: Path) -> Path:
    """The folder that `path` goes to; it is made where it is missing.

    Raises
    ------
    OutputError : where it cannot be made.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except FileExistsError:
        raise OutputError(
            f"{path.parent}: is not a folder, and must be one to hold {path.name}; give another"
        ) from None
    except OSError as error:
        raise output_error(path.parent, error) from None
    return path.parent


def refuse_to_replace(source: Path, output: Path) -> None:
    """Raise `OutputError` where `output` is the file that is read."""
    with suppress(OSError):  # the reader and the writer report files that are missing or cannot be reached
        if output.samefile(source):
            raise OutputError(f"{output}: is {source} itself, which is read; give another name")


def temporary_name(path: Path) -> Path:
    """An unused name beside `path`, hidden and with its suffix, that contains the number of this process."""
    return path.with_name(f".{path.stem}.supple-{_machine()}-{os.getpid()}-{uuid4().hex[:8]}{path.suffix}")


def put_in_place(fresh: Path, path: Path) -> None:
    """Rename a file over `path` once its bytes are on the disk; or a folder, whose files may not be on it yet.

    Without that, some file systems would rename first and write later: after a power failure, `path` would be empty.

    Raises
    ------
    OSError : where the system refuses.
    """
    if not fresh.is_dir():
        with fresh.open("r+b") as file:
            os.fsync(file.fileno())
    os.replace(fresh, path)
    # The name must be on the disk too. Only POSIX can open folders; other systems write names themselves.
    if os.name == "posix":
        with suppress(OSError):
            folder = os.open(path.parent, os.O_RDONLY)
            try:
                os.fsync(folder)
            finally:
                os.close(folder)


def remove_abandoned(path: Path) -> None:
    """Delete what writers of `path` left under temporary names when they were killed.

    A writer is gone if its process is. Names from other machines, and all names on systems that are not POSIX, are
    deleted after a day.
    """
    names = re.compile(
        rf"\.{re.escape(path.stem)}\.supple-(?P<machine>\w+)-(?P<process>\d+)-\w+{re.escape(path.suffix)}"
    )
    with suppress(OSError):  # a failure to clean up must not fail the writer
        for file in path.parent.iterdir():
            match = names.fullmatch(file.name)
            if match is None:
                continue
            with suppress(OSError):
                here = match["machine"] == _machine() and os.name == "posix"
                if _is_gone(int(match["process"])) if here else time.time() - file.stat().st_mtime > _A_DAY:
                    _remove(file)


@contextmanager
def _replacements(paths: tuple[Path, ...], error: type[SuppleError]) -> Iterator[dict[Path, Path]]:
    fresh = {path: temporary_name(path) for path in paths}
    try:
        yield fresh
        _put_in_place_together(fresh)
    except OSError as reason:
        # Files are written, and put in place, in this order: the last temporary one is that which failed.
        failed = next((path for path in reversed(paths) if fresh[path].exists()), paths[0])
        raise error(_cannot_be_written(failed, reason)) from None
    finally:
        for new in fresh.values():
            _remove(new)
    for path in paths:
        remove_abandoned(path)


def _put_in_place_together(fresh: Mapping[Path, Path]) -> None:
    """Rename each new file or folder to its path; where one fails, what was there before is put back."""
    if len(fresh) == 1:
        ((path, new),) = fresh.items()
        if not new.is_dir():
            put_in_place(new, path)  # replaces the old file in one moment
            return
    old = {path: temporary_name(path) for path in fresh}
    placed: list[Path] = []
    try:
        for path in fresh:
            if path.exists():
                os.replace(path, old[path])
        for path, new in fresh.items():
            put_in_place(new, path)
            placed.append(path)
    except BaseException:  # a KeyboardInterrupt must not leave half of them either
        for path in placed:
            _remove(path)
        for path, saved in old.items():
            if saved.exists():
                os.replace(saved, path)
        raise
    for saved in old.values():
        _remove(saved)


def _cannot_be_written(path: Path, error: OSError) -> str:
    return f"{path}: cannot be written: {error.strerror or error}; choose another place or make room there"


def _remove(path: Path) -> None:
    with suppress(OSError):
        if path.is_dir():
            shutil.rmtree(path)
        else:
            path.unlink(missing_ok=True)


@cache
def _machine() -> str:
    """What a process number is unique on: a machine, or on Linux a container."""
    try:
        container = os.readlink("/proc/self/ns/pid")
    except OSError:
        container = ""
    return f"{zlib.crc32(f'{platform.node()} {container}'.encode()):08x}"


def _is_gone(process: int) -> bool:
    try:
        os.kill(process, 0)  # POSIX: signal 0 only asks whether the process exists
    except (OSError, OverflowError) as error:
        return isinstance(error, ProcessLookupError)
    return False
