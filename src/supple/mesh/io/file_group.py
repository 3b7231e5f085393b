"""Writing several files that belong together: all of them or none."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterable, Mapping
from pathlib import Path

from supple.errors import MeshError
from supple.replacing import put_in_place, remove_abandoned, temporary_name


def write_together(texts: Mapping[Path, Iterable[str]]) -> None:
    """Write each text (in pieces) to its path; where one cannot be written, all files stay as they were.

    All texts are first written under temporary names in the same folder. Then all old files are renamed, and the new
    ones get their names. If this fails halfway, the old files get their names back. If the process is killed halfway,
    files are missing, but old and new files are never mixed.

    Raises
    ------
    MeshError : naming the file and the reason.
    """
    fresh = {path: temporary_name(path) for path in texts}
    saved = {path: temporary_name(path) for path in texts}
    moved_aside: list[Path] = []
    moved_in: list[Path] = []
    current = Path()
    try:
        for current, pieces in texts.items():
            if current.is_dir():
                raise IsADirectoryError(None, "is a directory")
            with fresh[current].open("w", encoding="ascii", newline="\n") as file:
                file.writelines(pieces)
        for current in texts:
            if current.exists():
                os.replace(current, saved[current])
                moved_aside.append(current)
        for current in texts:
            put_in_place(fresh[current], current)
            moved_in.append(current)
    except BaseException as error:
        # BaseException: a KeyboardInterrupt must not leave a part of the files either.
        for path in moved_in:
            if path not in moved_aside:
                path.unlink(missing_ok=True)
        for path in moved_aside:
            os.replace(saved[path], path)
        if isinstance(error, OSError):
            raise MeshError(f"{current}: it cannot be written: {error.strerror or error}") from None
        raise
    finally:
        for path in (*fresh.values(), *saved.values()):
            with contextlib.suppress(OSError):
                path.unlink(missing_ok=True)
    for path in texts:
        remove_abandoned(path)
