"""Reading a recording back, frame by frame, without trusting what the file says of itself."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, overload

import h5py
import numpy as np
from numpy.typing import NDArray

from supple.errors import OutputError
from supple.output.recording.checked_hdf5 import CheckedFile
from supple.output.recording.file import WRITTEN
from supple.output.recording.physics import RecordedPhysics, read_physics, read_untouching
from supple.output.recording.recorder import REPORT_NUMBERS, REPORT_VECTORS
from supple.output.recording.scene import RecordedBody, RecordedObstacle, read_bodies, read_header, read_obstacles
from supple.output.recording.stitches import RecordedStitches, read_stitches
from supple.simulate import Report
from supple.state import State, Status

# Recordings of earlier versions do not have these; what they were is known all the same.
_OF_EARLIER = {"stitch_energy": 0.0, "largest_stitch_stretch": np.nan}


@dataclass(frozen=True, eq=False)
class RecordedFrame:
    """One frame, read when it is asked for. Names are those of `supple.Frame`."""

    recording: Recording
    number: int

    @property
    def index(self) -> int:
        """Number of steps since the start."""
        return int(self.recording._values("index")[self.number])

    @property
    def time(self) -> float:
        """[s]"""
        return float(self.recording.times[self.number])

    @cached_property
    def state(self) -> State:
        """All bodies after each other; `simulate(..., start=frame.state)` goes on from here."""
        return State(self.time, self._rows("VTKHDF/Points"), self._rows("VTKHDF/PointData/velocities"))

    @cached_property
    def positions(self) -> dict[str, NDArray[np.float64]]:
        """By body name, (n, 3) [m]."""
        return {body.name: self.state.positions[body.vertices] for body in self.recording.bodies}

    @cached_property
    def velocities(self) -> dict[str, NDArray[np.float64]]:
        """By body name, (n, 3) [m/s]."""
        return {body.name: self.state.velocities[body.vertices] for body in self.recording.bodies}

    @cached_property
    def det_F(self) -> NDArray[np.float64]:
        """(m,) J of every tet, all bodies after each other."""
        return self._rows("VTKHDF/CellData/det_F")

    @cached_property
    def poses(self) -> NDArray[np.float64]:
        """(obstacles, 3, 4) rotation and translation from where each obstacle is at time 0 to where it is now."""
        return self._rows("supple/frames/poses")

    @cached_property
    def report(self) -> Report:
        """How the step ended, and what was measured on its state."""
        values = {name: float(self.recording.series(name)[self.number]) for name in REPORT_NUMBERS}
        vectors = {name: self.recording.series(name)[self.number] for name in REPORT_VECTORS}
        distance, stretch = values.pop("min_distance"), values.pop("largest_stitch_stretch")
        said = self.recording._text(self.number)
        return Report(
            **values,
            **vectors,
            status=self.recording.statuses[self.number],
            iterations=int(self.recording._values("iterations")[self.number]),
            min_distance=None if np.isnan(distance) else distance,
            largest_stitch_stretch=None if np.isnan(stretch) else stretch,
            message=str(said.get("message", "")),
            details=dict(said.get("details", {})),
        )

    def _rows(self, path: str) -> NDArray[Any]:
        return self.recording._frame_rows(path, self.number)


class Recording(Sequence[RecordedFrame]):
    """A recorded simulation: a sequence of frames. Made by `read_recording`; close it, or use it in a `with` block.

    Attributes
    ----------
    path : of the file; times : (frames,) [s]
    bodies, obstacles : what was simulated, and what it met; stitches : what joined them
    rest_positions : (n, 3) [m]; masses : (n,) [kg]; tets : (m, 4); triangles : (t, 3); rest_volumes : (m,) [m^3]
    gravity : (3,) [m/s^2]; dt : time from frame to frame [s]
    physics : the bodies' laws and what acts on them, or None where an older version wrote the recording
    untouching : what the scene lets touch, or pass through each other
    scene_text : the scene file's text, or None; solver : its description, or None; supple_version : of the writer
    """

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
        self._header = header
        self.rest_positions = file.array("supple/rest_positions", "f", (None, 3))
        n = len(self.rest_positions)
        self.tets = file.indices("supple/tets", 4, n)
        m = len(self.tets)
        self.triangles = file.indices("supple/triangles", 3, n)
        self.rest_volumes = file.array("supple/rest_volumes", "f", (m,))
        self.masses = file.array("supple/masses", "f", (n,))
        self.gravity = file.array("supple/gravity", "f", (3,))
        self.pinned_vertices = file.array("supple/pinned_vertices", "i", (None,))
        self.bodies: tuple[RecordedBody, ...] = read_bodies(file, header, n, m, self.triangles)
        self.obstacles: tuple[RecordedObstacle, ...] = read_obstacles(file, header)
        self.physics: RecordedPhysics | None = read_physics(file, header, m)
        self.untouching = read_untouching(file, header, n, [len(obstacle.vertices) for obstacle in self.obstacles])
        self.stitches: RecordedStitches = read_stitches(file, n, len(self.obstacles))
        self.dt = float(header["dt"])
        self.solver: str | None = header.get("solver")
        self.supple_version = str(header.get("supple_version", ""))
        self.scene_text = file.text("supple/scene") if "supple/scene" in file else None
        self._count = int(file.array(WRITTEN, "i", ()))
        if self._count < 1:
            raise file.broken(f"it says that it holds {self._count} frames")
        for path, rows, shape, kind in (
            ("VTKHDF/Points", n, (3,), "f"),
            ("VTKHDF/PointData/velocities", n, (3,), "f"),
            ("VTKHDF/CellData/det_F", m, (), "f"),
            ("supple/frames/poses", 1, (len(self.obstacles), 3, 4), "f"),
        ):
            file.check_series(path, self._count, rows, shape, kind)
        self.times: NDArray[np.float64] = file.first_rows("supple/frames/time", self._count, (), "f")
        if not np.isfinite(self.times).all():
            raise file.broken("a frame's time is not finite")
        codes = self._values("status")
        names = header["statuses"]
        if codes.max() >= len(names) or not set(names) <= {str(status) for status in Status}:
            raise file.newer("a frame has a status that this version does not know")
        self.statuses: tuple[Status, ...] = tuple(Status(names[code]) for code in codes)

    def __len__(self) -> int:
        return self._count

    @overload
    def __getitem__(self, index: int) -> RecordedFrame: ...

    @overload
    def __getitem__(self, index: slice) -> list[RecordedFrame]: ...

    def __getitem__(self, index: int | slice) -> RecordedFrame | list[RecordedFrame]:
        if isinstance(index, slice):
            return [RecordedFrame(self, i) for i in range(*index.indices(self._count))]
        number = index + self._count if index < 0 else index
        if not 0 <= number < self._count:
            raise IndexError(f"{self.path}: there is no frame {index}; there are {self._count}")
        return RecordedFrame(self, number)

    def __iter__(self) -> Iterator[RecordedFrame]:
        return (RecordedFrame(self, i) for i in range(self._count))

    def __repr__(self) -> str:
        names = ", ".join(body.name for body in self.bodies)
        return f"Recording({str(self.path)!r}: {self._count} frames to {self.times[-1]:g} s of {names})"

    @property
    def frames(self) -> Recording:
        """The frames: the recording itself."""
        return self

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
        if name in REPORT_VECTORS:
            return self._values(name, (3,))
        if name in REPORT_NUMBERS:
            return self._values(name)
        raise OutputError(
            f"{self.path}: there is no series {name!r}; take one of {', '.join(REPORT_NUMBERS + REPORT_VECTORS)}"
        )

    def close(self) -> None:
        """Close the file; frames that were not read yet cannot be read any more."""
        self._file.close()

    def __enter__(self) -> Recording:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _values(self, name: str, shape: tuple[int, ...] = ()) -> NDArray[Any]:
        kept = self.__dict__.setdefault("_kept", {})
        if name not in kept:
            if name in _OF_EARLIER and f"supple/frames/{name}" not in self._file:
                return np.full(self._count, _OF_EARLIER[name])
            kind = {"status": "u", "index": "i", "iterations": "i", "text_end": "i"}.get(name, "f")
            kept[name] = self._file.first_rows(f"supple/frames/{name}", self._count, shape, kind)
        return kept[name]

    def _frame_rows(self, path: str, number: int) -> NDArray[Any]:
        dataset = self._file.dataset(path)
        rows = {"VTKHDF/CellData/det_F": len(self.tets), "supple/frames/poses": 1}.get(path, len(self.rest_positions))
        try:
            block = dataset[number * rows : (number + 1) * rows]
        except (OSError, RuntimeError) as error:
            raise self._file.broken(f"frame {number} cannot be read ({_reason(error)})") from None
        return block[0] if path == "supple/frames/poses" else block

    def _text(self, number: int) -> dict[str, Any]:
        ends = self._values("text_end")
        start, stop = int(ends[number - 1]) if number else 0, int(ends[number])
        heap: h5py.Dataset = self._file.dataset("supple/frames/text")
        row = heap.shape[1] if heap.ndim == 2 else 0
        if not 0 <= start <= stop <= len(heap) * row:
            raise self._file.broken(f"the text of frame {number} lies outside of it")
        if start == stop:
            return {}
        try:
            block = heap[start // row : -(-stop // row)].tobytes()
            said = json.loads(block[start % row : start % row + stop - start])
        except (OSError, RuntimeError, ValueError):
            raise self._file.broken(f"the text of frame {number} is not JSON") from None
        if not isinstance(said, dict):
            raise self._file.broken(f"the text of frame {number} is not a JSON object")
        return said


def _reason(error: Exception) -> str:
    return " ".join(str(error).split())


def read_recording(path: str | Path) -> Recording:
    """Open a recording: of a simulation that ended, was killed, or is running still.

    Frames are read when they are asked for. What was written after the recording was opened is not seen.

    Raises
    ------
    OutputError : where the file is missing, a folder, cut off, of another kind, of a newer version, or contradicts
        itself; the text starts with the path.
    """
    return Recording(path)
