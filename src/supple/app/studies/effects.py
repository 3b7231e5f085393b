"""How much each factor of a study changes a measure."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.app.studies.table import StudyTable


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
