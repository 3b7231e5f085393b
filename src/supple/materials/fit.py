"""Parameters of a material from tests: nonlinear least squares, with confidence intervals."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import SceneError
from supple.materials.by_law import ByLaw
from supple.materials.fit_families import Family, family_of
from supple.materials.fit_files import DEFAULT_UNITS, Units, read_test
from supple.materials.laws.isotropic_law import IsotropicLaw
from supple.runtime.figures import paper_figure

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


Source = str | Path | ArrayLike
# Bulk modulus over shear modulus where none is given: Poisson's ratio .499.
_BULK_RATIO = 500.0
# Evaluations of a fit from each start; the best one continues.
_ROUGH = 200


@dataclass(frozen=True, eq=False)
class MaterialFit:
    """A material with the parameters that fit its tests best.

    Attributes
    ----------
    material : with these parameters
    names : of the parameters; values : (q,) [Pa], exponents without unit
    standard_errors : (q,) in the units of the values [Pa or -]; not-a-number where the tests do not determine one
    intervals : (q, 2) in which a parameter is with the probability `confidence`, in its unit [Pa or -]
    confidence : of the intervals [-]
    residuals : by test, root mean square of the differences of stress, as a share of the test's largest stress
    curves : the tests
    """

    material: ByLaw
    names: tuple[str, ...]
    values: NDArray[np.float64]
    standard_errors: NDArray[np.float64]
    intervals: NDArray[np.float64]
    confidence: float
    residuals: dict[str, float]
    curves: tuple[Curve, ...]

    def __str__(self) -> str:
        lines = [f"{type(self.material).__name__}, {100 * self.confidence:g} % confidence"]
        for name, value, (low, high) in zip(self.names, self.values, self.intervals, strict=True):
            lines.append(f"  {name:8} {value:12.6g}   [{low:.6g}, {high:.6g}]")
        lines += [
            f"  {name}: differences of {100 * share:.2g} % of its largest stress"
            for name, share in self.residuals.items()
        ]
        return "\n".join(lines)

    def plot(self, path: str | Path) -> Path:
        """Draw the tests and the curves of the material to a PNG, PDF or SVG file."""
        return draw_fit(Path(path), f"{type(self.material).__name__}: tests, and the fit", self.curves, self.stresses)

    def stresses(self, stretch: ArrayLike, mode: str = "uniaxial") -> NDArray[np.float64]:
        """(k,) nominal stresses of the material at stretches (k,) [Pa], its volume being kept."""
        row = np.array([float(np.asarray(value)) for _, value in self.material.law_parameters()])
        law = self.material.law()
        assert isinstance(law, IsotropicLaw)
        return nominal_stresses(law, row, np.asarray(stretch, dtype=np.float64), mode)


def fit_material(
    kind: type[ByLaw],
    uniaxial: Source | Sequence[Source] | None = None,
    *,
    equibiaxial: Source | Sequence[Source] | None = None,
    pure_shear: Source | Sequence[Source] | None = None,
    terms: int = 2,
    bulk: float | None = None,
    stress_unit: float | None = None,
    area: float | None = None,
    length: float | None = None,
    confidence: float = 0.95,
) -> MaterialFit:
    """Fit the parameters of an incompressible rubber to its tests.

    The squares of the differences of nominal stress are minimized; each test's are divided by its largest stress, so
    that all tests count alike. Intervals are those of the linearized model, with Student's t distribution.

    Parameters
    ----------
    kind : `MooneyRivlin`, `Yeoh` or `Ogden`.
    uniaxial, equibiaxial, pure_shear : a CSV file with columns stretch (or strain, or extension) and stress (force per
        area at rest; or load), an array (k, 2), or a list of several.
    terms : of `Ogden`, 1 to 3.
    bulk : bulk modulus of the result [Pa]; None: 500 times its shear modulus. Tests of shape do not determine it.
    stress_unit : what the unit of stress in the tests is [Pa]: 1e6 for MPa. None: the unit that the column of a file
        names, or Pa.
    area, length : of the specimen at rest [m^2], [m], for files of testing machines with columns of load and extension.
    confidence : of the intervals [-], above 0 and below 1.

    Raises
    ------
    SceneError : where a test cannot be read, there are fewer data than parameters, or the best parameters have no
        shear modulus above zero.
    """
    family = family_of(kind, terms)
    if not 0.0 < confidence < 1.0:
        raise SceneError(f"fit_material: confidence is {confidence!r}; give a number above 0 and below 1")
    given = {"uniaxial": uniaxial, "equibiaxial": equibiaxial, "pure_shear": pure_shear}
    units = Units(stress_unit, area, length)
    curves = tuple(read_curve(one, mode, units) for mode in MODES for one in _several(given[mode]))
    count = sum(int(np.count_nonzero(curve.stretch != 1.0)) for curve in curves)
    if count <= len(family.names):
        raise SceneError(
            f"fit_material: {count} data with a stretch other than 1 for {len(family.names)} parameters; give more data"
            + (" or fewer terms" if len(family.names) > 2 else "")
        )
    scale = max(float(np.abs(curve.stress).max()) for curve in curves)
    if scale == 0.0:
        raise SceneError("fit_material: all stresses are zero; give a test with a load")
    values, errors, factor = _solved(family, curves, scale, confidence)
    parameters = family.arguments(values)
    if bulk is None:
        bulk = _BULK_RATIO * family.shear_modulus(values)
        if not bulk > 0.0:
            raise SceneError(
                f"fit_material: the best {kind.__name__} for these tests has the shear modulus "
                f"{bulk / _BULK_RATIO:g} Pa at rest; give data at smaller stretches, or another kind"
            )
    material = kind(bulk=bulk, **parameters)
    share = {
        curve.name: float(np.sqrt(np.mean(_differences(family, values, curve) ** 2)) / np.abs(curve.stress).max())
        for curve in curves
    }
    intervals = values[:, None] + factor * errors[:, None] * np.array([-1.0, 1.0])
    return MaterialFit(material, family.names, values, errors, intervals, confidence, share, curves)


def _several(source: Any) -> list[Any]:
    if source is None:
        return []
    if isinstance(source, (str, Path, np.ndarray)):
        return [source]
    listed = list(source)
    of_numbers = listed and not isinstance(listed[0], (str, Path)) and np.ndim(listed[0]) == 1
    return [listed] if of_numbers else listed


def _differences(family: Family, values: NDArray[np.float64], curve: Curve) -> NDArray[np.float64]:
    return nominal_stresses(family.law, family.row(values), curve.stretch, curve.mode) - curve.stress


def _solved(family: Family, curves: Sequence[Curve], scale: float, confidence: float):
    """The best values, their standard errors, and the factor of the interval."""
    from scipy.optimize import least_squares
    from scipy.stats import t as student

    units = np.where(family.is_modulus, scale, 1.0)
    weights = [1.0 / np.abs(curve.stress).max() for curve in curves]

    def residuals(q):
        with np.errstate(all="ignore"):
            parts = [w * _differences(family, units * q, curve) for w, curve in zip(weights, curves, strict=True)]
        return np.nan_to_num(np.concatenate(parts), nan=1e6, posinf=1e6, neginf=-1e6)

    accurate = {"method": "lm", "x_scale": "jac", "xtol": 1e-14, "ftol": 1e-14, "gtol": 1e-14}
    starts = list(family.starts(residuals, units))
    rough = [least_squares(residuals, start, method="lm", max_nfev=_ROUGH) for start in starts]
    best = least_squares(residuals, min(rough, key=lambda solution: solution.cost).x, **accurate)
    freedom = len(best.fun) - len(best.x)
    R = np.linalg.qr(best.jac, mode="r")
    if np.linalg.cond(R) > 1e12:
        errors = np.full(len(units), np.nan)
    else:
        inverse = np.linalg.inv(R)
        errors = units * np.sqrt(2.0 * best.cost / freedom * (inverse**2).sum(axis=1))
    return units * best.x, errors, float(student.ppf(0.5 + 0.5 * confidence, freedom))
