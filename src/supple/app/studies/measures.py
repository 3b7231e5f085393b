"""Measures: functions of a recording that return numbers, and those that a study file can name."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from supple.app.studies.factors import Values
from supple.errors import StudyError
from supple.kinds.kind import Kind
from supple.kinds.validators import Choice, Integer, Name
from supple.results.recording.frame import RecordedFrame
from supple.results.recording.reader import Recording

Array = NDArray[np.float64]
MeasureFunction = Callable[[Recording], "float | Mapping[str, float]"]
AXES = ("x", "y", "z")
NUMBERS = {
    "kinetic_energy": "J",
    "elastic_energy": "J",
    "potential_energy": "J",
    "stitch_energy": "J",
    "min_det_F": "",
    "min_distance": "m",
    "largest_stitch_stretch": "",
    "wall_seconds": "s",
}
VECTORS = {"linear_momentum": "kg m/s", "angular_momentum": "kg m^2/s"}
"""Quantities of the whole scene, which every frame reports, and their units."""
OF_BODY: dict[str, tuple[str, Callable[[RecordedFrame, str], Array]]] = {
    "position": ("m", lambda frame, body: frame.positions[body]),
    "displacement": (
        "m",
        lambda frame, body: frame.positions[body] - RecordedFrame(frame.recording, 0).positions[body],
    ),
    "velocity": ("m/s", lambda frame, body: frame.velocities[body]),
}
"""Vectors of the vertices of one body, and their units; displacements are from the first frame."""
OVER: dict[str, Callable[[Array], Any]] = {"min": np.min, "mean": np.mean, "max": np.max, "range": np.ptp}
"""From the numbers of vertices, or of frames, to one."""
IN_TIME = OVER | {"first": lambda numbers: numbers[0], "last": lambda numbers: numbers[-1], "sum": np.sum}


@dataclass(frozen=True)
class Measure(Kind):
    """A number taken from a recording.

    Parameters
    ----------
    quantity : what is measured
    body : whose position, displacement or velocity
    axis : of a vector; default: its length
    vertices : numbers of vertices of the body's mesh; default: all
    over : how the vertices' numbers become one; default: mean
    time : how the frames' numbers become one
    """

    kind: ClassVar[str] = "measure"
    error: ClassVar[type[StudyError]] = StudyError

    quantity: Annotated[str, Choice((*NUMBERS, *VECTORS, *OF_BODY))]
    body: Annotated[str | None, Name()] = None
    axis: Annotated[str | None, Choice((*AXES, "length"))] = None
    vertices: Annotated[tuple[int, ...] | None, Values(Integer())] = None
    over: Annotated[str | None, Choice(tuple(OVER))] = None
    time: Annotated[str, Choice(tuple(IN_TIME))] = "last"

    def __post_init__(self) -> None:
        super().__post_init__()
        if (self.quantity in OF_BODY) != (self.body is not None):
            need = "needs a body" if self.body is None else "is of the whole scene; remove body"
            raise StudyError(f"{self.quantity} {need}")
        unused = {"axis": self.quantity in NUMBERS, "vertices": self.body is None, "over": self.body is None}
        for key, without in unused.items():
            if without and getattr(self, key) is not None:
                raise StudyError(f"{self.quantity} has no {key}; remove it")

    @property
    def unit(self) -> str:
        return OF_BODY[self.quantity][0] if self.body else (NUMBERS | VECTORS)[self.quantity]

    def of(self, recording: Recording) -> float:
        """The number.

        Raises
        ------
        OutputError, StudyError : where the recording has no such body, vertex or quantity.
        """
        numbers = recording.series(self.quantity) if self.body is None else self._of_body(recording, self.body)
        if self.quantity in VECTORS:
            numbers = self._component(numbers)
        numbers = numbers[np.isfinite(numbers)]  # the distance is not known before the first step
        if not len(numbers):
            raise StudyError(f"{self.quantity} is in no frame of this scene")
        return float(IN_TIME[self.time](numbers))

    def _of_body(self, recording: Recording, name: str) -> Array:
        count = len(recording.body(name).body.points)
        if self.vertices is not None and max(self.vertices) >= count:
            raise StudyError(f"{name!r} has {count} vertices; vertex {max(self.vertices)} does not exist")
        rows: Any = slice(None) if self.vertices is None else list(self.vertices)
        vectors = OF_BODY[self.quantity][1]
        ends = {"first": [recording[0]], "last": [recording[-1]]}  # the other frames need not be read
        of_frames = [vectors(frame, name)[rows] for frame in ends.get(self.time, recording)]
        return np.array([OVER[self.over or "mean"](self._component(of_frame)) for of_frame in of_frames])

    def _component(self, vectors: Array) -> Array:
        return vectors[..., AXES.index(self.axis)] if self.axis in AXES else np.linalg.norm(vectors, axis=-1)


@dataclass(frozen=True)
class Measures:
    """Named measures, as one function of a recording."""

    named: Mapping[str, Measure]

    def __call__(self, recording: Recording) -> dict[str, float]:
        return {name: measure.of(recording) for name, measure in self.named.items()}

    @property
    def units(self) -> dict[str, str]:
        return {name: measure.unit for name, measure in self.named.items()}


def measured(recording: Recording, measure: MeasureFunction) -> dict[str, float]:
    """The finite numbers that a measure returns, by name.

    Raises
    ------
    StudyError : where it returns anything else.
    """
    given: Any = measure(recording)
    measures = {}
    for name, value in (given if isinstance(given, Mapping) else {"measure": given}).items():
        number = np.asarray(value)
        if number.shape != () or number.dtype.kind not in "iufb":
            raise StudyError(f"the measure {name!r} is {value!r}; return a number, or numbers by name")
        if not math.isfinite(number):
            raise StudyError(f"the measure {name!r} is {float(number)!r}; it must be finite")
        measures[str(name)] = float(number)
    if not measures:
        raise StudyError("no measure was returned; return a number, or numbers by name")
    return measures
