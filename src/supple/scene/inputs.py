"""Values that a program sets from frame to frame: motions and forces that are decided while the simulation runs.

An input is a function of time, as scripts are, so that solvers need not know of it. Before each frame the loop gives it
the value at the frame's beginning, which is in the State, and the one that is wanted at its end.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import SceneError
from supple.kinds.checks import check_name, float_array


@dataclass(frozen=True, eq=False)
class Ramp:
    """The values of an input in one frame: `first` at the time `begin` [s], and `last` at `end`."""

    begin: float
    end: float
    first: NDArray[np.float64]
    last: NDArray[np.float64]

    def straight(self, time: float) -> NDArray[np.float64]:
        """The value at `time` [s] on the straight path from the first to the last."""
        if time >= self.end:
            return self.last
        if time <= self.begin:
            return self.first
        share = (time - self.begin) / (self.end - self.begin)
        return (1.0 - share) * self.first + share * self.last


class Input(ABC):
    """A function of time whose values are set while the simulation runs.

    A scene that has inputs may be simulated by one thread at a time.

    Parameters
    ----------
    name : by which `simulate` sets it; no two inputs of a scene have the same
    value : at the start, in the unit of the kind; (3,), or (k, 3) with a row for each vertex

    Attributes
    ----------
    ramp : the values in the current frame; a new object for each frame

    Raises
    ------
    SceneError : where the value has another shape, or is not finite.
    """

    def __init__(self, name: str, value: ArrayLike = (0.0, 0.0, 0.0)) -> None:
        check_name(name, "input")
        self.name = name
        self.value = self._array(value)
        self.value.flags.writeable = False
        self.ramp = Ramp(0.0, 0.0, self.value, self.value)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.name!r}, {self.value.tolist()})"

    @abstractmethod
    def __call__(self, time: float) -> NDArray[np.float64]:
        """The value at `time` [s]."""

    def checked(self, value: ArrayLike) -> NDArray[np.float64]:
        """A value that may be set, as an array of the input's shape.

        Raises
        ------
        SceneError : where it has another shape, or is not finite.
        """
        array = self._array(value)
        if array.shape != self.value.shape:
            raise SceneError(f"input {self.name!r} is set to an array of shape {array.shape}; give {self.value.shape}")
        return array

    def _array(self, value: ArrayLike) -> NDArray[np.float64]:
        array = float_array(value, f"input {self.name!r}")
        if array.shape != (3,) and (array.ndim != 2 or array.shape[1] != 3):
            raise SceneError(f"input {self.name!r} has shape {array.shape}; give (3,), or (k, 3) for k vertices")
        if not np.isfinite(array).all():
            raise SceneError(f"input {self.name!r} is not finite")
        return array


class MotionInput(Input):
    """A displacement [m] that goes straight from its value to the next one within a frame: for pins, soft targets and
    obstacles; see `Input`.
    """

    def __call__(self, time: float) -> NDArray[np.float64]:
        return self.ramp.straight(time)


class MotorInput(Input):
    """A target or an effort of motors, one number: positions go straight to the next one within a frame; see `Input`.

    Parameters
    ----------
    name : by which it is set; value : at the start [rad], [m], [rad/s], [m/s], [N m] or [N]
    """

    def __init__(self, name: str, value: float = 0.0) -> None:
        super().__init__(name, value)

    def __call__(self, time: float) -> NDArray[np.float64]:
        return self.ramp.straight(time)

    def _array(self, value: ArrayLike) -> NDArray[np.float64]:
        array = float_array(value, f"input {self.name!r}")
        if array.shape != () or not np.isfinite(array):
            raise SceneError(f"input {self.name!r} is {np.asarray(value).tolist()}; give one finite number")
        return array


class ForceInput(Input):
    """A force [N] that has one value within a frame; see `Input`."""

    def __call__(self, time: float) -> NDArray[np.float64]:
        return self.ramp.last if time > self.ramp.begin else self.ramp.first


def is_steady(value: object) -> bool:
    """Whether a force, or another value over time, has one value within a frame."""
    return isinstance(value, ForceInput) or not callable(value)


def inputs_among(functions: Iterable[object]) -> dict[str, Input]:
    """The inputs among motions and forces, by name.

    Raises
    ------
    SceneError : where two of them have the same name.
    """
    found: dict[str, Input] = {}
    for value in functions:
        if isinstance(value, Input) and found.setdefault(value.name, value) is not value:
            raise SceneError(f"there are two inputs {value.name!r}; give each a name, or use one for all")
    return found


def checked_values(inputs: Mapping[str, Input], values: object) -> dict[str, NDArray[np.float64]]:
    """Values to set, by name; None: no value.

    Raises
    ------
    SceneError : where they are not a mapping, no such input exists, or a value does not suit it.
    """
    if values is None:
        return {}
    if not isinstance(values, Mapping):
        raise SceneError(f"inputs are set by {values!r}; give a mapping from their names to values")
    for name in values:
        if name not in inputs:
            known = ", ".join(map(repr, sorted(inputs))) or "none"
            raise SceneError(f"input {name!r} does not exist; there are: {known}")
    return {name: inputs[name].checked(value) for name, value in values.items()}


def hold_inputs(inputs: Mapping[str, Input], values: Mapping[str, NDArray[np.float64]], time: float) -> None:
    """Let inputs have constant values."""
    for name, value in values.items():
        inputs[name].ramp = Ramp(time, time, value, value)


def drive_inputs(
    inputs: Mapping[str, Input],
    values: Mapping[str, NDArray[np.float64]],
    wanted: Mapping[str, NDArray[np.float64]],
    begin: float,
    end: float,
) -> None:
    """Let inputs go from `values` at the time `begin` [s] to those that are `wanted` at `end`."""
    for name, value in values.items():
        inputs[name].ramp = Ramp(begin, end, value, wanted[name])
