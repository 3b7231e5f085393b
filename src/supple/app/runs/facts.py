"""By which programs, and on which machine, something was computed."""

from __future__ import annotations

import os
import platform
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import numba

# What may change the last bits of a result.
_PACKAGES = ("numpy", "scipy", "numba", "llvmlite", "pypardiso", "h5py", "tetgen")


def versions() -> dict[str, str]:
    """The versions of Supple, of Python, and of the installed packages that compute."""
    from supple import __version__

    found = {"supple": __version__, "python": platform.python_version()}
    for name in _PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return found


def machine() -> dict[str, Any]:
    """The machine, and how many threads this process has."""
    return {
        "name": platform.node(),
        "platform": platform.platform(),
        "processor": platform.processor() or platform.machine(),
        "processors": os.cpu_count(),
        "threads": numba.get_num_threads(),
    }


def differences(before: dict[str, str], now: dict[str, str]) -> str:
    """Which versions differ, as text; empty where none does."""
    names = [name for name in {**before, **now} if before.get(name) != now.get(name)]
    return ", ".join(f"{name} {before.get(name, '(none)')} -> {now.get(name, '(none)')}" for name in names)
