"""The table of a study on made-up results."""

import csv
from pathlib import Path

import numpy as np
import pytest

import supple as sp
from supple.app.studies.run_case import CaseResult, read_result, write_result
from supple.app.studies.sources import Case
from supple.app.studies.table import StudyTable


def table_of(points, measure, failed=(), units=None):
    def job(folder):
        raise AssertionError

    results = [
        CaseResult("failed", reason="no, really") if k in failed else CaseResult("done", {"y": measure(**point)})
        for k, point in enumerate(points)
    ]
    cases = [Case(f"{k:04x}", point, job) for k, point in enumerate(points)]
    return StudyTable(Path("s"), tuple(points[0]), units or {}, tuple(zip(cases, results, strict=True)))


GRID = sp.studies.Grid().points(
    {
        "a": sp.studies.Factor(values=(1, 2, 4)),
        "b": sp.studies.uniform(0.0, 1.0, 3),
        "kind": sp.studies.Factor(values=("soft", "hard")),
    }
)


def linear(a, b, kind):
    return 10.0 * a - 3.0 * b + (1.0 if kind == "hard" else 0.0)


def test_columns_and_csv(tmp_path):
    table = table_of(GRID, linear, failed=(4,), units={"a": "m", "y": "J"})
    assert len(table) == 18
    assert np.isnan(table["y"][4])
    assert table["y"][0] == 10.0
    assert table["kind"][:2].tolist() == ["soft", "hard"]
    table.write_csv(tmp_path / "t.csv")
    with (tmp_path / "t.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == ["case", "a [m]", "b", "kind", "y [J]", "status", "reason"]
    assert [float(row["b"]) for row in rows] == table["b"].tolist()
    assert (rows[4]["y [J]"], rows[4]["status"], rows[4]["reason"]) == ("", "failed", "no, really")
    with pytest.raises(sp.StudyError, match="no column 'aa'; did you mean 'a'"):
        table["aa"]


def test_results_are_read_back_and_damaged_ones_are_ignored(tmp_path):
    result = CaseResult("done", {"y": 0.1 + 0.2}, measured_by="m", wall_seconds=1.5, simulated=True)
    write_result(tmp_path, result)
    assert read_result(tmp_path) == result
    path = tmp_path / "result.json"
    text = path.read_text(encoding="utf-8")
    for damaged in (
        text[:-10],
        "",
        "[]",
        "3",
        '{"status": "done"',
        text.replace("0.3", '"x'),
        text.replace("done", "gone"),
    ):
        path.write_text(damaged, encoding="utf-8")
        assert read_result(tmp_path) is None
    assert read_result(tmp_path / "absent") is None
