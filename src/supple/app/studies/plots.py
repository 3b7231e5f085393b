"""Plots of a study: a measure over one factor, over two factors, and the effects of all factors (a tornado plot)."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.app.studies.table import StudyTable
from supple.errors import StudyError
from supple.runtime.figures import paper_figure, spans_decades

_COLOR, _LOW, _HIGH = "#30638e", "#5ba3d0", "#d1495b"
_SIZE = (5.4, 3.6)


def plot_study(table: StudyTable, folder: str | Path) -> list[Path]:
    """The plots that fit the number of factors that vary, for every measure, as PNG files in a folder.

    One factor: a curve. Two: a map, and a tornado plot. More: a tornado plot, and the points over each factor.

    Parameters
    ----------
    table : of a study; folder : of the pictures, made where it does not exist.

    Raises
    ------
    OutputError : where a file cannot be written.
    """
    names = varying_factors(table)
    written = []
    for measure in table.measures:
        stem = Path(folder) / _file_name(measure)
        if len(names) == 2:
            written.append(plot_two_factors(table, measure, names[0], names[1], stem.with_name(f"{stem.name}.png")))
        if len(names) >= 2:
            written.append(plot_tornado(table, measure, stem.with_name(f"{stem.name}-tornado.png")))
        if len(names) != 2:
            for name in names:
                path = stem.with_name(f"{stem.name}-over-{_file_name(name)}.png")
                written.append(plot_one_factor(table, measure, name, path))
    return written


def plot_one_factor(table: StudyTable, measure: str, factor: str, output: str | Path) -> Path:
    """A measure over one factor: a point per case, and a line where no other factor varies.

    Raises
    ------
    StudyError : where the table has no such column, or no case is done.
    OutputError : where the picture cannot be written.
    """
    done = _some_done(table)
    y, column = table[measure][done], table[factor][done]
    x, ticks = _positions(column)
    order = np.argsort(x, kind="stable")
    line = "-" if varying_factors(table) == [factor] else ""
    with paper_figure(Path(output), *_SIZE) as figure:
        axis = figure.subplots()
        axis.plot(x[order], y[order], marker="o", linestyle=line, color=_COLOR, markersize=4)
        _label_axis(axis.xaxis, axis.set_xscale, x, ticks)
        _label_axis(axis.yaxis, axis.set_yscale, y, None)
        axis.set_xlabel(table.label(factor))
        axis.set_ylabel(table.label(measure))
    return Path(output)


def plot_two_factors(table: StudyTable, measure: str, first: str, second: str, output: str | Path) -> Path:
    """A measure over two factors: colored cells where they form a grid, colored points otherwise.

    Raises
    ------
    StudyError, OutputError : as for `plot_one_factor`.
    """
    done = _some_done(table)
    z = table[measure][done]
    x, x_ticks = _positions(table[first][done])
    y, y_ticks = _positions(table[second][done])
    columns, column = np.unique(x, return_inverse=True)
    rows, row = np.unique(y, return_inverse=True)
    with paper_figure(Path(output), *_SIZE) as figure:
        axis = figure.subplots()
        axis.grid(False)
        colors = {"cmap": "viridis", "norm": "log" if spans_decades(z) else "linear"}
        if len(columns) * len(rows) <= 2 * len(z):  # a grid, in which some cases may have failed
            cells = np.full((len(rows), len(columns)), np.nan)
            cells[row, column] = z
            places = np.arange(len(columns)), np.arange(len(rows))
            drawn = axis.pcolormesh(*places, cells, shading="nearest", **colors)
            _label_cells(axis.xaxis, columns, x_ticks)
            _label_cells(axis.yaxis, rows, y_ticks)
        else:
            drawn = axis.scatter(x, y, c=z, s=30, **colors)
            _label_axis(axis.xaxis, axis.set_xscale, x, x_ticks)
            _label_axis(axis.yaxis, axis.set_yscale, y, y_ticks)
        axis.set_xlabel(table.label(first))
        axis.set_ylabel(table.label(second))
        figure.colorbar(drawn, ax=axis, label=table.label(measure))
    return Path(output)


def plot_tornado(table: StudyTable, measure: str, output: str | Path) -> Path:
    """A bar per factor, from the measure at the factor's low end to that at its high end, the longest bar on top.

    See `supple.app.studies.plots.main_effects`.

    Raises
    ------
    StudyError, OutputError : as for `plot_one_factor`.
    """
    _some_done(table)
    effects = main_effects(table, measure)[::-1]
    middle = float(np.mean(table[measure][table.done]))
    with paper_figure(Path(output), _SIZE[0], 1.1 + 0.4 * len(effects)) as figure:
        axis = figure.subplots()
        axis.grid(False, axis="y")
        for k, effect in enumerate(effects):
            for end, label, color in ((effect.low, effect.low_label, _LOW), (effect.high, effect.high_label, _HIGH)):
                axis.barh(k, end - middle, left=middle, color=color, height=0.6)
                side = "left" if end >= middle else "right"
                axis.annotate(
                    label, (end, k), (3 if side == "left" else -3, 0), textcoords="offset points", ha=side, va="center"
                )
        axis.axvline(middle, color="0.2", linewidth=0.8)
        axis.set_yticks(range(len(effects)), [table.label(effect.factor) for effect in effects])
        axis.set_xlabel(table.label(measure))
        axis.margins(x=0.15)
    return Path(output)


def _some_done(table: StudyTable) -> NDArray[np.bool_]:
    if not table.done.any():
        raise StudyError(f"{table.folder}: no case is done, so that there is nothing to plot")
    return table.done


def _positions(column: NDArray[Any]) -> tuple[NDArray[np.float64], list[str] | None]:
    """Places on an axis; for values that are not numbers, 0, 1, 2, ..., and their labels."""
    if column.dtype != object:
        return column.astype(float), None
    labels = list(dict.fromkeys(str(value) for value in column))
    return np.array([labels.index(str(value)) for value in column], dtype=float), labels


def _label_axis(axis: Any, set_scale: Any, places: NDArray[np.float64], ticks: list[str] | None) -> None:
    if ticks is not None:
        axis.set_ticks(range(len(ticks)), ticks)
    elif spans_decades(places):
        set_scale("log")


def _label_cells(axis: Any, places: NDArray[np.float64], ticks: list[str] | None) -> None:
    axis.set_ticks(range(len(places)), ticks or [f"{place:.4g}" for place in places])


def _file_name(name: str) -> str:
    return re.sub(r"[^\w.-]+", "_", name)[:80]


@dataclass(frozen=True)
class Effect:
    """The effect of one factor on one measure: the measure at the factor's low and high end, others averaged."""

    factor: str
    low: float
    high: float
    low_label: str
    high_label: str


def varying_factors(table: StudyTable) -> list[str]:
    """The factors with at least two values in the cases that are done."""
    return [name for name in table.factors if len(set(map(_key, table[name][table.done]))) > 1]


def main_effects(table: StudyTable, measure: str) -> list[Effect]:
    """The effect of every factor that varies, the largest first.

    A factor with a value in every case of its own (random designs) is taken as linear in a regression with all such
    factors (least squares). Otherwise the cases with each value are averaged, and the ends are the first and the last
    value; in a design of one factor at a time, both ends are single cases.
    """
    done = table.done
    y = table[measure][done]
    continuous, effects = [], []
    for name in varying_factors(table):
        column = table[name][done]
        if column.dtype != object and len(set(column)) == len(column):
            continuous.append(name)
        else:
            effects.append(_of_levels(name, column, y))
    effects += _of_regression(table, continuous, y)
    return sorted(effects, key=lambda effect: -abs(effect.high - effect.low))


def _of_levels(name: str, column: NDArray[Any], y: NDArray[np.float64]) -> Effect:
    keys = list(map(_key, column))
    values = {key: value for key, value in zip(keys, column, strict=True)}
    if column.dtype != object:
        ends = min(values, key=values.__getitem__), max(values, key=values.__getitem__)
    else:
        ends = next(iter(values)), list(values)[-1]
    low, high = (float(np.mean([number for key, number in zip(keys, y, strict=True) if key == end])) for end in ends)
    return Effect(name, low, high, _label(values[ends[0]]), _label(values[ends[1]]))


def _of_regression(table: StudyTable, names: list[str], y: NDArray[np.float64]) -> list[Effect]:
    if not names:
        return []
    X = np.column_stack([table[name][table.done].astype(float) for name in names])
    low, high = X.min(axis=0), X.max(axis=0)
    # Ends at -1/2 and 1/2; with fewer cases than factors, the smallest of all solutions.
    scaled = (X - 0.5 * (low + high)) / (high - low)
    slopes = np.linalg.lstsq(np.column_stack([np.ones(len(y)), scaled]), y, rcond=None)[0]
    middle = float(slopes[0])
    return [
        Effect(name, middle - 0.5 * float(b), middle + 0.5 * float(b), f"{lo:.3g}", f"{hi:.3g}")
        for name, b, lo, hi in zip(names, slopes[1:], low, high, strict=True)
    ]


def _key(value: Any) -> str:
    return json.dumps(value.item() if isinstance(value, np.generic) else value)


def _label(value: Any) -> str:
    return f"{value:.3g}" if isinstance(value, int | float | np.number) else str(value)[:20]
