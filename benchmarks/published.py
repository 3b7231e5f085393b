"""Figures of the documentation: a benchmark writes `docs/figures/NAME.json`, and the part of a page that shows it."""

from __future__ import annotations

import json
import os
import re
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from benchmarks.latency import live_page_text
from benchmarks.measuring import ROOT
from benchmarks.tables import live_text, reading_text, rigid_bodies_text
from supple.files.replacing import whole_file

DOCS = ROOT / "docs"
# The page and the text of each file.
SHOWN: dict[str, tuple[str, Callable[[Any], str]]] = {
    "live_page": ("live.md", live_page_text),
    "live": ("benchmarks.md", live_text),
    "rigid_bodies": ("benchmarks.md", rigid_bodies_text),
    "reading_fields": ("forces_and_stresses.md", reading_text),
}


def circumstances() -> dict[str, Any]:
    """The date, the load of the machine, and the number of its cores."""
    load = f"{os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else "unknown"
    return {"date": time.strftime("%Y-%m-%d"), "load": load, "cores": os.cpu_count()}


def publish(name: str, figures: Any) -> None:
    """Write the figures of this name, and the text between the two marks of its page."""
    path = file_of(name)
    path.parent.mkdir(exist_ok=True)
    _write(path, json.dumps(figures, indent=1) + "\n")
    page = DOCS / SHOWN[name][0]
    _write(page, with_figures(page.read_text(encoding="utf-8"), name))
    print(f"written: {path.relative_to(ROOT)} and {page.relative_to(ROOT)}")


def _write(path: Path, text: str) -> None:
    with whole_file(path) as fresh:
        fresh.write_text(text, encoding="utf-8")


def file_of(name: str) -> Path:
    """Where the figures of this name are."""
    return DOCS / "figures" / f"{name}.json"


def with_figures(page: str, name: str) -> str:
    """The text of a page, with the figures of its file between the two marks; nothing where there is no file."""
    begin, end = f"<!-- figures: {name} -->\n", "<!-- end of figures -->"
    text = ""
    if file_of(name).exists():
        text = SHOWN[name][1](json.loads(file_of(name).read_text(encoding="utf-8"))) + "\n\n"
    pattern = f"{re.escape(begin)}.*?{re.escape(end)}"
    changed, count = re.subn(pattern, lambda _: f"{begin}\n{text}{end}", page, flags=re.S)
    assert count == 1, f"the page of {name} needs the marks {begin.strip()} and {end}"
    return changed
