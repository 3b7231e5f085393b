"""Measures that a study file can name: numbers taken from a recording."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.errors import StudyError
from supple.results.recording.frame import RecordedFrame
from supple.results.recording.reader import Recording

AXES = ("x", "y", "z")

SERIES = {
    "kinetic_energy": "J",
    "elastic_energy": "J",
    "potential_energy": "J",
    "stitch_energy": "J",
    "min_det_F": "",
    "min_distance": "m",
    "largest_stitch_stretch": "",
    "linear_momentum": "kg m/s",
    "angular_momentum": "kg m^2/s",
    "wall_seconds": "s",
}
"""Quantities of the whole scene, which every frame reports, and their units."""

_VECTORS = ("linear_momentum", "angular_momentum")


def _displacements(frame: RecordedFrame, body: str) -> NDArray[np.float64]:
    return frame.positions[body] - RecordedFrame(frame.recording, 0).positions[body]


BODY_QUANTITIES: dict[str, tuple[str, Callable[[RecordedFrame, str], NDArray[np.float64]]]] = {
    "position": ("m", lambda frame, body: frame.positions[body]),
    "displacement": ("m", _displacements),
    "velocity": ("m/s", lambda frame, body: frame.velocities[body]),
}
"""Vectors of the vertices of one body, and their units; displacements are from the first frame."""

OVER: dict[str, Callable[[NDArray[np.float64]], Any]] = {
    "min": np.min,
    "mean": np.mean,
    "max": np.max,
    "range": np.ptp,
}
"""From the numbers of vertices, or of frames, to one."""

IN_TIME: dict[str, Callable[[NDArray[np.float64]], Any]] = {
    **OVER,
    "first": lambda numbers: numbers[0],
    "last": lambda numbers: numbers[-1],
    "sum": np.sum,
}


@dataclass(frozen=True)
class SeriesMeasure:
    """A number of the whole scene in time.

    Attributes
    ----------
    quantity : one of `SERIES`
    axis : of a vector: "x", "y", "z" or "length"; None for numbers
    time : one of `IN_TIME`
    """

    quantity: str
    axis: str | None = None
    time: str = "last"

    @property
    def unit(self) -> str:
        return SERIES[self.quantity]

    def of(self, recording: Recording) -> float:
        """The number.

        Raises
        ------
        StudyError : where the scene has no such quantity, or an axis is missing.
        """
        values = recording.series(self.quantity)
        if (self.quantity in _VECTORS) != (self.axis is not None):
            raise StudyError(f"{self.quantity}: " + ("give an axis" if self.axis is None else "has no axis; remove it"))
        numbers = values if self.axis is None else _component(values, self.axis)
        numbers = numbers[np.isfinite(numbers)]  # the distance is not known before the first step
        if not len(numbers):
            raise StudyError(f"{self.quantity} is in no frame of this scene")
        return float(IN_TIME[self.time](numbers))


@dataclass(frozen=True)
class BodyMeasure:
    """A number of one body in time.

    Attributes
    ----------
    quantity : one of `BODY_QUANTITIES`; body : its name
    axis : "x", "y", "z" or "length"
    vertices : numbers of vertices of the body's mesh; None for all
    over : how the vertices' numbers become one, of `OVER`; time : how the frames' do, of `IN_TIME`
    """

    quantity: str
    body: str
    axis: str = "length"
    vertices: tuple[int, ...] | None = None
    over: str = "mean"
    time: str = "last"

    @property
    def unit(self) -> str:
        return BODY_QUANTITIES[self.quantity][0]

    def of(self, recording: Recording) -> float:
        """The number.

        Raises
        ------
        OutputError, StudyError : where no such body exists, or no such vertex.
        """
        body = recording.body(self.body)
        count = body.point_count
        rows: Any = slice(None) if self.vertices is None else list(self.vertices)
        if self.vertices is not None and max(self.vertices) >= count:
            raise StudyError(f"{self.body!r} has {count} vertices; vertex {max(self.vertices)} does not exist")
        vectors = BODY_QUANTITIES[self.quantity][1]
        ends = {"first": [recording[0]], "last": [recording[-1]]}  # the other frames need not be read
        numbers = [
            OVER[self.over](_component(vectors(frame, self.body)[rows], self.axis))
            for frame in ends.get(self.time, recording)
        ]
        return float(IN_TIME[self.time](np.array(numbers)))


@dataclass(frozen=True)
class Measures:
    """Named measures, as one function of a recording."""

    named: Mapping[str, SeriesMeasure | BodyMeasure]

    def __call__(self, recording: Recording) -> dict[str, float]:
        return {name: measure.of(recording) for name, measure in self.named.items()}

    @property
    def units(self) -> dict[str, str]:
        return {name: measure.unit for name, measure in self.named.items()}


def _component(vectors: NDArray[np.float64], axis: str) -> NDArray[np.float64]:
    return np.linalg.norm(vectors, axis=-1) if axis == "length" else vectors[..., AXES.index(axis)]
