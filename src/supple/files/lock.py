"""A lock on a folder. The operating system releases it when its process ends, however that happens."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from supple.errors import OutputError
from supple.files.replacing import output_error

LOCK_NAME = ".supple.lock"
# `is_locked` holds the lock for a moment, which must not refuse a run [s].
_TRIES, _PAUSE = 5, 0.02


class FolderLock:
    """Held from its construction until `release`. Another one of the same folder is refused, in any process.

    Parameters
    ----------
    folder : must exist; it contains the file `LOCK_NAME` while it is locked.

    Raises
    ------
    OutputError : where the folder is locked; the text names the process that did it.
    """

    def __init__(self, folder: Path) -> None:
        self._path = folder / LOCK_NAME
        tries = 0
        while True:
            try:
                self._file = os.open(self._path, os.O_RDWR | os.O_CREAT, 0o644)
            except OSError as error:
                raise output_error(self._path, error) from None
            if not _lock(self._file):
                os.close(self._file)
                tries += 1
                if tries == _TRIES:
                    raise in_use(folder)
                time.sleep(_PAUSE)
                continue
            # The owner of the lock may have deleted the file after it was opened here.
            with suppress(OSError):
                if os.path.samestat(os.fstat(self._file), self._path.stat()):
                    break
            os.close(self._file)
        os.ftruncate(self._file, 0)
        os.write(self._file, f"\n{os.getpid()}\n".encode())

    def release(self) -> None:
        """Unlock the folder, and delete the file."""
        if self._file >= 0:
            if os.name != "posix":  # only POSIX can delete an open file
                os.close(self._file)
            with suppress(OSError):
                self._path.unlink()
            if os.name == "posix":
                os.close(self._file)
            self._file = -1


def in_use(folder: Path) -> OutputError:
    """The error for a folder that is locked; it names the process that did it."""
    try:
        owner = (folder / LOCK_NAME).read_bytes()[1:100].decode(errors="replace").strip()
    except OSError:  # Windows forbids reading the locked byte
        owner = ""
    by = f" (process {owner})" if owner.isdecimal() else ""
    return OutputError(f"{folder}: another run is writing to it{by}; wait for it, or give another folder")


def is_locked(folder: Path) -> bool:
    """Whether a run is writing to the folder."""
    try:
        file = os.open(folder / LOCK_NAME, os.O_RDWR)
    except OSError:
        return False
    try:
        return not _lock(file)
    finally:
        os.close(file)


def _lock_of_system() -> Callable[[int], None]:
    if os.name == "posix":
        import fcntl

        return lambda file: fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    import msvcrt

    # One byte, the first: the others can be read meanwhile.
    return lambda file: msvcrt.locking(file, msvcrt.LK_NBLCK, 1)  # pyright: ignore[reportAttributeAccessIssue]


def _lock(file: int) -> bool:
    """Lock an open file; False where it is locked already."""
    try:
        _lock_of_system()(file)
    except OSError:
        return False
    return True
