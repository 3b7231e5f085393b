"""What a recording's file holds. It is checked before it is used."""

from __future__ import annotations

from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.errors import OutputError
from supple.materials.elastic_tets.laws import joined_materials, tet_material
from supple.materials.laws.internal import count_of
from supple.model.state import Status
from supple.model.system import System, build_system
from supple.results.readings.fields import FIELDS, Field
from supple.results.recording.checked_hdf5 import CheckedFile
from supple.results.recording.description import Description, read_description
from supple.results.recording.details import recorded_sensors
from supple.results.recording.file import WRITTEN
from supple.results.recording.functions import RecordedFunction
from supple.results.recording.recorder import (
    BROKEN_STITCHES,
    INTERNAL,
    REPORT_NUMBERS,
    REPORT_VECTORS,
    field_series,
    frame_layout,
)
from supple.results.recording.thin_cells import ThinCells
from supple.scene.joints.placed import PlacedJoint, placed_joints
from supple.scene.obstacles.obstacle import Obstacle
from supple.scene.rows import BodyRows, rows_of
from supple.scene.stitches.measures import StitchEnds

_MESSAGE = "supple/frames/message"
_READ_BY_FRAME = ("VTKHDF/Points", "VTKHDF/PointData/velocities", "VTKHDF/CellData/det_F", "supple/frames/poses")


class RecordedContents(Description):
    """The arrays and records of a recording's file; see `Recording` for its attributes."""

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self._file = CheckedFile(self.path)
        self._read_series: dict[str, NDArray[Any]] = {}
        try:
            super().__init__(**vars(read_description(self._file, partial(RecordedFunction, self))))
            self._open_series()
        except (OutputError, OSError, RuntimeError) as error:
            self._file.close()
            if isinstance(error, OutputError):
                raise
            raise self._file.broken(str(error)) from None

    def _open_series(self) -> None:
        file = self._file
        self.bodies, self.sensors = rows_of(self.scene.bodies), recorded_sensors(self.scene)
        materials = [tet_material(b.material, len(b.mesh.tets), b.mesh.order) for b in self.scene.bodies]
        self.internal_rows = flowing = count_of(joined_materials(materials))
        self._count = int(file.array(WRITTEN))
        if self._count < 1:
            raise file.broken(f"its number of frames is {self._count}")
        if not set(self.field_names) <= FIELDS.keys():
            raise file.of_another_version("it has an unknown field")
        self.fields: tuple[Field, ...] = tuple(FIELDS[name] for name in self.field_names)
        n, m, names = self.bodies[-1].vertices.stop, self.bodies[-1].tets.stop, self.scene.stitching.names
        breakable = len(names) if names.breakable else 0
        given = self.details, self.fields, self.sensors, flowing, breakable, self.functions
        cells = m + len(ThinCells(self.bodies).owners)
        self.layout = frame_layout(n, cells, len(self.obstacles), *given)
        self._series = {series.path: series for series in self.layout.series}
        own = [field_series(field, 0, 0).path for field in self.fields]
        more = [*([INTERNAL] if flowing else []), *([BROKEN_STITCHES] if breakable else [])]
        for path in (*_READ_BY_FRAME, *own, _MESSAGE, *more):
            file.check_series(self._series[path], self._count)
        self.times: NDArray[np.float64] = self._values("supple/frames/time")
        if not np.isfinite(self.times).all():
            raise file.broken("a frame's time is not finite")
        codes = self._values("supple/frames/status")
        if codes.max() >= len(self.statuses_of_codes):
            raise file.of_another_version("a frame has an unknown status")
        self.statuses: tuple[Status, ...] = tuple(Status(self.statuses_of_codes[code]) for code in codes)

    @property
    def unfinished(self) -> str:
        """How the recording ends before the last frame that was asked for; "" where it has all frames."""
        last, wanted, status = self._count - 1, self.steps, self.statuses[-1]
        if not status.can_go_on:
            return f"the solver stopped at frame {last} of {wanted} ({status})"
        return f"it ends at frame {last} of {wanted}" if last < wanted else ""

    @property
    def obstacles(self) -> tuple[Obstacle, ...]:
        return tuple(self.scene.obstacles)

    @property
    def gravity(self) -> NDArray[np.float64]:
        return np.asarray(self.scene.gravity, dtype=np.float64)

    @cached_property
    def system(self) -> System:
        """The scene as flat arrays."""
        return build_system(self.scene)

    @property
    def rest_positions(self) -> NDArray[np.float64]:
        return self.system.rest_positions

    @property
    def masses(self) -> NDArray[np.float64]:
        return self.system.masses

    @property
    def tets(self) -> NDArray[np.int32]:
        return self.system.tets

    @property
    def rest_volumes(self) -> NDArray[np.float64]:
        return self.system.rest_volumes

    @cached_property
    def triangles(self) -> NDArray[np.int32]:
        """(t, 3) boundaries of all bodies."""
        return np.concatenate([body.boundary + np.int32(body.vertices.start) for body in self.bodies])

    @cached_property
    def stitches(self) -> StitchEnds:
        return StitchEnds.of(self.scene.stitching, self.scene.bodies)

    @cached_property
    def joints(self) -> tuple[PlacedJoint, ...]:
        return placed_joints(self.scene.bodies, self.scene.joints, self.scene.obstacles)

    def body(self, name: str) -> BodyRows:
        """The body of that name.

        Raises
        ------
        OutputError : where none exists.
        """
        for body in self.bodies:
            if body.name == name:
                return body
        raise OutputError(f"{self.path}: body {name!r} does not exist; it has {', '.join(b.name for b in self.bodies)}")

    def series(self, name: str) -> NDArray[np.float64]:
        """A number (frames,) or vector (frames, 3) of the reports over time, such as "kinetic_energy"."""
        known = REPORT_NUMBERS + REPORT_VECTORS
        if name not in known:
            raise OutputError(f"{self.path}: series {name!r} does not exist; take one of {', '.join(known)}")
        return self._values(f"supple/frames/{name}")

    @property
    def messages(self) -> list[str]:
        """The messages of all frames' reports."""
        return self._messages(0, self._count)

    def frame_values(self, name: str) -> NDArray[Any]:
        """All frames' values of a series of the group `supple/frames`, such as "index" or "details/contacts"."""
        return self._values(f"supple/frames/{name}")

    def largest(self, name: str) -> float:
        """The largest number of a series as of `frame_values`; NaN where the solver has none."""
        values = self.frame_values(name) if f"supple/frames/{name}" in self._series else np.zeros(0)
        return float(np.max(values[np.isfinite(values)], initial=-np.inf)) if np.isfinite(values).any() else np.nan

    def close(self) -> None:
        """Close the file; frames that were not read before can then not be read."""
        self._file.close()

    def broken_stitches(self, number: int, separated: bool = False) -> NDArray[np.int64]:
        """(b,) numbers of the pairs of stitches that have broken until a frame, or also separated; see `State`."""
        if BROKEN_STITCHES not in self._series:
            return np.zeros(0, dtype=np.int64)
        return np.flatnonzero(self._values(BROKEN_STITCHES)[number] > separated)

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
