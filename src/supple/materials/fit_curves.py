"""Curves of material tests: nominal stress over stretch, measured or of a material that keeps its volume."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import SceneError
from supple.materials.fit_files import DEFAULT_UNITS, Units, read_test
from supple.materials.laws.isotropic_law import IsotropicLaw

# Of a test with the stretch l in its direction: the other two stretches are powers of l, their product with l is 1.
MODES = {"uniaxial": (-0.5, -0.5), "equibiaxial": (1.0, -2.0), "pure_shear": (0.0, -1.0)}


@dataclass(frozen=True, eq=False)
class Curve:
    """A test.

    Attributes
    ----------
    mode : "uniaxial", "equibiaxial" or "pure_shear"; name : of the file, or the mode
    stretch : (k,) [-]; stress : (k,) nominal, force per area at rest [Pa]
    """

    mode: str
    name: str
    stretch: NDArray[np.float64]
    stress: NDArray[np.float64]


def read_curve(source: str | Path | ArrayLike, mode: str, units: Units = DEFAULT_UNITS) -> Curve:
    """A test from a CSV file or from an array (k, 2) of stretches and stresses; see `supple.materials.fit_files`.

    Raises
    ------
    SceneError : where the file cannot be read or has other columns, or a value is not a finite number.
    """
    if isinstance(source, (str, Path)):
        path = Path(source)
        values, name = read_test(path, units), path.name
    else:
        try:
            values, name = np.asarray(source, dtype=np.float64) * [1.0, units.stress or 1.0], mode
        except (TypeError, ValueError):
            raise SceneError(f"{mode}: give a CSV file, or an array (k, 2) of stretches and stresses") from None
        if values.ndim != 2:
            raise SceneError(f"{mode}: the array has shape {values.shape}; give (k, 2): stretches and stresses")
    bad = ~np.isfinite(values).all(axis=1) | ~(values[:, 0] > 0.0)
    if bad.any():
        raise SceneError(f"{name}: row {np.flatnonzero(bad)[0] + 1} of the data is not a stretch above 0 and a stress")
    return Curve(mode, name, values[:, 0].copy(), values[:, 1].copy())


def nominal_stresses(law: IsotropicLaw, p: NDArray[np.float64], stretch: NDArray[np.float64], mode: str):
    """(k,) nominal stresses [Pa] of an isotropic law with parameters p (q,) whose volume does not change.

    The last direction is free of stress, which gives the pressure: P = (tau_0 - tau_2) / l.
    """
    s = np.column_stack([stretch, *(stretch**power for power in MODES[mode])])
    values = law.stretch_values(s, np.broadcast_to(p, (len(s), len(p))))
    return (values[:, 1] * s[:, 0] - values[:, 3] * s[:, 2]) / stretch
