"""The folder of a user's compiled kernels: one file per kernel, named by a digest of what it was compiled from.

A wheel may contain such a folder, which is only read: its kernels are compiled for a level of instructions that many
processors have.

An entry is machine code and is read by pickle: who can write it runs code here. So an entry, and its folder, must
belong to this user or to root, and be writable by nobody else. The folder of a wheel may belong to who owns the
package, and be writable by who can write that: they run code here in any case.
"""

from __future__ import annotations

import json
import logging
import os
import stat
import sys
import zlib
from contextlib import suppress
from functools import cache
from pathlib import Path
from time import monotonic, sleep, time

from llvmlite.binding import get_host_cpu_features
from numba.core import config
from numba.misc.appdirs import AppDirs

from supple.runtime.lock import FileLock

# How long a process waits for another one that compiles the same kernel, and how long between two looks [s].
_LONGEST_WAIT, _PAUSE = 60.0, 0.02
# Ten states of the code, with the kernels of all tests each; those that were not used for longest go.
_MOST_BYTES = 1 << 30
_DAY = 86400.0  # a use is noted at most once a day: a note is a write


logger = logging.getLogger(__name__)


def kernel_folder() -> Path:
    """Numba's `NUMBA_CACHE_DIR` where it is set, otherwise the cache folder of the platform."""
    chosen: str = config.CACHE_DIR  # pyright: ignore[reportAttributeAccessIssue]
    return Path(chosen, "supple") if chosen else Path(AppDirs("supple", appauthor=False).user_cache_dir, "kernels")


# Of a wheel; `TARGET` holds the triple, the processor and the features that its kernels were compiled for.
SHIPPED = Path(__file__).with_name("kernels")
TARGET = "target.json"


@cache
def shipped_target() -> tuple[str, str, str] | None:
    """What the kernels of the wheel were compiled for; None where there are none, or this processor lacks a feature.

    Where `NUMBA_CPU_NAME` is set, kernels for that processor are wanted.
    """
    try:
        triple, processor, features = json.loads((SHIPPED / TARGET).read_text(encoding="utf-8"))
    except OSError:
        return None
    here = get_host_cpu_features()
    needed = [feature[1:] for feature in features.split(",") if feature.startswith("+")]
    chosen: str | None = config.CPU_NAME  # pyright: ignore[reportAttributeAccessIssue]
    if chosen not in (None, processor) or not all(here.get(feature) for feature in needed):
        return None
    return triple, processor, features


def is_trusted(status: os.stat_result, like: os.stat_result | None = None) -> bool:
    """Whether nobody but this user and root can write a file or folder, or those who can write another one (`like`).

    Windows has neither owners nor modes of this kind: its folder of a user is that user's.
    """
    if sys.platform == "win32":
        return True
    owners, others = {os.getuid(), 0}, stat.S_IWGRP | stat.S_IWOTH
    if like is not None:
        owners.add(like.st_uid)
        # That another file has another group does not matter.
        others &= ~(like.st_mode if like.st_gid == status.st_gid else like.st_mode & stat.S_IWOTH)
    return status.st_uid in owners and not status.st_mode & others


def _is_refused(path: Path, status: os.stat_result) -> bool:
    """Whether a file or folder of kernels is not trusted; the log says so, once for each folder."""
    like = Path(__file__).stat() if path.is_relative_to(SHIPPED) else None
    if is_trusted(status, like):
        return False
    _warn(path if stat.S_ISDIR(status.st_mode) else path.parent)
    return True


@cache  # once per process
def _warn(folder: Path) -> None:
    logger.warning(
        "compiled kernels in %s are not used: it, or a file in it, belongs to another user, or others can write it; "
        "`chmod -R go-w` it, or set NUMBA_CACHE_DIR to a folder of your own",
        folder,
    )


def read(path: Path) -> bytes | None:
    """The content of an entry; None where none exists, it is damaged, or others can write it."""
    try:
        with path.open("rb") as file:
            # Of what is opened, which may be another file than the path names a moment later.
            if _is_refused(path, os.fstat(file.fileno())) or _is_refused(path.parent, path.parent.stat()):
                return None
            content = file.read()
        if zlib.crc32(content[4:]).to_bytes(4, "little") != content[:4]:
            return None
    except OSError:
        return None
    return content[4:]


def note_use(path: Path) -> None:
    """Let an entry count as used now."""
    with suppress(OSError):
        if path.stat().st_mtime < time() - _DAY:
            os.utime(path)


def write(path: Path, content: bytes) -> None:
    """Write an entry, whole or not at all.

    Raises
    ------
    OSError : where it cannot be written, or others can write in the folder.
    """
    if _is_refused(path.parent, path.parent.stat()):
        raise PermissionError(f"{path.parent} can be written by others")
    _remove_unused(path.parent)
    part = path.with_suffix(f".{os.getpid()}")
    part.unlink(missing_ok=True)
    try:
        with open(part, "xb", opener=lambda name, flags: os.open(name, flags, 0o600)) as file:
            file.write(zlib.crc32(content).to_bytes(4, "little") + content)
        part.replace(path)
    except OSError:
        part.unlink(missing_ok=True)
        raise


def lock(path: Path) -> tuple[FileLock | None, bool]:
    """Lock an entry, to compile it here, and say whether another process had it locked until then.

    The lock is None where nothing can be written, or another process takes too long.
    """
    waited, end = False, monotonic() + _LONGEST_WAIT
    try:
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        if _is_refused(path.parent, path.parent.stat()):
            return None, False
        while (held := FileLock.acquired(path.with_suffix(".lock"))) is None and monotonic() < end:
            waited = True
            sleep(_PAUSE)
    except OSError:
        return None, waited
    return held, waited


@cache  # once per process
def _remove_unused(folder: Path) -> None:
    """Delete the entries that were not used for longest, and what killed processes left, above `_MOST_BYTES`."""
    with suppress(OSError), os.scandir(folder) as entries:
        files = sorted((entry.stat().st_mtime, entry.stat().st_size, entry.path) for entry in entries)
        size = sum(bytes_ for _, bytes_, _ in files)
        for _, bytes_, path in files:
            if size <= _MOST_BYTES:
                break
            os.unlink(path)
            size -= bytes_
