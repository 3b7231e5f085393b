"""Figures of the documentation: a benchmark writes `docs/figures/NAME.json`, and the part of a page that shows it."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from benchmarks.latency import live_page_text
from benchmarks.measuring import ROOT
from benchmarks.table import table_text
from benchmarks.tables import live_text, reading_text, rigid_bodies_text, speed_text
from supple.runtime.replacing import whole_file

DOCS = ROOT / "docs"


class Part(NamedTuple):
    """A part of a page: the page, the files of its figures, and their text."""

    page: str
    files: tuple[str, ...]
    text: Callable[..., str]


def _tables(page: str, *names: str) -> dict[str, Part]:
    """Parts that show one table each."""
    return {name: Part(page, (name,), table_text) for name in names}


# By the name between the marks.
SHOWN = {
    "live_page": Part("live.md", ("live_page",), live_page_text),
    "live": Part("benchmarks.md", ("live",), live_text),
    "rigid_bodies": Part("benchmarks.md", ("rigid_bodies",), rigid_bodies_text),
    "reading_fields": Part("forces_and_stresses.md", ("reading_fields",), reading_text),
    "speed": Part("../README.md", ("hanging_beam", "projections"), speed_text),
    **_tables("benchmarks.md", "startup", "projections", "hanging_beam", "work_precision", "implicit_scaling"),
    **_tables("benchmarks.md", "contact_scenes", "small_scenes", "bear_pile", "candidate_search"),
    **_tables("implicit.md", "tolerances"),
    **_tables("locking.md", "quadratic_tets"),
    **_tables("rigid_bodies.md", "rigid_heap"),
    **_tables("xpbd.md", "automatic_substeps"),
}


def publish(name: str, figures: Any) -> None:
    """Write the figures of this name, and the parts of pages that show them."""
    path = file_of(name)
    path.parent.mkdir(exist_ok=True)
    _write(path, json.dumps(figures, indent=1) + "\n")
    print(f"written: {path.relative_to(ROOT)}")
    for mark, part in SHOWN.items():
        if name in part.files and all(file_of(file).exists() for file in part.files):
            page = DOCS / part.page
            _write(page, with_figures(page.read_text(encoding="utf-8"), mark))
            print(f"written: {page.name}")


def _write(path: Path, text: str) -> None:
    with whole_file(path) as fresh:
        fresh.write_text(text, encoding="utf-8")


def file_of(name: str) -> Path:
    """Where the figures of this name are."""
    return DOCS / "figures" / f"{name}.json"


def with_figures(page: str, mark: str) -> str:
    """The text of a page, with the figures of the files between the two marks."""
    begin, end = f"<!-- figures: {mark} -->\n", "<!-- end of figures -->"
    part = SHOWN[mark]
    text = part.text(*(json.loads(file_of(name).read_text(encoding="utf-8")) for name in part.files))
    pattern = f"{re.escape(begin)}.*?{re.escape(end)}"
    changed, count = re.subn(pattern, lambda _: f"{begin}\n{text}\n\n{end}", page, flags=re.S)
    assert count == 1, f"the page of {mark} needs the marks {begin.strip()} and {end}"
    return changed
