"""Losses: sums of squares of what a run reads less what was measured, with their derivatives."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import csr_array

from supple.errors import SceneError
from supple.gradients.adjoint import ForceAdjoint, no_derivatives
from supple.gradients.quantities import QUANTITIES, force_of, forces_matrix, quantity_of
from supple.gradients.tangent import StateTangent
from supple.kinds.checks import finite_vector
from supple.kinds.suggestion import suggestion
from supple.mesh.checked_arrays import vertex_array
from supple.model.loads.actuators.laws import GivenValue
from supple.model.state import State
from supple.model.system import System
from supple.results.frame import Frame

Floats = NDArray[np.float64]
OwnLoss = Callable[[Frame], "tuple[float, Mapping[str, ArrayLike]] | None"]
OfScene = Callable[[System], float]


@dataclass(eq=False)
class Seeds:
    """Derivatives of a loss by what one frame has: positions x and velocities v (n, 3), and forces; of_scene : by the
    scene, at fixed positions and velocities, as functions of that."""

    x: Floats
    v: Floats
    forces: ForceAdjoint
    of_scene: list[OfScene]


class Misfit:
    """The sum of weight (reading - target)^2 over frames, rows and axes.

    Parameters
    ----------
    quantity : what frames read: "positions" [m] or "velocities" [m/s] of a body's vertices; the "center" of these,
        which is the mean of their positions [m]; the "reaction" of a pin or obstacle, its force on bodies [N]; the
        force of all "contact" on a body [N]; the angle or distance of a "sensor" [rad], [m]; the coordinate of a
        "joint" [rad], [m]; the "volume" or "pressure" of a cavity [m^3], [Pa]; the "length" of a cable [m].
    of : name of the body, obstacle, sensor, joint, cavity or cable, or name or label of the pin, see
        `frame.report.details.reaction_forces`.
    target : what was measured, in the unit of the quantity: a number, or (f,) of every frame; of a center or force
        (3,) or (f, 3); of vertices (k, 3) or (f, k, 3). What is NaN was not measured.
    vertices : (k,) rows of `frame.positions[body]`; None: all.
    points : (k, 3) places in the body's own coordinates instead [m], which move with the tets that are there.
    along : (3,) of a center or force: the direction whose component is read, as a number [-].
    frames : (f,) numbers of frames, from 1; None: the last one, or of a target for f frames the last f.
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
        points: ArrayLike | None = None,
        along: ArrayLike | None = None,
        frames: Sequence[int] | None = None,
        weight: float = 1.0,
    ) -> None:
        if quantity not in QUANTITIES:
            raise SceneError(f"Misfit: quantity {quantity!r} does not exist; {suggestion(quantity, list(QUANTITIES))}")
        self.quantity, self.of, self.weight = quantity, of, float(weight)
        self.vertices = None if vertices is None else np.asarray(vertices, dtype=np.int64)
        self.points = None if points is None else vertex_array(points, f"{self.label}: points")
        self.along = None if along is None else finite_vector(along, f"{self.label}: along")
        values = np.asarray(target, dtype=np.float64)
        one = QUANTITIES[quantity].axes if along is None else 0
        if values.ndim not in (one, one + 1) or (one and values.shape[-1] != 3):
            what = "rows of x, y and z" if one else "a number, or one for each frame"
            raise SceneError(f"{self.label}: target has shape {values.shape}; give {what}")
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
        reading = self.read(frame.system, frame.state, frame)
        if reading.shape != self.target[row].shape:
            raise SceneError(f"{self.label}: the run has {len(reading)} rows, the target {len(self.target[row])}")
        return np.nan_to_num(np.sqrt(self.weight) * (reading - self.target[row]))

    def matrix(self, frame: Frame, row: int, whole: System) -> Any:
        """(r, 3 n) derivatives of `residuals` by what the quantity is a function of.

        whole : the system with obstacles' vertices
        """
        read = quantity_of(self, frame.system).read
        if read is None:
            found = forces_matrix(self, frame.system, whole)
        else:
            found = read(self, frame.system, frame.state).matrix
        found = found if self.along is None else self.along[None] @ found
        known = np.isfinite(np.atleast_1d(self.target[row])).ravel()
        return csr_array((np.sqrt(self.weight) * known)[:, None] * found)

    def add_seeds(self, frame: Frame, row: int, by_residual: Floats, whole: System, seeds: Seeds) -> None:
        """Add the derivatives of a loss with these derivatives by `residuals`."""
        by = quantity_of(self, frame.system).by
        of = seeds if by in ("x", "v") else seeds.forces
        known = getattr(of, by)
        setattr(of, by, known + (self.matrix(frame, row, whole).T @ by_residual.ravel()).reshape(known.shape))
        if self.is_of_scene(frame.system):
            weights, state = np.sqrt(self.weight) * by_residual, frame.state
            seeds.of_scene.append(lambda system: float((weights * self.read(system, state)).sum()))

    def tangents(self, frame: Frame, row: int, whole: System, changes: StateTangent, sides: Any) -> Floats:
        """(r,) the change of `residuals` with those of the end of a step, and with the scene.

        sides : the systems on both sides of a parameter, and the change from one to the other
        """
        matrix = self.matrix(frame, row, whole)
        change = matrix @ getattr(changes, quantity_of(self, frame.system).by).ravel()[: matrix.shape[1]]
        if self.is_of_scene(frame.system):
            above, below, step = sides
            scene = (self.read(above, frame.state) - self.read(below, frame.state)) / step
            change += np.nan_to_num(np.sqrt(self.weight) * (scene + 0.0 * self.target[row])).ravel()
        return change

    def is_of_scene(self, system: System) -> bool:
        """Whether the reading depends on the scene where positions are given, as it does on where points are in rigid
        bodies, on sensors, joints and gases."""
        if self.quantity in ("positions", "velocities", "center") and self.points is None:
            return any(part.rigid for part in system.bodies if part.name == self.of)
        return quantity_of(self, system).read is not None

    def read(self, system: System, state: State, frame: Frame | None = None) -> Floats:
        """What is read of a state; of forces, of the frame."""
        read = quantity_of(self, system).read
        if read is None:
            assert frame is not None
            values = force_of(self, frame)
        else:
            values = read(self, system, state).values
        return values if self.along is None else np.asarray(values @ self.along)


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

    def at(self, frame: Frame, steps: int, whole: System) -> tuple[float, Seeds]:
        """The share of a frame, and its derivatives; whole : the system with obstacles' vertices"""
        system = frame.system
        held = sum(isinstance(one.law, GivenValue) for one in system.actuators)
        zero = no_derivatives(len(system.rest_positions))
        seeds, total = Seeds(zero, zero, ForceAdjoint.zeros(len(whole.rest_positions), held), []), 0.0
        for misfit, row in self.rows(frame.index, steps):
            residuals = misfit.residuals(frame, row)
            total += float((residuals**2).sum())
            misfit.add_seeds(frame, row, 2.0 * residuals, whole, seeds)
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
                # The same as of a misfit of positions with this derivative by its residuals.
                Misfit("positions", name, np.zeros_like(array)).add_seeds(frame, 0, array, whole, seeds)
        return total, seeds
