"""What a recording's file holds. It is checked before it is used."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.errors import OutputError
from supple.materials.elastic_tets.laws import TetLaws
from supple.model.state import Status
from supple.results.readings.fields import FIELDS, Field
from supple.results.recording.actions.actuators import read_actuators
from supple.results.recording.actions.joints import RecordedJoint, read_joints
from supple.results.recording.actions.loads import read_loads
from supple.results.recording.actions.stitches import RecordedStitches, read_stitches
from supple.results.recording.checked_hdf5 import CheckedFile
from supple.results.recording.details import RecordedDetails
from supple.results.recording.file import WRITTEN
from supple.results.recording.laws import read_quadratic, recorded_laws
from supple.results.recording.physics import RecordedPhysics, RecordedWeld, read_physics, read_untouching, read_welds
from supple.results.recording.recorder import INTERNAL, REPORT_NUMBERS, REPORT_VECTORS, field_series, frame_layout
from supple.results.recording.scene import RecordedBody, RecordedObstacle, read_bodies, read_header, read_obstacles
from supple.results.recording.sensors import RecordedSensor, sensors_of_header

_MESSAGE = "supple/frames/message"
_READ_BY_FRAME = ("VTKHDF/Points", "VTKHDF/PointData/velocities", "VTKHDF/CellData/det_F", "supple/frames/poses")


class RecordedContents:
    """The arrays and records of a recording's file; see `Recording` for its attributes."""

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self._file = CheckedFile(self.path)
        try:
            self._read()
        except (OutputError, OSError, RuntimeError) as error:
            self._file.close()
            if isinstance(error, OutputError):
                raise
            raise self._file.broken(str(error)) from None

    def _read(self) -> None:
        file = self._file
        header = read_header(file)
        self._read_series: dict[str, NDArray[Any]] = {}
        self.details = RecordedDetails.from_header(file, header)
        self.rest_positions = file.array("supple/rest_positions", "f", (None, 3))
        n = len(self.rest_positions)
        self.tets = file.indices("supple/tets", 4, n)
        m = len(self.tets)
        self.quadratic = read_quadratic(file, self.tets, n)
        self.triangles = file.indices("supple/triangles", 3, n)
        self.rest_volumes = file.array("supple/rest_volumes", "f", (m,))
        self.masses = file.array("supple/masses", "f", (n,))
        self.gravity = file.array("supple/gravity", "f", (3,))
        self.pinned_vertices = file.array("supple/pinned_vertices", "i", (None,))
        self.bodies: tuple[RecordedBody, ...] = read_bodies(file, header, n, m, self.triangles)
        self.obstacles: tuple[RecordedObstacle, ...] = read_obstacles(file, header)
        curved = np.zeros(m, dtype=bool)
        if self.quadratic is not None:
            curved[self.quadratic[0]] = True
        self.physics: RecordedPhysics = read_physics(file, header, curved)
        self.untouching = read_untouching(file, header)
        self.welds: tuple[RecordedWeld, ...] = read_welds(file, header, n)
        self.joints: tuple[RecordedJoint, ...] = read_joints(file, header)
        self.loads, self.other_loads = read_loads(file, header, n)
        self.cavities, self.cables = read_actuators(file, header, n)
        self.stitches: RecordedStitches = read_stitches(file, n, len(self.obstacles))
        self.dt = float(header["dt"])
        self.solver: str | None = header.get("solver")
        self.supple_version = str(header.get("supple_version", ""))
        self.scene_text = file.text("supple/scene") if "supple/scene" in file else None
        self._count = int(file.array(WRITTEN, "i", ()))
        if self._count < 1:
            raise file.broken(f"its number of frames is {self._count}")
        self.fields: tuple[Field, ...] = _recorded_fields(file, header)
        self.sensors: tuple[RecordedSensor, ...] = sensors_of_header(file, header)
        flowing = self.internal_rows
        layout = frame_layout(n, m, len(self.obstacles), self.details, self.fields, self.sensors, flowing)
        self._series = {series.path: series for series in layout.series}
        own = [field_series(field, n, m).path for field in self.fields]
        others = [_MESSAGE] + [INTERNAL] * (flowing > 0)
        for path in (*_READ_BY_FRAME, *own, *others):
            file.check_series(self._series[path], self._count)
        self.times: NDArray[np.float64] = self._values("supple/frames/time")
        if not np.isfinite(self.times).all():
            raise file.broken("a frame's time is not finite")
        codes = self._values("supple/frames/status")
        names = header["statuses"]
        if codes.max() >= len(names) or not set(names) <= {str(status) for status in Status}:
            raise file.of_another_version("a frame has an unknown status")
        self.statuses: tuple[Status, ...] = tuple(Status(names[code]) for code in codes)

    @cached_property
    def laws(self) -> TetLaws:
        """The elastic laws of all tets."""
        of_tets = self.rest_positions, self.tets, self.rest_volumes
        return recorded_laws(self.physics, self.bodies, *of_tets, self.quadratic)

    def nodes_of(self, body: RecordedBody) -> NDArray[np.int32]:
        """(m, 4) or (m, 10) nodes of a body's tets, rows of all vertices."""
        if self.quadratic is not None:
            rows, nodes = self.quadratic
            begin, end = np.searchsorted(rows, [body.tets.start, body.tets.stop])
            if end > begin:
                return nodes[begin:end]
        return self.tets[body.tets]

    @property
    def internal_rows(self) -> int:
        """How many rows of internal variables a frame has."""
        return self.physics.internal

    def body(self, name: str) -> RecordedBody:
        """The body of that name.

        Raises
        ------
        OutputError : where there is none.
        """
        for body in self.bodies:
            if body.name == name:
                return body
        raise OutputError(f"{self.path}: there is no body {name!r}; it has {', '.join(b.name for b in self.bodies)}")

    def series(self, name: str) -> NDArray[np.float64]:
        """A number (frames,) or vector (frames, 3) of the reports over time, such as "kinetic_energy"."""
        known = REPORT_NUMBERS + REPORT_VECTORS
        if name not in known:
            raise OutputError(f"{self.path}: there is no series {name!r}; take one of {', '.join(known)}")
        return self._values(f"supple/frames/{name}")

    @property
    def messages(self) -> list[str]:
        """The messages of all frames' reports."""
        return self._messages(0, self._count)

    def frame_values(self, name: str) -> NDArray[Any]:
        """All frames' values of a series of the group `supple/frames`, such as "index" or "details/contacts"."""
        return self._values(f"supple/frames/{name}")

    def close(self) -> None:
        """Close the file; frames that were not read before can then not be read."""
        self._file.close()

    def _values(self, path: str) -> NDArray[Any]:
        """All frames' rows of a series; read once."""
        if path not in self._read_series:
            self._read_series[path] = self._file.rows(self._series[path], 0, self._count, path)
        return self._read_series[path]

    def _messages(self, begin: int, end: int) -> list[str]:
        rows = self._file.rows(self._series[_MESSAGE], begin, end, "messages")
        return [row.tobytes().rstrip(b"\0").decode(errors="replace") for row in rows.reshape(end - begin, -1)]

    def _frame_rows(self, path: str, number: int) -> NDArray[Any]:
        block = self._file.rows(self._series[path], number, number + 1, f"frame {number}")
        return block[0] if path == "supple/frames/poses" else block


def _recorded_fields(file: CheckedFile, header: dict[str, Any]) -> tuple[Field, ...]:
    names = header.get("fields")
    if not isinstance(names, list):
        raise file.broken("its header does not list its fields")
    if not set(map(str, names)) <= FIELDS.keys():
        raise file.of_another_version("it has an unknown field")
    return tuple(FIELDS[name] for name in names)
