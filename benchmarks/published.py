"""Published cases: what their sources give, and what Supple gives on two meshes.

usage: python -m benchmarks.published [NAME ...] [--publish | --page]

Solves the cases of tests/published, or those named, prints each value beside its reference, and draws each case into
out/published (extra: video). With --publish, figures and pictures go to docs/, and docs/validation/published.md shows
them; with --page, nothing is solved and the page is written from the figures that are there.
"""

from __future__ import annotations

import argparse
import json
import re
import tempfile
import time
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from PIL import Image
from tests.published.case import Case, Solution, as_one_step, modules

import supple as sp
from benchmarks.measuring import ROOT
from benchmarks.publishing import DOCS
from benchmarks.table import Table, circumstances, measured_on
from supple.runtime.replacing import whole_file
from supple.simulate import first_frame

PAGE = DOCS / "validation" / "published.md"
FIGURES = DOCS / "figures" / "published"
PEERS = FIGURES / "peers"
PICTURES = DOCS / "images" / "published"
COLUMNS = {
    "case": "",
    "quantity": "",
    "reference": "",
    "coarse": "",
    "fine": "",
    "error": ".2%",
    "bound": ".1%",
    "elements": "",
    "seconds": "",
}
CASES_MARK, OTHERS_MARK = "cases", "other programs"


def number(value: Any) -> str:
    """A value with five digits, or a vector of such."""
    parts = [f"{float(part):.5g}" for part in np.atleast_1d(value)]
    return parts[0] if len(parts) == 1 else f"({', '.join(parts)})"


def measure(name: str, module: ModuleType, table: Table) -> tuple[dict[str, Any], Solution]:
    """Solve a case on both meshes; its figures, and the solution on the finer one."""
    case: Case = module.CASE
    solutions, seconds = [], []
    for mesh in case.meshes:
        began = time.process_time()
        solutions.append(case.solve(mesh))
        seconds.append(time.process_time() - began)
    elements = [f"{sum(len(body.mesh.tets) for body in one.frame.system.scene.bodies):,}" for one in solutions]
    first = len(table.rows)
    for key, reference in case.references.items():
        coarse, fine = (one.values[key] for one in solutions)
        table.add(
            case.title,
            f"{key} [{reference.unit}]",
            number(reference.value),
            number(coarse),
            number(fine),
            reference.error(fine),
            reference.bound,
            " / ".join(elements),
            " / ".join(f"{spent:.1f}" for spent in seconds),
        )
    figures = circumstances() | {"supple": sp.__version__, "columns": COLUMNS, "rows": table.rows[first:]}
    figures["versions"]["NumPy"] = np.__version__
    return figures, solutions[1]


def draw(case: Case, solution: Solution, path: Path) -> None:
    """The picture of a case, by the library's own export, seen from `direction` of its look."""
    path.parent.mkdir(parents=True, exist_ok=True)
    frame = as_one_step(solution.frame)
    x = np.concatenate(list(frame.positions.values()))
    middle, reach = (x.max(axis=0) + x.min(axis=0)) / 2, float(np.linalg.norm(np.ptp(x, axis=0)))
    look: dict[str, Any] = {"size": (480, 300), "surface": "tets", **(case.look or {})}
    direction = np.asarray(look.pop("direction", (0.5, 0.4, 1.0)), dtype=float)
    look |= {"target": tuple(middle), "eye": tuple(middle + 1.5 * reach * direction / np.linalg.norm(direction))}
    with tempfile.TemporaryDirectory() as folder:
        recorder = sp.Recorder(Path(folder) / "case.vtkhdf")
        recorder.begin(first_frame(frame.system.scene, frame.system.start_states[0]), frame.time or 1.0, 1)
        recorder.write(frame)
        recorder.end()
        sp.read_recording(Path(folder) / "case.vtkhdf").export("png", path, **look)
    Image.open(path).quantize(256).save(path, optimize=True)


def measured_names() -> list[str]:
    """The cases that have figures."""
    return sorted(path.stem for path in FIGURES.glob("*.json"))


def with_cases(page: str) -> str:
    """The text of the page, with table and descriptions of all measured cases, and with what other programs give."""
    figures = {name: json.loads((FIGURES / f"{name}.json").read_text(encoding="utf-8")) for name in measured_names()}
    lines = table_lines(
        [[f"[{row[0]}](#{name})", *row[1:]] for name, of_case in figures.items() for row in of_case["rows"]], COLUMNS
    )
    for name, module in modules().items():
        if name in figures:
            lines += ["", *described(name, module, figures[name])]
    return between_marks(between_marks(page, CASES_MARK, lines), OTHERS_MARK, others())


def others() -> list[str]:
    """The lines of the tables of other programs: what they give, and with which settings."""
    programs = [json.loads(path.read_text(encoding="utf-8")) for path in sorted(PEERS.glob("*.json"))]
    programs.sort(key=lambda one: not one["program"].startswith("Supple"))
    columns: dict[str, str] = programs[0]["columns"]
    rows = []
    settings: list[list[Any]] = []
    for case in dict.fromkeys(case for one in programs for case in one["rows"]):
        of_case = [row for one in programs for row in one["rows"].get(case, [])]
        # Quantity by quantity, and what cannot run at the end.
        order = [*dict.fromkeys(row[1] for row in of_case if row[1]), ""]
        rows += [[f"[{row[0]}](#{case})", *row[1:-1]] for key in order for row in of_case if row[1] == key]
        settings += [[row[0], row[3], row[-1]] for row in of_case if row[1] == order[0]]
    return [
        *table_lines(rows, dict(list(columns.items())[:-1])),
        "",
        *table_lines(settings, {"case": "", "program": "", "settings": ""}),
        "",
        *(f"{one['program']}: {measured_on(one)[:1].lower()}{measured_on(one)[1:]}  " for one in programs),
    ]


def table_lines(rows: list[list[Any]], columns: dict[str, str]) -> list[str]:
    """Rows as Markdown; numbers in the form of their columns, and nothing for None."""
    lines = [f"| {' | '.join(columns)} |", "|" + "---|" * len(columns)]
    for row in rows:
        texts = [
            "" if cell is None else cell if isinstance(cell, str) else f"{cell:{form}}"
            for cell, form in zip(row, columns.values(), strict=True)
        ]
        lines.append(f"| {' | '.join(texts)} |")
    return lines


def between_marks(page: str, mark: str, lines: list[str]) -> str:
    """The text of the page with these lines between the two marks of this name."""
    begin, end = f"<!-- {mark} -->\n", f"<!-- end of {mark} -->"
    pattern = f"{re.escape(begin)}.*?{re.escape(end)}"
    changed, count = re.subn(pattern, lambda _: begin + "\n" + "\n".join(lines) + f"\n\n{end}", page, flags=re.S)
    assert count == 1, f"the page needs the marks {begin.strip()} and {end}"
    return changed


def described(name: str, module: ModuleType, figures: dict[str, Any]) -> list[str]:
    """The lines of a case: problem, picture, command, and what is not like the source."""
    case: Case = module.CASE
    versions = ", ".join(f"{key} {version}" for key, version in figures["versions"].items())
    return [
        f'<h3 id="{name}">{case.title}</h3>',
        "",
        str(module.__doc__).strip(),
        *([case.differs] if case.differs else []),
        "",
        f"![{case.title}](../images/published/{name}.png)",
        "",
        f"`python -m benchmarks.published {name}`. {measured_on(figures)} Supple {figures['supple']}, {versions}.",
    ]


def write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with whole_file(path) as fresh:
        fresh.write_text(text, encoding="utf-8")


def main(names: list[str], publish: bool, page_only: bool) -> None:
    """Solve, print and draw; see the top of this file."""
    cases = modules()
    if unknown := [name for name in names if name not in cases]:
        raise SystemExit(f"unknown: {', '.join(unknown)}; known are {', '.join(cases)}")
    table = Table("Published cases; seconds of the processor", COLUMNS)
    for name in [] if page_only else names or list(cases):
        figures, solution = measure(name, cases[name], table)
        draw(cases[name].CASE, solution, (PICTURES if publish else ROOT / "out" / "published") / f"{name}.png")
        if publish:
            write(FIGURES / f"{name}.json", json.dumps(figures, indent=1) + "\n")
    if publish or page_only:
        write(PAGE, with_cases(PAGE.read_text(encoding="utf-8")))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Solve published cases.")
    parser.add_argument("names", nargs="*")
    parser.add_argument("--publish", action="store_true")
    parser.add_argument("--page", action="store_true")
    given = parser.parse_args()
    main(given.names, given.publish, given.page)
