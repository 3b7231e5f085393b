"""How much memory this process can still use, a clear refusal of what would need more, and the limits of a child."""

from __future__ import annotations

import os
import sys
from pathlib import Path

from supple.errors import SceneError, SuppleError

_PROC, _CGROUP = Path("/proc"), Path("/sys/fs/cgroup")


def available_bytes() -> int | None:
    """Memory that this process can still use without swapping [bytes]; None where the system does not report it.

    The smallest of what the machine has free, what the limits of the container leave, and what the limit of the
    process (`ulimit -v`) leaves.
    """
    limits = [_of_machine(), *_of_containers(), _of_process()]
    known = [max(0, number) for number in limits if number is not None]
    return min(known) if known else None


def require_memory(needed: float, what: str, remedy: str, error: type[SuppleError] = SceneError) -> None:
    """Raise where `needed` [bytes] is more than is available.

    Raises
    ------
    error : one line with both numbers.
    """
    available = available_bytes()
    if available is not None and needed > available:
        raise error(f"{what} needs about {in_words(needed)} of memory, and {in_words(available)} are free; {remedy}")


def in_words(count: float) -> str:
    """Bytes with a unit: 3.2 GB."""
    for unit in ("B", "kB", "MB", "GB"):
        if count < 999.5:
            return f"{count:.3g} {unit}"
        count /= 1000.0
    return f"{count:.3g} TB"


def _of_machine() -> int | None:
    if sys.platform == "win32":
        return _of_windows()
    for line in _lines(_PROC / "meminfo"):
        if line.startswith("MemAvailable:"):
            return int(line.split()[1]) * 1024
    try:  # macOS, which does not report the free memory: half of all
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") // 2
    except (AttributeError, ValueError, OSError):
        return None


def _of_windows() -> int | None:
    import ctypes

    class Status(ctypes.Structure):
        _fields_ = (
            ("length", ctypes.c_ulong),
            ("load", ctypes.c_ulong),
            *((f"n{k}", ctypes.c_ulonglong) for k in range(7)),
        )

    status = Status(length=ctypes.sizeof(Status))
    windll = getattr(ctypes, "windll", None)
    # The seven numbers: physical memory in all and free, page file, address space, extended; each in all and free.
    return status.n1 if windll is not None and windll.kernel32.GlobalMemoryStatusEx(ctypes.byref(status)) else None


# Of control groups of Linux, version 2 and version 1: folder, limit, use, and the part of it that is a mere cache.
_GROUPS = {
    "": ("", "memory.max", "memory.current", "inactive_file "),
    "memory": ("memory", "memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file "),
}


def _of_containers() -> list[int]:
    """What each control group of Linux that holds this process leaves, from its own up to the root."""
    left = []
    for line in _lines(_PROC / "self" / "cgroup"):
        _, controllers, path = [*line.split(":", 2), "", ""][:3]
        for controller in set(controllers.split(",")) & _GROUPS.keys():
            folder, *files, cached = _GROUPS[controller]
            root = _CGROUP / folder
            own = root / path.strip("/")
            for group in (own, *own.parents):
                if not group.is_relative_to(root):
                    break
                limit, used = (_number(group / file) for file in files)
                if limit is not None and used is not None:
                    cache = [int(row.split()[1]) for row in _lines(group / "memory.stat") if row.startswith(cached)]
                    left.append(limit - used + sum(cache))
    return left


def _of_process() -> int | None:
    try:
        import resource
    except ImportError:  # not a POSIX system
        return None
    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    if limit == resource.RLIM_INFINITY:
        return None
    used = [int(line.split()[1]) * 1024 for line in _lines(_PROC / "self" / "status") if line.startswith("VmSize:")]
    return limit - used[0] if used else None


def _number(path: Path) -> int | None:
    lines = _lines(path)
    return int(lines[0]) if lines and lines[0].isdecimal() else None


def _lines(path: Path) -> list[str]:
    try:
        return path.read_text(encoding="utf-8").splitlines()
    except (OSError, ValueError):
        return []


def end_with_parent(parent: int) -> None:
    """Let the system kill this process when its parent, of this number, ends, even while a mesher runs; on Linux."""
    if not sys.platform.startswith("linux"):
        return
    import ctypes
    import signal

    set_parent_death_signal = 1  # PR_SET_PDEATHSIG of <linux/prctl.h>
    ctypes.CDLL(None).prctl(set_parent_death_signal, signal.SIGKILL)
    if os.getppid() != parent:  # it ended before
        os._exit(1)


def limit_process(cpu_seconds: float, memory_limit: int | None) -> list[str]:
    """Limit this process's memory and CPU time where the platform can; returns a note where it cannot.

    Where the system does not end this process with its parent, the limit on CPU time does after a while.
    """
    try:
        import resource
    except ImportError:
        return ["this platform has no memory limit for processes" if memory_limit is not None else ""]
    notes = []
    for kind, limit in ((resource.RLIMIT_CPU, cpu_seconds), (resource.RLIMIT_AS, memory_limit)):
        if limit is None:
            continue
        hard = resource.getrlimit(kind)[1]
        soft = int(limit) if hard == resource.RLIM_INFINITY else min(int(limit), hard)
        try:
            resource.setrlimit(kind, (soft, hard))
        except (ValueError, OSError) as error:
            notes.append(f"the system does not allow a limit of {soft} for this process: {error}")
    return notes
