"""Functions of time of a scene: a recording keeps their values at time 0 and in each frame."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from supple.errors import SceneError
from supple.results.recording.file import Series

Values = Sequence[NDArray[np.float64] | None]


def values_at(functions: Sequence[Callable[..., Any]], time: float) -> tuple[NDArray[np.float64] | None, ...]:
    """The values at `time` [s]; None of a function of more than the time, such as a force per mass."""
    found = []
    for function in functions:
        try:
            found.append(np.array(function(time), dtype=np.float64))
        except Exception:  # whatever a user's function raises
            found.append(None)
    return tuple(found)


def function_series(at_start: Values) -> dict[int, Series]:
    """Where the values of functions are in the file, by their numbers."""
    return {k: _series(k, value.shape) for k, value in enumerate(at_start) if value is not None}


def _series(number: int, shape: tuple[int, ...]) -> Series:
    return Series(f"supple/frames/functions/{number}", 1, shape)


class _Recorded(Protocol):
    functions: Any
    times: Any

    def frame_values(self, name: str) -> NDArray[Any]: ...


class RecordedFunction:
    """A function of time that a recording has: its values, linear between time 0 and the frames."""

    def __init__(self, recording: _Recorded, number: int) -> None:
        self._recording, self._number = recording, number

    def __call__(self, time: float, *_: Any) -> NDArray[np.float64]:
        first = self._recording.functions[self._number]
        if first is None or _:
            raise SceneError("a function of places was not recorded; take the scene that was simulated")
        times, values = self._recording.times, self._recording.frame_values(f"functions/{self._number}")
        k = int(np.searchsorted(times, time, side="right"))
        if k == len(times) or (k > 0 and times[k - 1] == time):
            return values[k - 1]
        begin, before = (times[k - 1], values[k - 1]) if k else (0.0, first)
        share = (time - begin) / (times[k] - begin) if times[k] > begin else 1.0
        return (1.0 - share) * before + share * values[k]
