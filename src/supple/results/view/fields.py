"""Fields that color bodies: J, von Mises stress and energy density; and their color scales."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.numerics.deformation import determinants
from supple.results.readings.tet_readings import tet_values
from supple.results.view.model import RenderFrame


@dataclass(frozen=True)
class Field:
    """A field with one value for each tet.

    Attributes
    ----------
    key : its name in messages of the simulation; name, unit : for the color bar
    center : the value of the middle color, or None where 0 is the lowest value
    measure : computes the values (m,), NaN where they are not known
    """

    key: str
    name: str
    unit: str
    center: float | None
    measure: Callable[[RenderFrame], NDArray[np.float64]]

    def values(self, frame: RenderFrame) -> NDArray[np.float64]:
        """Values (m,), NaN where they are not known: from the simulation, otherwise computed here."""
        known = frame.tet_values.get(self.key)
        return self.measure(frame) if known is None else known


def volume_ratio(frame: RenderFrame) -> NDArray[np.float64]:
    """J = det F of every tet (m,)."""
    return determinants(frame.deformation_gradients)


def _of_laws(quantity: str) -> Callable[[RenderFrame], NDArray[np.float64]]:
    """What the elastic laws give, see `tet_values`; not known of a live simulation, which sends it."""

    def measure(frame: RenderFrame) -> NDArray[np.float64]:
        if frame.laws is None:
            return np.full(len(frame.model.tets), np.nan)
        return tet_values(frame.laws, frame.positions, quantity, frame.internal)

    return measure


COLOR_BY_BODY = "body"  # instead of the name of a field
FIELDS = {
    field.name: field
    for field in (
        Field("J", "volume ratio J", "", 1.0, volume_ratio),
        Field("von_mises", "von Mises stress", "Pa", None, _of_laws("von_mises")),
        Field("energy", "energy density", "J/m^3", None, _of_laws("energy")),
    )
}


NOT_KNOWN_COLOR = (150, 152, 158)
# A scale grows immediately, and shrinks only where less than this share of it is used: otherwise its ends flicker.
_SHRINK_BELOW = 0.3


def colors_of(field: Field, values: NDArray[np.float64], ends: tuple[float, float]) -> NDArray[np.uint8]:
    """(k, 3) of values (k,): from red over white to blue where the field has a center, otherwise from dark to bright.

    Both are perceptually uniform on either side of their middle.
    """
    from matplotlib import colormaps

    low, high = ends
    share = np.clip((values - low) / (high - low), 0.0, 1.0)
    return np.round(255.0 * np.asarray(colormaps[color_map(field)](share))[:, :3]).astype(np.uint8)


def color_map(field: Field) -> str:
    """The name that matplotlib gives to the colors of a field."""
    return "RdBu" if field.center is not None else "viridis"


def nodal_values(frame: RenderFrame, values: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n,) the mean of the tets around each vertex; middle nodes have that of their neighbours."""
    model = frame.model
    known = np.asarray(np.isfinite(values))
    corners, own = model.tets[known].ravel(), np.repeat(values[known], 4)
    n = len(frame.positions)
    total, count = np.bincount(corners, own, minlength=n), np.bincount(corners, minlength=n)
    mean = np.where(count > 0, total / np.maximum(count, 1), np.nan)
    for body in model.bodies:  # a middle node is beside corners in the quarters of a side, but for the inner one
        triangles = body.boundary + body.vertices.start
        unknown = np.asarray(np.isnan(mean[triangles]))
        mixed = np.any(unknown, axis=1) & ~np.all(unknown, axis=1)
        around = np.repeat(np.nanmean(mean[triangles[mixed]], axis=1), unknown[mixed].sum(axis=1))
        rows = triangles[mixed][unknown[mixed]]
        times = np.bincount(rows, minlength=n)
        filled = np.bincount(rows, around, minlength=n) / np.maximum(times, 1)
        mean = np.where(np.isnan(mean) & (times > 0), filled, mean)
    return np.nan_to_num(mean)


@dataclass(frozen=True)
class Range:
    """How the ends of a scale are found.

    Attributes
    ----------
    share : of the values within the scale; the others have the colors of its ends
    fixed : (low, high) instead, or None
    """

    share: float = 0.98
    fixed: tuple[float, float] | None = None


class Limits:
    """The ends of a scale: fixed, or round numbers that follow the displayed values in steps."""

    def __init__(self, field: Field, ends: Range) -> None:
        self.field, self.ends = field, ends
        self._reach = 0.0

    def follow(self, values: NDArray[np.float64]) -> tuple[float, float] | None:
        """(low, high) for these values (m,); None where no value is known."""
        center = self.field.center
        finite = values[np.isfinite(values)]
        if not len(finite):
            return None
        if self.ends.fixed is not None:
            return self.ends.fixed
        away = np.abs(finite - center) if center is not None else finite
        needed = float(np.quantile(away, self.ends.share))
        needed = round_up(max(needed, 0.02 if center is not None else 1e-9))
        if needed > self._reach or needed < _SHRINK_BELOW * self._reach:
            self._reach = needed
        return (0.0, self._reach) if center is None else (center - self._reach, center + self._reach)


def round_up(value: float) -> float:
    """The next of 1, 2, 5, 10, 20, 50, ..."""
    scale = 10.0 ** math.floor(math.log10(value))
    return next(scale * step for step in (1.0, 2.0, 5.0, 10.0) if scale * step >= value * (1.0 - 1e-12))
