"""New files take the place of old ones in one moment, also if the power fails; what killed writers left is deleted."""

from __future__ import annotations

import contextlib
import os
import platform
import re
import shutil
import time
import zlib
from functools import cache
from pathlib import Path
from uuid import uuid4

_A_DAY = 86_400.0


def temporary_name(path: Path) -> Path:
    """A name beside `path`, hidden and with its suffix, that nobody uses; it says which process made it."""
    return path.with_name(f".{path.stem}.supple-{_machine()}-{os.getpid()}-{uuid4().hex[:8]}{path.suffix}")


def put_in_place(fresh: Path, path: Path) -> None:
    """Rename a file over `path` once its bytes have reached the disk; or a folder, whose files may still be on the way.

    Without that, some file systems would rename first and write later: after a power failure, `path` would be empty.

    Raises
    ------
    OSError : where the system refuses.
    """
    if not fresh.is_dir():
        with fresh.open("r+b") as file:
            os.fsync(file.fileno())
    os.replace(fresh, path)
    # Names reach it too. Only POSIX opens folders; elsewhere the system sees to names itself.
    if os.name == "posix":
        with contextlib.suppress(OSError):
            folder = os.open(path.parent, os.O_RDONLY)
            try:
                os.fsync(folder)
            finally:
                os.close(folder)


def remove_abandoned(path: Path) -> None:
    """Delete what writers of `path` left under temporary names when they were killed.

    A writer is gone if its process is. Names of other machines, and on systems that do not tell, all names, are left
    alone for a day.
    """
    names = re.compile(
        rf"\.{re.escape(path.stem)}\.supple-(?P<machine>\w+)-(?P<process>\d+)-\w+{re.escape(path.suffix)}"
    )
    # Clearing up is no reason to fail.
    with contextlib.suppress(OSError):
        for left in path.parent.iterdir():
            made = names.fullmatch(left.name)
            if made is None:
                continue
            with contextlib.suppress(OSError):
                here = made["machine"] == _machine() and os.name == "posix"
                if _is_gone(int(made["process"])) if here else time.time() - left.stat().st_mtime > _A_DAY:
                    shutil.rmtree(left) if left.is_dir() else left.unlink()


@cache
def _machine() -> str:
    """What process numbers belong to: a machine, and on Linux the container on it."""
    try:
        container = os.readlink("/proc/self/ns/pid")
    except OSError:
        container = ""
    return f"{zlib.crc32(f'{platform.node()} {container}'.encode()):08x}"


def _is_gone(process: int) -> bool:
    try:
        os.kill(process, 0)  # POSIX: asks, and sends nothing
    except ProcessLookupError:
        return True
    except (OSError, OverflowError):
        return False
    return False
