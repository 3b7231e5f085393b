"""Parameters of a simulation from measurements: bounded least squares, and L-BFGS-B where there are many parameters."""

from __future__ import annotations

import csv
import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import SceneError, SuppleError
from supple.gradients.sensitivity import Sensitivity
from supple.runtime.figures import paper_figure
from supple.runtime.replacing import whole_file

logger = logging.getLogger(__name__)

Floats = NDArray[np.float64]

# Where a run fails, its residuals count as this many times those of the start: the step is then made shorter.
_FAILED = 1e3
# Of least squares: more parameters than this make Jacobians dearer than gradients.
_MOST_COLUMNS = 50
# Condition of a Jacobian, whose digits are eight, beyond which the readings do not determine the parameters.
_SINGULAR = 1e7


@dataclass(frozen=True, eq=False)
class SimulationFit:
    """The parameters with the smallest loss.

    Attributes
    ----------
    names : of the parameters; values : (q,) in the unit of each
    standard_errors : (q,) in the unit of each, from the residuals and their Jacobian; not-a-number where the readings
        do not determine one, or the loss is not a sum of misfits
    loss : at the values, in the unit of the loss; evaluations : how many runs it took; message : why it ended
    measured, simulated : by label of the misfit, (k,) in the unit of its quantity
    """

    names: tuple[str, ...]
    values: Floats
    standard_errors: Floats
    loss: float
    evaluations: int
    message: str
    measured: dict[str, Floats] = field(default_factory=dict)
    simulated: dict[str, Floats] = field(default_factory=dict)

    def __str__(self) -> str:
        rows = zip(self.names, self.values, self.standard_errors, strict=True)
        lines = [f"{name} = {value:.6g} +- {error:.2g}" for name, value, error in rows]
        return "\n".join([*lines, f"loss {self.loss:.6g} after {self.evaluations} runs: {self.message}"])

    def plot(self, path: str | Path, over: tuple[str, str, ArrayLike] | None = None) -> Path:
        """Draw what was simulated over what was measured to a PNG, PDF or SVG file.

        Parameters
        ----------
        over : labels of a quantity and of the readings, with their units in brackets, and the values (k,) of that
            quantity, over which to draw both instead.

        Raises
        ------
        OutputError : where it cannot be written.
        """
        path = Path(path)
        with paper_figure(path, 4.5, 4.2) as figure:
            axes = figure.subplots()
            for label, values in self.measured.items():
                if over is None:
                    axes.plot(values, self.simulated[label], ".", markersize=4, label=label)
                else:
                    axes.plot(over[2], values, "o", markersize=4, label="measured")
                    axes.plot(over[2], self.simulated[label], "-", label="simulated")
            if over is None:
                low, high = axes.get_xlim()
                axes.plot([low, high], [low, high], "-", color="0.6", linewidth=1)
            axes.set_xlabel("measured" if over is None else over[0])
            axes.set_ylabel("simulated" if over is None else over[1])
            axes.legend()
        return path


def fit_simulation(
    sensitivity: Sensitivity,
    start: ArrayLike,
    *,
    bounds: tuple[ArrayLike, ArrayLike] | None = None,
    names: Sequence[str] | None = None,
    max_evaluations: int = 40,
    tolerance: float = 1e-8,
    log: str | Path | None = None,
    report: Callable[[str], object] | None = None,
) -> SimulationFit:
    """Find the parameters for which a simulation has the smallest loss.

    A loss of misfits alone is solved by bounded least squares with the exact Jacobian, another one, or one of many
    parameters, by L-BFGS-B with the gradient. Both are those of SciPy.

    Parameters
    ----------
    sensitivity : the loss.
    start : (q,) parameters to begin with, in the unit of each. Their sizes, or `sensitivity.scales`, are the scales.
    bounds : (q,) least and (q,) largest parameters, in the unit of each; None: without bounds.
    names : (q,) of the parameters; None: "p0", "p1" and so on.
    max_evaluations : largest number of runs that are compared.
    tolerance : relative change [-] of the loss or of the parameters at which it ends.
    log : a CSV file, to which every run is appended. Where it exists, the best run in it is where the fit begins.
    report : gets one line of text for every run, such as `print`.

    Raises
    ------
    SceneError : where the parameters do not fit, or the log belongs to other ones.
    SceneError, SolverError : as `Sensitivity`, at the start. Where a later run fails, its parameters count as bad.
    """
    from scipy.optimize import least_squares, minimize

    p = np.atleast_1d(np.asarray(start, dtype=np.float64))
    labels = tuple(names) if names is not None else tuple(f"p{k}" for k in range(len(p)))
    if len(labels) != len(p):
        raise SceneError(f"fit_simulation: {len(labels)} names for {len(p)} parameters")
    low, high = (np.broadcast_to(end, p.shape).astype(float) for end in (bounds or (-np.inf, np.inf)))
    runs = _Runs(sensitivity, labels, None if log is None else Path(log), report)
    p = np.clip(runs.best_known(p), low, high)
    scales = sensitivity.sizes(p)
    own = bool(sensitivity.loss.own)
    if own or len(p) > _MOST_COLUMNS:
        ends = list(zip(low / scales, high / scales, strict=True))
        options = {"maxfun": max_evaluations, "ftol": tolerance, "gtol": 0.0}
        found: Any = minimize(
            lambda q: runs.gradient(q * scales, scales),
            p / scales,
            jac=True,
            method="L-BFGS-B",
            bounds=ends,
            options=options,
        )
        best = found.x * scales
    else:
        found = least_squares(
            lambda q: runs.residuals(q * scales),
            p / scales,
            jac=lambda q: sensitivity.residuals_and_jacobian(q * scales)[1] * scales,  # pyright: ignore[reportArgumentType]  # SciPy's stubs know its names only
            bounds=(low / scales, high / scales),
            ftol=tolerance,
            xtol=tolerance,
            gtol=1e-15,
            max_nfev=max_evaluations,
        )
        best = found.x * scales
    errors, measured, simulated = _at_end(sensitivity, best, scales, None if own else getattr(found, "jac", None))
    return SimulationFit(labels, best, errors, runs.least, runs.count, str(found.message), measured, simulated)


class _Runs:
    """The runs of a fit, with their log."""

    def __init__(self, of: Sensitivity, names: tuple[str, ...], log: Path | None, report: Any) -> None:
        self.of, self.names, self.log, self.report = of, names, log, report
        self.count, self.least, self.worst = 0, np.inf, 1.0
        self.first: Floats | None = None

    def best_known(self, p: Floats) -> Floats:
        """The parameters (q,) of the best run in the log; p where there is none."""
        if self.log is None or not self.log.exists():
            return p
        text, columns = self.log.read_text(encoding="utf-8"), ["loss", *self.names]
        whole = text[: text.rfind("\n") + 1]  # a killed writer may leave a part of a line
        header, *rows = list(csv.reader(whole.splitlines())) or [columns]
        if header != columns:
            raise SceneError(f"fit_simulation: {self.log} has the columns {', '.join(header)}; give another log")
        if whole != text:
            with whole_file(self.log) as fresh:
                fresh.write_text(whole, encoding="utf-8")
        known = np.array(rows, dtype=np.float64).reshape(-1, len(header))
        known = known[np.isfinite(known[:, 0])]
        if not len(known):
            return p
        best = known[known[:, 0].argmin()]
        self._say(f"{self.log} has {len(rows)} runs; goes on from the best one, with the loss {best[0]:.6g}")
        return best[1:]

    def residuals(self, p: Floats) -> Floats:
        found = self._tried(p, lambda: self.of.residuals(p), lambda r: float(r @ r))
        if self.first is None:
            self.first = found
        return _FAILED * np.asarray(self.first) if found is None else found

    def gradient(self, p: Floats, scales: Floats) -> tuple[float, Floats]:
        found = self._tried(p, lambda: self.of.value_and_gradient(p), lambda both: both[0])
        if found is None:
            return _FAILED * self.worst, np.zeros_like(p)
        self.worst = max(self.worst, abs(found[0]))
        return found[0], found[1] * scales

    def _tried(self, p: Floats, run: Callable[[], Any], loss_of: Callable[[Any], float]) -> Any:
        """What a run gives; None where it fails, but for the first one."""
        try:
            found = run()
        except SuppleError as error:
            if not self.count:
                raise
            self._note(p, np.inf, str(error))
            return None
        self._note(p, loss_of(found))
        return found

    def _note(self, p: Floats, loss: float, why: str = "") -> None:
        self.count += 1
        self.least = min(self.least, loss)
        text = ", ".join(f"{name} {value:.6g}" for name, value in zip(self.names, p, strict=True))
        line = f"run {self.count}: loss {loss:.6g}; {text}" + (f"; {why}" if why else "")
        self._say(line)
        if self.log is not None:
            begins = not self.log.exists() or not self.log.stat().st_size
            with self.log.open("a", encoding="utf-8", newline="") as file:
                rows = csv.writer(file)
                if begins:
                    rows.writerow(["loss", *self.names])
                rows.writerow([repr(loss), *(repr(float(value)) for value in p)])

    def _say(self, line: str) -> None:
        logger.info("%s", line)
        if self.report is not None:
            self.report(line)


def _at_end(of: Sensitivity, p: Floats, scales: Floats, jacobian: Floats | None) -> Any:
    """Standard errors (q,), and what was measured and simulated, by label."""
    errors, residuals = np.full(len(p), np.nan), of.residuals(p)
    measured, simulated = of.loss.readings(residuals, of.steps)
    freedom = sum(len(values) for values in measured.values()) - len(p)
    if jacobian is not None and freedom > 0:
        R = np.linalg.qr(jacobian, mode="r")
        if np.linalg.cond(R) < _SINGULAR:
            spread = float(residuals @ residuals) / freedom
            errors = scales * np.sqrt(spread * (np.linalg.inv(R) ** 2).sum(axis=1))
    return errors, measured, simulated
