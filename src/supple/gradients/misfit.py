"""Losses: sums of squares of what a run reads less what was measured, with their derivatives."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import SceneError
from supple.kinds.suggestion import suggestion
from supple.model.pin_reactions import pin_labels
from supple.model.system import PinRange, System
from supple.results.frame import Frame

Floats = NDArray[np.float64]
OwnLoss = Callable[[Frame], "tuple[float, Mapping[str, ArrayLike]] | None"]

_QUANTITIES = ("positions", "velocities", "center", "reaction")


@dataclass(frozen=True, eq=False)
class Seeds:
    """Derivatives (n, 3) of a loss by what one frame has: positions, velocities, and forces of pins on vertices."""

    x: Floats
    v: Floats
    pins: Floats

    @classmethod
    def zeros(cls, n: int) -> Seeds:
        return cls(np.zeros((n, 3)), np.zeros((n, 3)), np.zeros((n, 3)))


class Misfit:
    """The sum of weight (reading - target)^2 over frames, rows and axes.

    Parameters
    ----------
    quantity : "positions" [m] or "velocities" [m/s] of a body's vertices, the "center" of these, which is the mean of
        their positions [m], or the "reaction" of a pin on what it holds [N].
    of : name of the body, or name or label of the pin, see `frame.report.details.reaction_forces`.
    target : what was measured, in the unit of the quantity: (k, 3), or (f, k, 3) of every frame; of a center
        or reaction (3,) or (f, 3). What is NaN was not measured.
    vertices : (k,) rows of `frame.positions[body]`; None: all.
    frames : (f,) numbers of frames, from 1; None: the last one, or with (f, k, 3) the last f.
    weight : factor of a square.

    Raises
    ------
    SceneError : where the quantity does not exist, or an array does not fit.
    """

    def __init__(
        self,
        quantity: str,
        of: str,
        target: ArrayLike,
        *,
        vertices: ArrayLike | None = None,
        frames: Sequence[int] | None = None,
        weight: float = 1.0,
    ) -> None:
        if quantity not in _QUANTITIES:
            raise SceneError(f"Misfit: quantity {quantity!r} does not exist; {suggestion(quantity, _QUANTITIES)}")
        self.quantity, self.of, self.weight = quantity, of, float(weight)
        self.vertices = None if vertices is None else np.asarray(vertices, dtype=np.int64)
        values = np.asarray(target, dtype=np.float64)
        one = 1 if quantity in ("center", "reaction") else 2
        if values.ndim not in (one, one + 1) or values.shape[-1] != 3:
            raise SceneError(f"{self.label}: target has shape {values.shape}; give rows of x, y and z")
        if values.ndim == one:
            values = np.repeat(values[None], 1 if frames is None else len(frames), axis=0)
        if frames is not None and len(frames) != len(values):
            raise SceneError(f"{self.label}: target has {len(values)} frames, and `frames` {len(frames)}")
        self.target = values
        self._given = None if frames is None else [int(k) for k in frames]

    @property
    def label(self) -> str:
        return f"Misfit({self.quantity!r}, {self.of!r})"

    def frames(self, steps: int) -> list[int]:
        """The numbers of the frames, of a run of so many steps."""
        given = list(range(steps + 1 - len(self.target), steps + 1)) if self._given is None else self._given
        if not given or min(given) < 1 or max(given) > steps:
            raise SceneError(
                f"{self.label}: the run has frames 1 to {steps}, and this needs {min(given, default=0)} "
                f"to {max(given, default=0)}"
            )
        return given

    def residuals(self, frame: Frame, row: int) -> Floats:
        """The roots of the weighted squares, with signs, of the target's frame `row`; zero where that is NaN."""
        reading = self._reading(frame)
        if reading.shape != self.target[row].shape:
            raise SceneError(f"{self.label}: the run has {len(reading)} rows, the target {len(self.target[row])}")
        return np.nan_to_num(np.sqrt(self.weight) * (reading - self.target[row]))

    def add_seeds(self, system: System, by_residual: Floats, seeds: Seeds) -> None:
        """Add the derivatives of a loss with these derivatives by `residuals`."""
        values = np.sqrt(self.weight) * by_residual
        if self.quantity == "reaction":
            seeds.pins[self._pin(system)[1].vertices] += values
            return
        if self.quantity == "center":
            count = len(system.split(seeds.x)[self.of]) if self.vertices is None else len(self.vertices)
            values = np.tile(values / count, (count, 1))
        add_of_body(system, self.of, values, self.vertices, seeds.v if self.quantity == "velocities" else seeds.x)

    def tangents(self, system: System, row: int, x: Floats, v: Floats, forces: Floats) -> Floats:
        """The change of `residuals` with changes (n, 3) of positions, velocities, and forces of pins."""
        if self.quantity == "reaction":
            change = forces[self._pin(system)[1].vertices].sum(axis=0)
        else:
            change = system.split(v if self.quantity == "velocities" else x)[self.of]
            change = self._of_rows(change)
        return np.where(np.isnan(self.target[row]), 0.0, np.sqrt(self.weight) * change)

    def _pin(self, system: System) -> tuple[str, PinRange]:
        """The label of the pin that this is about, and its vertices."""
        labels = pin_labels(system)
        for label, pin in zip(labels, system.pins, strict=True):
            if self.of in (label, pin.pin.name):
                return label, pin
        raise SceneError(f"{self.label}: pin {self.of!r} does not exist; {suggestion(self.of, labels)}")

    def _reading(self, frame: Frame) -> Floats:
        if self.quantity == "reaction":
            return frame.report.details.reaction_forces[self._pin(frame.system)[0]]
        state = frame.state
        known = frame.system.split(state.velocities if self.quantity == "velocities" else state.positions)
        return self._of_rows(known[self.of])  # says what exists

    def _of_rows(self, values: Floats) -> Floats:
        """The reading, from the values of all points of the body."""
        if self.vertices is not None:
            if len(self.vertices) and not 0 <= self.vertices.min() <= self.vertices.max() < len(values):
                raise SceneError(f"{self.label}: the body has vertices 0 to {len(values) - 1}")
            values = values[self.vertices]
        return values.mean(axis=0) if self.quantity == "center" else values


def add_of_body(system: System, name: str, values: Floats, rows: NDArray[np.int64] | None, out: Floats) -> None:
    """Add derivatives by the points of a body, all or some `rows`, to those by the vertices `out` (n, 3)."""
    part = next(part for part in system.bodies if part.name == name)
    own = part.points if part.rigid else part.vertices
    all_points = np.arange(own.start, own.stop)
    chosen = all_points if rows is None else all_points[rows]
    if not part.rigid:
        np.add.at(out, chosen, values)
        return
    on_points = np.zeros((len(system.points), 3))
    np.add.at(on_points, chosen, values)
    system.points.add_forces(on_points, out)


@dataclass(frozen=True, eq=False)
class Loss:
    """The sum of several misfits and functions."""

    misfits: tuple[Misfit, ...]
    own: tuple[OwnLoss, ...] = ()

    @classmethod
    def of(cls, given: Any) -> Loss:
        """One or several; raises `SceneError` for what is neither a `Misfit` nor a function."""
        parts = list(given) if isinstance(given, Sequence) else [given]
        for part in parts:
            if not isinstance(part, Misfit) and not callable(part):
                raise SceneError(f"loss: {part!r} is neither a Misfit nor a function of a frame")
        misfits = tuple(part for part in parts if isinstance(part, Misfit))
        return cls(misfits, tuple(part for part in parts if not isinstance(part, Misfit)))

    def rows(self, index: int, steps: int) -> list[tuple[Misfit, int]]:
        """The misfits that frame `index` is part of, and the rows of their targets."""
        numbers = [(misfit, misfit.frames(steps)) for misfit in self.misfits]
        return [(misfit, k) for misfit, given in numbers for k, number in enumerate(given) if number == index]

    def readings(self, residuals: Floats, steps: int) -> tuple[dict[str, Floats], dict[str, Floats]]:
        """What was measured, and what a run with these residuals (r,) read, (k,) by label of the misfit."""
        seen: dict[str, Floats] = {}
        read: dict[str, Floats] = {}
        begin = 0
        for number in range(1, steps + 1):
            for misfit, row in self.rows(number, steps):
                target = misfit.target[row].ravel()
                own = residuals[begin : (begin := begin + len(target))] / np.sqrt(misfit.weight)
                known = np.isfinite(target)
                for values, more in ((seen, target), (read, target + own)):
                    values[misfit.label] = np.append(values.get(misfit.label, np.zeros(0)), more[known])
        return seen, read

    def at(self, frame: Frame, steps: int) -> tuple[float, Seeds]:
        """The share of a frame, and its derivatives."""
        system = frame.system
        seeds, total = Seeds.zeros(len(system.rest_positions)), 0.0
        for misfit, row in self.rows(frame.index, steps):
            residuals = misfit.residuals(frame, row)
            total += float((residuals**2).sum())
            misfit.add_seeds(system, 2.0 * residuals, seeds)
        for loss in self.own:
            given = loss(frame)
            if given is None:
                continue
            value, by_positions = given
            total += float(value)
            for name, values in by_positions.items():
                known = system.split(frame.state.positions)
                array = np.asarray(values, dtype=np.float64)
                if name not in known or array.shape != known[name].shape:
                    shape = known[name].shape if name in known else "a name of a body"
                    raise SceneError(f"loss: its derivative by {name!r} has shape {array.shape}; give {shape}")
                add_of_body(system, name, array, None, seeds.x)
        return total, seeds
