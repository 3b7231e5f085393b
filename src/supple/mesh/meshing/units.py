"""Surfaces that are most likely in millimetres: STL and OBJ files do not name their unit."""

from __future__ import annotations

import logging
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from supple.mesh.meshing.option_names import option

logger = logging.getLogger(__name__)

# Few soft bodies are longer [m].
_LARGE = 10.0


def likely_scale(vertices: NDArray[np.float64]) -> float:
    """0.001 where the points (n, 3) extend over more than 10 m, otherwise 1."""
    return 0.001 if float(np.ptp(vertices, axis=0).max(initial=0.0)) > _LARGE else 1.0


def millimetres_hint(path: str | Path, vertices: NDArray[np.float64]) -> str:
    """What to do about a file whose points (n, 3) [m] are most likely in millimetres; empty for others."""
    if likely_scale(vertices) == 1.0:
        return ""
    length = float(np.ptp(vertices, axis=0).max())
    return f"{path} is {length:.4g} m long; where it is in millimetres, give {option('scale', 0.001)}"


def warn_of_millimetres(path: str | Path, vertices: NDArray[np.float64], scale: float) -> None:
    """Log the hint where nobody has given a scale other than 1."""
    if scale == 1.0 and (hint := millimetres_hint(path, vertices)):
        logger.warning("%s", hint)
