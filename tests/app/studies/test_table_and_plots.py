"""The table of a study, the effects of its factors, and its plots, on made-up results."""

import csv
from pathlib import Path

import numpy as np
import pytest

import supple as sp
from supple.app.studies.cases import Case, CaseResult, read_result, write_result
from supple.app.studies.factors import Levels
from supple.app.studies.plots import main_effects, plot_one_factor, plot_two_factors, varying_factors
from supple.app.studies.table import StudyTable


def table_of(points, measure, failed=(), units=None):
    cases = [Case(f"{k:04x}", point) for k, point in enumerate(points)]
    results = {
        case.key: CaseResult("failed", reason="no, really")
        if k in failed
        else CaseResult("done", {"y": measure(**case.values)})
        for k, case in enumerate(cases)
    }
    return StudyTable.of(Path("s"), tuple(points[0]), units or {}, cases, results)


GRID = sp.studies.Grid().points(
    {"a": Levels((1, 2, 4)), "b": sp.studies.uniform(0.0, 1.0, 3), "kind": Levels(("soft", "hard"))}
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


def test_the_effects_of_a_linear_function_in_a_grid_are_exact():
    effects = main_effects(table_of(GRID, linear), "y")
    assert [effect.factor for effect in effects] == ["a", "b", "kind"]
    assert [effect.high - effect.low for effect in effects] == pytest.approx([30.0, -3.0, 1.0], rel=1e-12)
    assert (effects[0].low_label, effects[2].high_label) == ("1", "hard")


@pytest.mark.parametrize("design", [sp.studies.LatinHypercube(32, seed=1), sp.studies.Sobol(32, seed=1)])
def test_the_effects_of_a_linear_function_on_samples_are_exact(design):
    points = design.points({"u": sp.studies.uniform(0.0, 2.0), "v": sp.studies.uniform(-1.0, 1.0)})
    effects = main_effects(table_of(points, lambda u, v: 5.0 * v - u), "y")
    spans = [np.ptp([point[effect.factor] for point in points]) for effect in effects]
    assert [effect.factor for effect in effects] == ["v", "u"]
    assert [e.high - e.low for e in effects] == pytest.approx([5.0 * spans[0], -spans[1]], rel=1e-9)


def test_the_effects_of_one_factor_at_a_time_are_those_of_its_two_cases():
    points = sp.studies.OneAtATime().points({"u": sp.studies.uniform(0.0, 2.0), "v": Levels((1, 2, 3))})
    effects = main_effects(table_of(points, lambda u, v: u**2 * v), "y")
    assert [(e.factor, e.low, e.high) for e in effects] == [("u", 0.0, 8.0), ("v", 1.0, 3.0)]


def test_factors_that_do_not_vary_have_no_effect():
    table = table_of([{"a": 1, "b": 2}, {"a": 1, "b": 3}], lambda a, b: b)
    assert varying_factors(table) == ["b"]


@pytest.mark.parametrize(
    ("factors", "files"),
    [
        ({"a": Levels((1, 2, 1000))}, {"y-over-a.png"}),
        ({"a": Levels((1, 2)), "b": Levels(("p", "q"))}, {"y.png", "y-tornado.png"}),
        (
            {"a": Levels((1, 2)), "b.c": Levels((1, 2)), "d": Levels(((1, 2), (3, 4)))},
            {"y-tornado.png", "y-over-a.png", "y-over-b.c.png", "y-over-d.png"},
        ),
    ],
)
def test_the_plots_that_fit_the_number_of_factors(tmp_path, factors, files):
    points = sp.studies.Grid().points(factors)
    table = table_of(points, lambda **values: float(len(str(values))), failed=(1,))
    written = sp.studies.plot_study(table, tmp_path / "plots")
    assert {path.name for path in written} == files
    for path in written:
        assert path.read_bytes().startswith(b"\x89PNG")


@pytest.fixture
def drawn(monkeypatch):
    """The figures that are written."""
    kept = []
    monkeypatch.setattr("matplotlib.figure.Figure.savefig", lambda self, file, format: kept.append(self))
    return kept


def test_a_curve_and_a_map_have_the_table_s_numbers(tmp_path, drawn):
    table = table_of([{"a": 3}, {"a": 1}, {"a": 2}], lambda a: a * a)
    plot_one_factor(table, "y", "a", tmp_path / "a.png")
    (line,) = drawn[0].axes[0].lines
    assert line.get_xydata().tolist() == [[1, 1], [2, 4], [3, 9]]
    points = sp.studies.Grid().points({"a": Levels((1, 2, 3)), "b": Levels((10, 20))})
    plot_two_factors(table_of(points, lambda a, b: a + b), "y", "a", "b", tmp_path / "b.png")
    (mesh,) = drawn[1].axes[0].collections
    assert mesh.get_array().reshape(2, 3).tolist() == [[11, 12, 13], [21, 22, 23]]


def test_values_over_decades_have_logarithmic_axes(tmp_path, drawn):
    decades, linear = [{"a": 10.0**k, "b": k} for k in range(3)], [{"a": 1.0 + k} for k in range(3)]
    plot_one_factor(table_of(decades, lambda a, b: a), "y", "a", tmp_path / "a.png")
    plot_one_factor(table_of(linear, lambda a: -a), "y", "a", tmp_path / "a.png")
    points = sp.studies.Grid().points({"a": Levels((1, 2, 3)), "b": Levels((1, 1000))})
    plot_two_factors(table_of(points, lambda a, b: a * b), "y", "a", "b", tmp_path / "b.png")
    assert [(figure.axes[0].get_xscale(), figure.axes[0].get_yscale()) for figure in drawn[:2]] == [
        ("log", "log"),
        ("linear", "linear"),
    ]
    assert drawn[2].axes[1].get_yscale() == "log"  # the color bar


def test_a_table_without_a_case_that_is_done_cannot_be_plotted(tmp_path):
    table = table_of([{"a": 1}], lambda a: a, failed=(0,))
    assert sp.studies.plot_study(table, tmp_path) == []
    with pytest.raises(sp.StudyError, match="no case is done"):
        plot_one_factor(table, "y", "a", tmp_path / "a.png")


def test_results_are_read_back_and_damaged_ones_are_ignored(tmp_path):
    result = CaseResult("done", {"y": 0.1 + 0.2}, measured_by="m", frames=3, wall_seconds=1.5, simulated=True)
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
