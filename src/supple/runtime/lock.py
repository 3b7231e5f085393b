"""Locks on files and folders. The operating system releases them when their process ends, however that happens."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from supple.errors import OutputError
from supple.runtime.replacing import output_error

LOCK_NAME = ".supple.lock"
# `is_locked` holds the lock for a moment, which must not refuse a run [s].
_TRIES, _PAUSE = 5, 0.02


class FileLock:
    """A file that only one process can hold. It is made for that, and deleted by `release`."""

    def __init__(self, path: Path, file: int) -> None:
        self._path, self.file = path, file

    @classmethod
    def acquired(cls, path: Path) -> FileLock | None:
        """The lock; None where something else holds it.

        Raises
        ------
        OSError : where the file cannot be made.
        """
        while True:
            file = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
            if not _lock(file):
                os.close(file)
                return None
            # The owner of the lock may have deleted the file after it was opened here.
            with suppress(OSError):
                if os.path.samestat(os.fstat(file), path.stat()):
                    return cls(path, file)
            os.close(file)

    def release(self) -> None:
        """Unlock the file, and delete it."""
        if self.file >= 0:
            if os.name != "posix":  # only POSIX can delete an open file
                os.close(self.file)
            with suppress(OSError):
                self._path.unlink()
            if os.name == "posix":
                os.close(self.file)
            self.file = -1


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
        path = folder / LOCK_NAME
        for again in range(_TRIES):
            if again:
                time.sleep(_PAUSE)
            try:
                lock = FileLock.acquired(path)
            except OSError as error:
                raise output_error(path, error) from None
            if lock is not None:
                break
        else:
            raise in_use(folder)
        self._lock = lock
        os.ftruncate(lock.file, 0)
        os.write(lock.file, f"\n{os.getpid()}\n".encode())

    def release(self) -> None:
        """Unlock the folder, and delete the file."""
        self._lock.release()


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
