"""`run.json`: what a run is, and each process that worked on it."""

from __future__ import annotations

import json
import os
import platform
import sys
from dataclasses import asdict, dataclass, field, replace
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numba
from pydantic import TypeAdapter

from supple.errors import OutputError
from supple.results.checkpoint.file import RunFacts
from supple.runtime.replacing import whole_file

# What may change the last bits of a result.
_PACKAGES = ("numpy", "scipy", "numba", "llvmlite", "pypardiso", "h5py", "tetgen")


def versions() -> dict[str, str]:
    """The versions of Supple, of Python, and of the installed packages that compute."""
    from supple import __version__

    installed = {name: number for name in _PACKAGES if (number := _installed(name)) is not None}
    return {"supple": __version__, "python": platform.python_version(), **installed}


@cache
def _installed(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None


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


_FORMAT = 1


def now() -> str:
    """The time of the clock in UTC, as ISO 8601; for readers only, since clocks can be set back."""
    return datetime.now(UTC).isoformat(timespec="seconds")


@dataclass(frozen=True)
class Session:
    """One process that worked on a run.

    Attributes
    ----------
    command : its arguments; begun, ended : time (`now`); ended is None while it works, and after it was killed
    first_frame, last_frame : indices of the frames that it began with and ended with
    outcome : "running", "finished", "interrupted", "stopped" (by the solver) or "failed"; message : the reason
    versions, machine : see the functions
    """

    command: list[str] = field(default_factory=lambda: list(sys.argv))
    begun: str = field(default_factory=now)
    ended: str | None = None
    first_frame: int = 0
    last_frame: int = 0
    outcome: str = "running"
    message: str = ""
    versions: dict[str, str] = field(default_factory=versions)
    machine: dict[str, Any] = field(default_factory=machine)


@dataclass(frozen=True)
class Journal:
    """A run.

    Attributes
    ----------
    run : what it is
    origin : where the scene comes from: {"kind": "scene_file", ...}, {"kind": "demo", ...} or {"kind": "python"}
    seed : of the random numbers that the scene was made with, as the caller gave it
    checkpoint_every, checkpoint_seconds : number of frames, and time by the clock [s], from checkpoint to checkpoint;
        both None: only at the start and the end
    compress : whether the complete recording is compressed
    sessions : in order
    fields : recorded in addition
    """

    run: RunFacts
    origin: dict[str, Any]
    seed: int | None
    checkpoint_every: int | None
    compress: bool
    sessions: tuple[Session, ...] = ()
    fields: tuple[str, ...] = ()
    checkpoint_seconds: float | None = None

    def with_session(self, session: Session) -> Journal:
        """With one more session, after the earlier ones."""
        return replace(self, sessions=(*self.sessions, session))

    def with_last(self, **changes: Any) -> Journal:
        """With changes of the last session."""
        return replace(self, sessions=(*self.sessions[:-1], replace(self.sessions[-1], **changes)))


def write_journal(path: Path, journal: Journal) -> None:
    """Write a journal.

    Raises
    ------
    OutputError : where the system refuses.
    """
    with whole_file(path) as fresh:
        text = json.dumps({"format": _FORMAT, **asdict(journal)}, indent=2, ensure_ascii=False)
        fresh.write_text(text + "\n", encoding="utf-8", newline="\n")


def read_journal(path: Path) -> Journal:
    """Read a journal.

    Raises
    ------
    OutputError : where it is missing, damaged, or of another version.
    """
    if not path.exists():
        folder, inside = path.parent.parent, f"{path.parent.name}/{path.name}"
        raise OutputError(f"{folder}: is not a run folder: it has no {inside}; give the --output of a run")
    try:
        text = path.read_bytes()
        if json.loads(text)["format"] != _FORMAT:
            raise OutputError(f"{path}: was written by another version; simulate it again")
        return TypeAdapter(Journal).validate_json(text, strict=True)
    except OSError as error:
        raise OutputError(f"{path}: cannot be read: {error.strerror or error}") from None
    except (ValueError, TypeError, KeyError, RecursionError):  # pydantic's errors are ValueErrors
        raise OutputError(f"{path}: is damaged: it is not the JSON of a run; give another folder") from None
