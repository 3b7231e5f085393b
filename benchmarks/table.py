"""A table that is printed while it is measured and then published, and the circumstances of a measurement."""

from __future__ import annotations

import os
import platform
import time
from pathlib import Path
from typing import Any

import numba
from numba.core import config


def load() -> str:
    """The mean number of running processes of the last minute."""
    return f"{os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else "unknown"


def circumstances(threads: int | None = None) -> dict[str, Any]:
    """Date, machine, load and versions; `threads` where it is not that of this process."""
    return {
        "date": time.strftime("%Y-%m-%d"),
        "load": load(),
        "cores": os.cpu_count(),
        "processor": _processor(),
        "threads": threads or config.NUMBA_NUM_THREADS,  # pyright: ignore[reportAttributeAccessIssue]
        "versions": {"Python": platform.python_version(), "Numba": numba.__version__},
    }


def _processor() -> str:
    """The name of the processor, where Linux tells it."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text(encoding="utf-8").splitlines() if info.exists() else []
    return next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), platform.processor())


class Table:
    """Rows with one format for each column; None is an empty cell, and text has no format."""

    def __init__(self, title: str, columns: dict[str, str], threads: int | None = None) -> None:
        self.columns = columns
        self.rows: list[list[Any]] = []
        self._at_start = circumstances(threads)
        self._widths: list[int] = []
        print(f"\n{title}")

    def add(self, *cells: Any) -> None:
        """Add and print a row; the first one decides how wide the printed columns are."""
        assert len(cells) == len(self.columns)
        texts = _texts(cells, self.columns)
        if not self._widths:
            self._widths = [max(len(name), len(text) + 3) for name, text in zip(self.columns, texts, strict=True)]
            self._print(list(self.columns))
        self.rows.append(list(cells))
        self._print(texts)

    def _print(self, texts: list[str]) -> None:
        print("  ".join(f"{text:>{width}}" for text, width in zip(texts, self._widths, strict=True)), flush=True)

    def note(self, text: str) -> None:
        """Print a sentence below the table; pages show tables only."""
        print(text, flush=True)

    def figures(self) -> dict[str, Any]:
        """What is published."""
        return {**self._at_start, "load_after": load(), "columns": self.columns, "rows": self.rows}


def _texts(cells: Any, columns: dict[str, str]) -> list[str]:
    return [
        "" if cell is None else cell if isinstance(cell, str) else f"{cell:{form}}"
        for cell, form in zip(cells, columns.values(), strict=True)
    ]


def measured_on(figures: dict[str, Any]) -> str:
    """When the figures were measured, on what, and what else the machine did."""
    after = f" to {figures['load_after']}" if "load_after" in figures else ""
    text = f"Measured on {figures['date']}, load {figures['load']}{after}, {figures['cores']} cores"
    if "threads" not in figures:
        return f"{text}."
    threads = f"{figures['threads']} thread" + "s" * (figures["threads"] > 1)
    return f"{text} ({figures['processor']}, {threads})."


def table_text(figures: dict[str, Any]) -> str:
    """A published table as Markdown."""
    columns = figures["columns"]
    lines = [measured_on(figures), "", f"| {' | '.join(columns)} |", "|" + "---|" * len(columns)]
    lines += [f"| {' | '.join(_texts(row, columns))} |" for row in figures["rows"]]
    return "\n".join(lines)
