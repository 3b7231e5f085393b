"""Curves of material tests: nominal stress over stretch, measured or of a material that keeps its volume."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import SceneError
from supple.materials.laws.isotropic_law import IsotropicLaw

# Of a test with the stretch l in its direction: the other two stretches are powers of l, their product with l is 1.
MODES = {"uniaxial": (-0.5, -0.5), "equibiaxial": (1.0, -2.0), "pure_shear": (0.0, -1.0)}
_STRETCH, _STRAIN, _STRESS = ("stretch", "lambda"), ("strain",), ("stress",)


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


def read_curve(source: str | Path | ArrayLike, mode: str, stress_unit: float) -> Curve:
    """A test from a CSV file or from an array (k, 2) of stretches and stresses.

    A file has a line of names: a column "stretch" (or "strain", the nominal one) and a column "stress", each perhaps
    with more words after it, such as "stress [MPa]". `stress_unit` is what one unit of stress is [Pa].

    Raises
    ------
    SceneError : where the file cannot be read or has other columns, or a value is not a finite number.
    """
    if isinstance(source, (str, Path)):
        path = Path(source)
        values, name = _columns(path), path.name
    else:
        try:
            values, name = np.asarray(source, dtype=np.float64), mode
        except (TypeError, ValueError):
            raise SceneError(f"{mode}: give a CSV file, or an array (k, 2) of stretches and stresses") from None
        if values.ndim != 2 or values.shape[1] != 2:
            raise SceneError(f"{mode}: the array has shape {values.shape}; give (k, 2): stretches and stresses")
    bad = ~np.isfinite(values).all(axis=1) | ~(values[:, 0] > 0.0)
    if bad.any():
        raise SceneError(f"{name}: row {np.flatnonzero(bad)[0] + 1} of the data is not a stretch above 0 and a stress")
    return Curve(mode, name, values[:, 0].copy(), stress_unit * values[:, 1])


def _columns(path: Path) -> NDArray[np.float64]:
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            rows = [row for row in csv.reader(file) if row and not row[0].lstrip().startswith("#")]
    except (OSError, UnicodeDecodeError) as error:
        raise SceneError(f"{path}: cannot be read: {getattr(error, 'strerror', None) or error}") from None
    names = [name.strip().lower() for name in rows[0]] if rows else []

    def column(starts: tuple[str, ...]) -> int | None:
        return next((k for k, name in enumerate(names) if name.startswith(starts)), None)

    stretch, strain, stress = column(_STRETCH), column(_STRAIN), column(_STRESS)
    if stress is None or (stretch is None and strain is None):
        raise SceneError(
            f"{path}: has the columns {', '.join(names) or 'of no name'}; name two of them stretch and stress"
        )
    first = strain if stretch is None else stretch
    assert first is not None
    try:
        values = np.array([[float(row[first]), float(row[stress])] for row in rows[1:]]).reshape(-1, 2)
    except (ValueError, IndexError):
        raise SceneError(f"{path}: a row has no number in the columns {names[first]} and {names[stress]}") from None
    return values + np.array([1.0, 0.0]) if stretch is None else values


def nominal_stresses(law: IsotropicLaw, p: NDArray[np.float64], stretch: NDArray[np.float64], mode: str):
    """(k,) nominal stresses [Pa] of an isotropic law with parameters p (q,) whose volume does not change.

    The last direction is free of stress, which gives the pressure: P = (tau_0 - tau_2) / l.
    """
    s = np.column_stack([stretch, *(stretch**power for power in MODES[mode])])
    values = law.stretch_values(s, np.broadcast_to(p, (len(s), len(p))))
    return (values[:, 1] * s[:, 0] - values[:, 3] * s[:, 2]) / stretch
