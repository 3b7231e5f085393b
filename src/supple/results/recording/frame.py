"""One frame of a recording, read when it is asked for."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.errors import OutputError
from supple.materials.laws.internal import NEVER_FLOWED
from supple.model.state import State
from supple.model.system import System
from supple.results.frame import Report
from supple.results.readings.by_body import ByBody
from supple.results.readings.fields import checked_fields
from supple.results.readings.reading import Reading
from supple.results.readings.tet_readings import TetReadings
from supple.results.recording.contents import RecordedContents
from supple.results.recording.recorder import INTERNAL, REPORT_NUMBERS, REPORT_VECTORS, field_series


@dataclass(frozen=True, eq=False, repr=False)
class RecordedFrame(TetReadings):
    """One frame, read when it is asked for. Names are those of `supple.Frame`; see also `TetReadings`.

    `simulate(..., start=recording[-1])` continues from a frame, with either solver.
    """

    recording: RecordedContents
    number: int

    @property
    def index(self) -> int:
        """Number of steps since the start."""
        return int(self.recording._values("supple/frames/index")[self.number])

    @property
    def time(self) -> float:
        """[s]"""
        return float(self.recording.times[self.number])

    @cached_property
    def state(self) -> State:
        """All vertices, in the order of the bodies."""
        internal = self._rows(INTERNAL) if self.recording.internal_rows else NEVER_FLOWED
        vertices = self._rows("VTKHDF/Points"), self._rows("VTKHDF/PointData/velocities")
        measures = {str(joint.name): joint.conditions().coordinate for joint in self.recording.scene.joints}
        joints = {name for name, measure in measures.items() if measure is not None and measure.form == "angle"}
        known = self.report.joints.items()
        angles = {name: one.coordinate for name, one in known if name in joints and one.coordinate is not None}
        broken, separated = (
            self.recording.broken_stitches(self.number, separated=separated) for separated in (False, True)
        )
        more = {"hinge_angles": angles, "broken_stitches": broken, "separated_stitches": separated}
        return State(self.time, *vertices, internal=internal, **more)

    @property
    def system(self) -> System:
        """The scene as flat arrays."""
        return self.recording.system

    @cached_property
    def det_F(self) -> NDArray[np.float64]:
        """(m,) J of every tet, in the order of the bodies."""
        return self._rows("VTKHDF/CellData/det_F")[: self.recording.bodies[-1].tets.stop]

    @cached_property
    def obstacle_poses(self) -> NDArray[np.float64]:
        """(obstacles, 3, 4) rotation and translation of each obstacle from its place at time 0 to this frame."""
        return self._rows("supple/frames/poses")

    @property
    def contact_force(self) -> ByBody:
        """By body name, (n, 3) [N], in single precision; an error where the field was not recorded."""
        return self.field("contact_force")

    @property
    def contact_pressure(self) -> ByBody:
        """By body name, (n,) [Pa], in single precision; an error where the field was not recorded."""
        return self.field("contact_pressure")

    def field(self, name: str) -> ByBody:
        """A recorded field by body name, in single precision; NaN where a body has no such values.

        Raises
        ------
        OutputError : where no such field exists, or it was not recorded.
        """
        checked_fields([name])
        for field in self.recording.fields:
            if field.name == name:
                path = field_series(field, 0, 0).path
                values = self._rows(path).reshape(-1, *field.shape).astype(np.float64)
                bodies = self.recording.bodies
                values = values[: bodies[-1].tets.stop] if field.at == "tets" else values
                rows = {body.name: body.tets if field.at == "tets" else body.vertices for body in bodies}
                rigid = [body.name for body in bodies if body.rigid]
                return ByBody(values, rows, dict.fromkeys(rigid, "is rigid: a recording has no fields of its surface"))
        raise OutputError(f"{self.recording.path}: {name} was not recorded; record it with Recorder(fields=[{name!r}])")

    @cached_property
    def sensors(self) -> dict[str, Reading]:
        """By name, what the sensors felt, then what obstacles and pins did; see `Frame.sensors`."""
        found: dict[str, Reading] = {}
        for sensor in self.recording.sensors:
            numbers = self.recording._values(sensor.series.path)[self.number]
            found[sensor.name] = sensor.reading.of_numbers(numbers)
        return found

    @cached_property
    def report(self) -> Report:
        """How the step ended, and what was measured on its state.

        `details` contains the fields that a recording keeps (see `SolverDetails`); `message` is cut after 512 bytes.
        """
        values = {name: float(self.recording.series(name)[self.number]) for name in REPORT_NUMBERS}
        vectors = {name: self.recording.series(name)[self.number] for name in REPORT_VECTORS}
        broken = self.recording.broken_stitches(self.number)
        if self.number > 0:
            broken = np.setdiff1d(broken, self.recording.broken_stitches(self.number - 1))
        distance, stretch = values.pop("min_distance"), values.pop("largest_stitch_stretch")
        return Report(
            **values,
            **vectors,
            status=self.recording.statuses[self.number],
            iterations=int(self.recording._values("supple/frames/iterations")[self.number]),
            min_distance=None if np.isnan(distance) else distance,
            largest_stitch_stretch=None if np.isnan(stretch) else stretch,
            message=self.recording._messages(self.number, self.number + 1)[0],
            details=self.recording.details.of_frame(self.number, self.recording._values),
            broken_stitches=self.recording.scene.stitching.names.named(broken if self.number > 0 else broken[:0]),
        )

    def _rows(self, path: str) -> NDArray[Any]:
        return self.recording._frame_rows(path, self.number)
