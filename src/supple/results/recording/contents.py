"""What a recording's file holds. It is checked before it is used."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.errors import OutputError
from supple.materials.elastic_tets.edge_springs import EdgeSprings
from supple.materials.elastic_tets.laws import TetLaws
from supple.materials.elastic_tets.quadratic import QuadraticTets
from supple.materials.per_tet import TetMaterial
from supple.model.state import Status
from supple.results.readings.fields import FIELDS, Field
from supple.results.recording.checked_hdf5 import CheckedFile
from supple.results.recording.file import WRITTEN
from supple.results.recording.physics import RecordedPhysics
from supple.results.recording.recorder import (
    BROKEN_STITCHES,
    INTERNAL,
    REPORT_NUMBERS,
    REPORT_VECTORS,
    field_series,
    frame_layout,
)
from supple.results.recording.scene import RecordedBody, RecordedScene, read_scene


def recorded_laws(
    physics: RecordedPhysics,
    bodies: Sequence[RecordedBody],
    rest_positions: NDArray[np.float64],
    tets: NDArray[np.int32],
    volumes: NDArray[np.float64],
    quadratic: tuple[NDArray[np.int32], NDArray[np.int32]] | None = None,
) -> TetLaws:
    """The laws of `tets` (m, 4).

    Density and damping are not recorded: they are NaN.

    Parameters
    ----------
    rest_positions : (n, 3) [m]; volumes : (m,) at rest [m^3]
    quadratic : rows (k,) and nodes (k, 10) of the quadratic tets, or None
    """
    curved = None
    if quadratic is not None:
        curved = QuadraticTets.of(quadratic[0].astype(np.int64), quadratic[1], rest_positions)
    m = len(tets)
    corners = rest_positions[tets]
    a, b, c = (corners[:, k] - corners[:, 0] for k in (1, 2, 3))
    with np.errstate(all="ignore"):
        Dm_inv = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=1) / (6.0 * volumes)[:, None, None]
    tets, unknown = np.ascontiguousarray(tets, dtype=np.int32), np.full(m, np.nan)
    kind = physics.tet_kinds
    material = TetMaterial(unknown, unknown, kind, physics.mu, physics.lam, physics.laws)
    springs = [
        EdgeSprings.of(pair, body.tets, rest_positions, tets[body.tets], volumes[body.tets])
        for body, pair in zip(bodies, physics.compliances, strict=True)
        if pair is not None
    ]
    return TetLaws(tets, Dm_inv, volumes, material, tuple(springs), curved)


_MESSAGE = "supple/frames/message"
_READ_BY_FRAME = ("VTKHDF/Points", "VTKHDF/PointData/velocities", "VTKHDF/CellData/det_F", "supple/frames/poses")


class RecordedContents(RecordedScene):
    """The arrays and records of a recording's file; see `Recording` for its attributes."""

    # All that a check may need; its messages number vertices, tets and triangles within bodies.
    knows = frozenset({"recording", "tets", "times", "masses", "gravity", "material", "free"})
    file_numbers: Mapping[str, NDArray[np.int64]] | None = None
    notes: tuple[str, ...] = ()

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self._file = CheckedFile(self.path)
        self._read_series: dict[str, NDArray[Any]] = {}
        try:
            super().__init__(**vars(read_scene(self._file)))
            self._open_series()
        except (OutputError, OSError, RuntimeError) as error:
            self._file.close()
            if isinstance(error, OutputError):
                raise
            raise self._file.broken(str(error)) from None

    def _open_series(self) -> None:
        file, flowing = self._file, self.internal_rows
        self._count = int(file.array(WRITTEN))
        if self._count < 1:
            raise file.broken(f"its number of frames is {self._count}")
        if not set(self.field_names) <= FIELDS.keys():
            raise file.of_another_version("it has an unknown field")
        self.fields: tuple[Field, ...] = tuple(FIELDS[name] for name in self.field_names)
        n, m = len(self.rest_positions), len(self.tets)
        breakable = len(self.stitches) if self.stitches.names.breakable else 0
        layout = frame_layout(n, m, len(self.obstacles), self.details, self.fields, self.sensors, flowing, breakable)
        self._series = {series.path: series for series in layout.series}
        own = [field_series(field, n, m).path for field in self.fields]
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

    @cached_property
    def triangles(self) -> NDArray[np.int32]:
        """(t, 3) boundaries of all bodies."""
        return np.concatenate([body.triangles + np.int32(body.vertices.start) for body in self.bodies])

    @cached_property
    def laws(self) -> TetLaws:
        """The elastic laws of all tets."""
        of_tets = self.rest_positions, self.tets, self.rest_volumes
        return recorded_laws(self.physics, self.bodies, *of_tets, self.quadratic)

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

    def broken_stitches(self, number: int, parted: bool = False) -> NDArray[np.int64]:
        """(b,) numbers of the pairs of stitches that have broken until a frame, or also parted; see `State`."""
        if BROKEN_STITCHES not in self._series:
            return np.zeros(0, dtype=np.int64)
        return np.flatnonzero(self._values(BROKEN_STITCHES)[number] > parted)

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
