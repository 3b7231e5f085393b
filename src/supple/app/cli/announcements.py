"""What the shell says while meshes are made: lines of the log that name what was chosen, and a sign of life."""

from __future__ import annotations

import logging
import os
import sys
from contextlib import AbstractContextManager
from typing import TextIO

# Their lines of the level INFO are for users of the shell, too.
_ANNOUNCED = ("supple.mesh.meshing", "supple.app.scene_file")


class _Handler(logging.StreamHandler):
    """Writes to the present stderr, which a sign of life replaces so that lines appear above it."""

    def __init__(self) -> None:
        logging.Handler.__init__(self)

    @property
    def stream(self) -> TextIO:
        return sys.stderr

    def format(self, record: logging.LogRecord) -> str:
        text = super().format(record)
        return text if record.levelno == logging.INFO else f"{record.levelname}: {text}"


def set_up_log(*, quiet: bool) -> None:
    """Log to stderr from the level in the environment variable SUPPLE_LOG on (DEBUG, INFO, ERROR).

    Without it, warnings and, unless `quiet`, what is chosen for meshes.
    """
    given = logging.getLevelNamesMapping().get(os.environ.get("SUPPLE_LOG", "").upper())
    logging.basicConfig(level=logging.WARNING if given is None else given, format="%(message)s", handlers=[_Handler()])
    for name in _ANNOUNCED:
        logging.getLogger(name).setLevel(logging.NOTSET if quiet or given is not None else logging.INFO)


def reading() -> AbstractContextManager[object]:
    """Shows in a terminal that a scene is read, and its meshes are made."""
    from rich.console import Console

    return Console(stderr=True).status("reading the scene and making its meshes")
