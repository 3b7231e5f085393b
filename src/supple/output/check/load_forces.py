"""The forces of loads on vertices, computed anew from a frame: tractions, forces per mass, pressures and springs."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from supple.output.recording.actions.loads import LoadPattern


def load_forces(
    loads: Mapping[str, LoadPattern], values: Mapping[str, NDArray[np.float64] | float], x: NDArray[np.float64]
) -> dict[str, NDArray[np.float64]]:
    """By the name of their work, (n, 3) at positions x (n, 3) [N]; NaN where a value is missing."""
    out: dict[str, NDArray[np.float64]] = {}
    for name, load in loads.items():
        total = out.setdefault(load.work, np.zeros_like(x))
        _add_forces(load, np.asarray(values.get(name, np.nan)), x, total)
    return out


def _add_forces(
    load: LoadPattern, value: NDArray[np.float64], x: NDArray[np.float64], out: NDArray[np.float64]
) -> None:
    if load.kind == "pressure":
        a, b, c = (x[corner] for corner in load.vertices.T)
        on_corner = -value / 6.0 * np.cross(b - a, c - a)
        for corner in load.vertices.T:
            for k in range(3):
                out[:, k] += np.bincount(corner, on_corner[:, k], len(x))
        return
    force = value
    if load.kind == "spring":
        r = load.weights @ x[load.vertices] + np.asarray(load.offset)
        length = float(np.linalg.norm(r))
        force = -load.stiffness * (length - value) * (r / length if length > 0.0 else np.zeros(3))
    np.add.at(out, load.vertices, load.weights[:, None] * force)
