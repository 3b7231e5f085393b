"""Writing figures of matplotlib."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from typing import Any

from supple.runtime.replacing import whole_file


def save_figure(figure: Any, path: Path, kind: str) -> None:
    """Write a figure as "png", "pdf" or "svg".

    Raises
    ------
    OutputError : where the system refuses.
    """
    with whole_file(path) as fresh:
        made = BytesIO()  # where the disk is full, matplotlib's writer of PDF files raises other errors than OSError
        figure.savefig(made, format=kind)
        fresh.write_bytes(made.getvalue())
