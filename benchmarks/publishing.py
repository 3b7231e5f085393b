"""Tables of the documentation: a benchmark writes `docs/figures/NAME.json`, and the table of the page that shows it."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

from benchmarks.measuring import ROOT
from benchmarks.table import table_text
from supple.runtime.replacing import whole_file

DOCS = ROOT / "docs"


# The page that shows a table, by the name between the marks, which is that of the file.
SHOWN = {
    "quadratic_tets": "theory/locking.md",
    "checked_results": "learn/check_your_simulator.md",
    "checked_results_short": "../README.md",
    **dict.fromkeys(
        ("startup", "hanging_beam", "work_precision", "implicit_scaling", "automatic_substeps"),
        "validation/benchmarks.md",
    ),
}


def publish(name: str, figures: Any) -> None:
    """Write the figures of this name, and the table that shows them."""
    path, page = file_of(name), DOCS / SHOWN[name]
    path.parent.mkdir(exist_ok=True)
    _write(path, json.dumps(figures, indent=1) + "\n")
    _write(page, with_table(page.read_text(encoding="utf-8"), name))
    print(f"written: {path.name}, {page.name}")


def _write(path: Path, text: str) -> None:
    with whole_file(path) as fresh:
        fresh.write_text(text, encoding="utf-8")


def file_of(name: str) -> Path:
    """Where the figures of this name are."""
    return DOCS / "figures" / f"{name}.json"


def with_table(page: str, name: str) -> str:
    """The text of a page, with the table of the file between the two marks."""
    begin, end = f"<!-- figures: {name} -->\n", "<!-- end of figures -->"
    text = table_text(json.loads(file_of(name).read_text(encoding="utf-8")))
    pattern = f"{re.escape(begin)}.*?{re.escape(end)}"
    changed, count = re.subn(pattern, lambda _: f"{begin}\n{text}\n\n{end}", page, flags=re.S)
    assert count == 1, f"the page of {name} needs the marks {begin.strip()} and {end}"
    return changed
