"""Recordings that are named by their file, or by the folder of their run."""

from __future__ import annotations

from pathlib import Path


def recording_at(path: Path) -> Path:
    """The recording at a path, which may be the folder of a run.

    Raises
    ------
    OutputError : where there is none in the folder.
    """
    from supple.errors import OutputError

    inside = path / "recording.vtkhdf"
    if path.is_dir() and not inside.exists():
        raise OutputError(f"{path} is a folder without recording.vtkhdf; name a recording, or the folder of a run")
    return inside if path.is_dir() else path
