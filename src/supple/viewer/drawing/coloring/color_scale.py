"""Color scales for values, and the color bar."""

from __future__ import annotations

import html
import math

import numpy as np
from numpy.typing import NDArray

from supple.viewer.drawing.coloring.fields import Field

BINS = 16  # colors of a scale; each is one mesh on the page, because a mesh has one color
NOT_KNOWN_COLOR = (150, 152, 158)
# A scale grows immediately, and shrinks only where less than this share of it is used: otherwise its ends flicker.
_SHRINK_BELOW = 0.3
_QUANTILE = 0.98  # share of the values within the scale: otherwise one extreme tet would give all others the same color


def palette(field: Field) -> NDArray[np.uint8]:
    """(BINS, 3) colors: from blue over white to red where the field has a center, otherwise from dark to bright."""
    from matplotlib import colormaps

    colors = colormaps["RdBu" if field.center is not None else "viridis"](np.linspace(0.0, 1.0, BINS))
    return np.round(255.0 * np.asarray(colors)[:, :3]).astype(np.uint8)


def bin_of(values: NDArray[np.float64], low: float, high: float) -> NDArray[np.int64]:
    """The color (0 to BINS - 1) of each value; BINS where it is not finite."""
    with np.errstate(invalid="ignore", over="ignore"):
        place = np.floor((values - low) / (high - low) * BINS)
    known = np.isfinite(values)
    return np.where(known, np.clip(np.where(known, place, 0.0), 0, BINS - 1), BINS).astype(np.int64)


class Limits:
    """The ends of a scale: round numbers that follow the displayed values in steps."""

    def __init__(self, field: Field) -> None:
        self.field = field
        self._reach = 0.0

    def follow(self, values: NDArray[np.float64]) -> tuple[float, float]:
        """(low, high) for these values (m,)."""
        center = self.field.center
        finite = values[np.isfinite(values)]
        away = np.abs(finite - center) if center is not None else finite
        needed = float(np.quantile(away, _QUANTILE)) if len(away) else 0.0
        needed = _round_up(max(needed, 0.02 if center is not None else 1e-9))
        if needed > self._reach or needed < _SHRINK_BELOW * self._reach:
            self._reach = needed
        return (0.0, self._reach) if center is None else (center - self._reach, center + self._reach)


def _round_up(value: float) -> float:
    """The next of 1, 2, 5, 10, 20, 50, ..."""
    scale = 10.0 ** math.floor(math.log10(value))
    return next(scale * step for step in (1.0, 2.0, 5.0, 10.0) if scale * step >= value * (1.0 - 1e-12))


def bar_html(field: Field, low: float, high: float) -> str:
    """The color bar: its colors, the numbers at its ends and in the middle, and their name and unit."""
    colors = ["rgb({},{},{})".format(*color) for color in palette(field)]
    stops = ",".join(f"{color} {100 * i / BINS:.2f}% {100 * (i + 1) / BINS:.2f}%" for i, color in enumerate(colors))
    title = html.escape(f"{field.name} [{field.unit}]" if field.unit else field.name)
    numbers = "".join(f"<span>{value:.4g}</span>" for value in (low, 0.5 * (low + high), high))
    return (
        '<div class="supple-color-bar" style="padding:0 0.75em 0.5em;font-size:0.75em">'
        f"<div>{title}</div>"
        f'<div style="height:1em;border-radius:3px;background:linear-gradient(to right,{stops})"></div>'
        f'<div style="display:flex;justify-content:space-between">{numbers}</div></div>'
    )
