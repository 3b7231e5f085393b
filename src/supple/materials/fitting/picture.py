"""A picture of a fit: the tests and the curves of the material."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from supple.materials.fitting.curves import Curve
from supple.runtime.figures import paper_figure

_COLORS = {"uniaxial": "#30638e", "equibiaxial": "#d1495b", "pure_shear": "#3a7d44"}


def draw_fit(
    path: Path, title: str, curves: Sequence[Curve], stresses: Callable[[NDArray[np.float64], str], NDArray[np.float64]]
) -> Path:
    """Draw tests as points, and the `stresses` of (stretches, mode) as lines.

    Raises
    ------
    OutputError : where the picture cannot be written.
    """
    largest = max(float(np.abs(curve.stress).max()) for curve in curves)
    unit, factor = next((u, f) for u, f in (("MPa", 1e6), ("kPa", 1e3), ("Pa", 1.0)) if largest >= f or f == 1.0)
    with paper_figure(path, 6.0, 4.2) as figure:
        axes = figure.subplots()
        for curve in curves:
            color = _COLORS[curve.mode]
            axes.plot(curve.stretch, curve.stress / factor, "o", markersize=4, color=color, label=curve.name)
            dense = np.linspace(min(1.0, curve.stretch.min()), curve.stretch.max(), 200)
            axes.plot(dense, stresses(dense, curve.mode) / factor, "-", color=color)
        axes.set_xlabel("stretch")
        axes.set_ylabel(f"nominal stress [{unit}]")
        axes.set_title(title)
        axes.legend()
    return path
