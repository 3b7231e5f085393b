"""A sink that writes every frame to one VTKHDF file, which opens in ParaView and in `read_recording`.

`supple.results.recording.file` describes how the file survives a kill; the tables below list what is in it.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.errors import OutputError
from supple.materials.laws.internal import COLUMNS, count_of
from supple.model.state import Status
from supple.results.frame import Frame
from supple.results.readings.fields import Field, checked_fields, cost
from supple.results.recording.description import Description, described, write_description
from supple.results.recording.details import RecordedDetails, RecordedSensor, recorded_sensors
from supple.results.recording.file import TIMES, Layout, RecordingFile, Series, create, rewrite
from supple.results.recording.functions import Values, function_series, values_at
from supple.results.recording.thin_cells import ThinCells
from supple.runtime.replacing import output_error, parent_folder, put_in_place, remove_abandoned, temporary_name

logger = logging.getLogger(__name__)

SUFFIXES = (".vtkhdf", ".hdf", ".hdf5", ".h5")
REPORT_NUMBERS = (
    "min_det_F",
    "kinetic_energy",
    "elastic_energy",
    "potential_energy",
    "stitch_energy",
    "wall_seconds",
    "min_distance",
    "largest_stitch_stretch",
)
REPORT_VECTORS = ("linear_momentum", "angular_momentum")
INTERNAL = "supple/frames/internal"
BROKEN_STITCHES = "supple/frames/broken_stitches"
MESSAGE_BYTES = 512  # longer messages are cut
# Frames, and bytes of frames, that the file can hold at first; the file grows when more are needed.
_FIRST_FRAMES, _FIRST_ROOM = 1 << 16, 1 << 30


def frame_layout(
    points: int,
    cells: int,
    obstacles: int,
    details: RecordedDetails,
    fields: Sequence[Field] = (),
    sensors: Sequence[RecordedSensor] = (),
    internal: int = 0,
    breakable: int = 0,
    functions: Values = (),
) -> Layout:
    """The series of a recording with these details, chosen fields, sensors, rows of internal variables, pairs of
    stitches that may break, and functions, of which it gets the values at time 0."""
    numbers = (Series(f"supple/frames/{name}", 1) for name in REPORT_NUMBERS)
    vectors = (Series(f"supple/frames/{name}", 1, (3,)) for name in REPORT_VECTORS)
    series = (
        Series("VTKHDF/Points", points, (3,)),
        Series("VTKHDF/PointData/velocities", points, (3,)),
        Series("VTKHDF/CellData/det_F", cells),
        Series(TIMES, 1),
        Series("supple/frames/index", 1, (), "<i8"),
        Series("supple/frames/status", 1, (), "|u1"),
        Series("supple/frames/iterations", 1, (), "<i8"),
        *numbers,
        *vectors,
        Series("supple/frames/poses", 1, (obstacles, 3, 4)),
        Series("supple/frames/message", 1, (MESSAGE_BYTES,), "|u1"),
        *(field.series for field in details.fields),
        *(field_series(field, points, cells) for field in fields),
        *(sensor.series for sensor in sensors),
        *([Series(INTERNAL, internal, (COLUMNS,))] if internal else []),
        *([Series(BROKEN_STITCHES, 1, (breakable,), "|u1")] if breakable else []),
        *function_series(functions).values(),
    )
    return Layout(points, cells, series)


def field_series(field: Field, points: int, cells: int) -> Series:
    """Where a field is: VTK takes tensors as nine numbers."""
    shape = (9,) if field.shape == (3, 3) else field.shape
    group, rows = ("CellData", cells) if field.at == "tets" else ("PointData", points)
    return Series(f"VTKHDF/{group}/{field.name}", rows, shape, "<f4")


class Recorder:
    """Records a simulation: `simulate(scene, solver, dt, steps, sinks=[Recorder("out/recording.vtkhdf")])`.

    The file replaces an older one when it contains the first frame. From then on `read_recording` finds every complete
    frame in it, also while it is being written and when the writer is killed; ParaView does when the simulation has
    ended, and else after `supple resume` or in an export to vtkhdf.

    Parameters
    ----------
    path : of the file, ending in .vtkhdf (or .hdf, .hdf5, .h5). Its folder is made where it is missing.
    scene_text : the scene file's text, kept in the recording.
    solver : a description of the solver, kept in the recording; by default that of the first frame.
    compress : compress the frames when the simulation ends. The file is smaller and takes longer to write.
    fields : names of `supple.results.readings.fields.FIELDS`, such as "von_mises" and "contact_force", that every
        frame has in addition, in single precision. Their cost in bytes is logged when the simulation begins.

    Raises
    ------
    OutputError : from the constructor for an unusable path or field; from `begin` and `write` where the system reports
        an error (no permission, no space), or the file was removed. All complete frames stay readable.
    """

    def __init__(
        self,
        path: str | Path,
        *,
        scene_text: str | None = None,
        solver: object = None,
        compress: bool = False,
        fields: Sequence[str] = (),
    ) -> None:
        self.path = Path(path)
        if self.path.suffix.lower() not in SUFFIXES:
            raise OutputError(f"{self.path}: ParaView needs the suffix of a recording; name it {self.path.name}.vtkhdf")
        if self.path.is_dir():
            raise OutputError(f"{self.path}: is a folder; give the name of a file in it, such as recording.vtkhdf")
        self._scene_text = scene_text
        self._solver = None if solver is None else str(solver)
        self._compress = bool(compress)
        self._fields = checked_fields(fields)
        self._file: RecordingFile | None = None
        self._details = RecordedDetails()
        self._thin = ThinCells(())
        self._wanted = 0
        self._functions: list[Callable[..., Any]] = []
        self._at_start: Values = ()

    def begin(self, first: Frame, dt: float, steps: int) -> None:
        """Create the file, with the frame at the start."""
        from supple import __version__

        system = first.system
        layout = self._layout(first)
        description = Description(
            supple_version=__version__,
            dt=float(dt),
            steps=int(steps),
            # The limits of `check_recording` depend on the solver.
            solver=first.solver.account if self._solver is None and first.solver is not None else self._solver,
            scene_text=self._scene_text,
            scene=system.scene,
            functions=tuple(self._at_start),
            details=self._details,
            field_names=tuple(field.name for field in self._fields),
            statuses_of_codes=tuple(str(status) for status in Status),
        )
        if self._fields:
            sizes = len(system.rest_positions), len(system.tets) + len(self._thin.owners)
            logger.info("%s: %s", self.path, cost(self._fields, *sizes, steps + 1))
        self._wanted = steps + 1
        capacity = self.first_capacity(layout)
        parent_folder(self.path)
        fresh = temporary_name(self.path)
        try:
            create(fresh, layout, capacity, lambda file: write_description(file, description))
            self._file = RecordingFile(fresh, layout, capacity)
            self._put(first)
            self._file = self._file.moved(self.path)
            remove_abandoned(self.path)
        except OSError as error:
            raise output_error(self.path, error) from None
        finally:
            if self._file is not None and self._file.path == fresh:
                self._file.close()
                self._file = None
            fresh.unlink(missing_ok=True)

    def _layout(self, first: Frame) -> Layout:
        system = first.system
        self._details = RecordedDetails.like(first.report.details)
        self._functions = described(system.scene)[2]
        self._at_start = values_at(self._functions, 0.0)
        self._thin = ThinCells(system.bodies)
        sizes = len(system.rest_positions), len(system.tets) + len(self._thin.owners), len(system.obstacles)
        names, sensors = system.scene.stitching.names, recorded_sensors(system.scene)
        counts = count_of(system.laws.material), len(names) if names.breakable else 0
        return frame_layout(*sizes, self._details, self._fields, sensors, *counts, self._at_start)

    def write(self, frame: Frame) -> None:
        """Add one frame."""
        if self._file is None:
            raise OutputError(f"{self.path}: write was called before begin; let simulate drive the recorder")
        try:
            self._put(frame)
        except OSError as error:
            raise output_error(self.path, error) from None
        if not self._file.is_in_place:
            self._file.close()
            self._file = None
            raise OutputError(f"{self.path}: was removed or replaced while it was written; run again, to another place")

    def sync(self) -> None:
        """Bring all frames to the disk, so that a power failure cannot lose them.

        Raises
        ------
        OutputError : where the system refuses.
        """
        if self._file is not None:
            try:
                self._file.sync()
            except OSError as error:
                raise output_error(self.path, error) from None

    def end(self) -> None:
        """Release space that was not used, add the steps of VTK, and close the file."""
        file, self._file = self._file, None
        if file is None:
            return
        file.close()
        fresh = temporary_name(self.path)
        try:
            rewrite(self.path, fresh, file.layout, None, compress=self._compress)
            put_in_place(fresh, self.path)
        except (OSError, RuntimeError) as error:
            # The recording is complete for `read_recording`.
            logger.warning("%s: has no steps for ParaView: %s", self.path, " ".join(str(error).split()))
        finally:
            fresh.unlink(missing_ok=True)

    def first_capacity(self, layout: Layout, written: int = 0) -> int:
        """The capacity at first, in frames, where `written` are there before."""
        return min(self._wanted, written + min(_FIRST_FRAMES, max(2, _FIRST_ROOM // layout.frame_bytes)))

    def _make_room(self, file: RecordingFile) -> RecordingFile:
        """Copy the frames to a file with more capacity, which replaces this one."""
        capacity = 2 * file.capacity
        if file.capacity < self._wanted:
            capacity = min(capacity, self._wanted)
        fresh = temporary_name(file.path)
        try:
            file.close()
            rewrite(file.path, fresh, file.layout, capacity)
            larger = RecordingFile(fresh, file.layout, capacity, file.written)
            larger.write_count()
            logger.debug("%s: capacity for %d frames", file.path, capacity)
            return larger.moved(file.path)
        finally:
            fresh.unlink(missing_ok=True)

    def _put(self, frame: Frame) -> None:
        assert self._file is not None
        report = frame.report
        if self._file.written == self._file.capacity:
            self._file = self._make_room(self._file)
        file = self._file
        file.put("VTKHDF/Points", frame.state.positions)
        file.put("VTKHDF/PointData/velocities", frame.state.velocities)
        ratios = self._thin.ratios(frame.state.positions)
        file.put("VTKHDF/CellData/det_F", np.concatenate([frame.det_F, ratios]))
        file.put(TIMES, frame.time)
        file.put("supple/frames/index", frame.index)
        file.put("supple/frames/status", list(Status).index(report.status))
        file.put("supple/frames/iterations", report.iterations)
        for name in REPORT_NUMBERS:
            value = getattr(report, name)
            file.put(f"supple/frames/{name}", math.nan if value is None else value)
        for name in REPORT_VECTORS:
            file.put(f"supple/frames/{name}", getattr(report, name))
        poses = np.zeros((len(frame.system.obstacles), 3, 4))
        for pose, obstacle in zip(poses, frame.system.obstacles, strict=True):
            pose[:, :3], pose[:, 3] = obstacle.pose(frame.time)
        file.put("supple/frames/poses", poses)
        if report.message:  # otherwise the space, which is all zeros, stays a hole in the file
            file.put("supple/frames/message", _message_bytes(report.message))
        for field in self._details.fields:
            file.put(field.series.path, field.stored(getattr(report.details, field.name)))
        if len(frame.state.internal):
            file.put(INTERNAL, frame.state.internal)
        names = frame.system.scene.stitching.names
        if names.breakable:
            rows, state = np.arange(len(names)), frame.state
            file.put(
                BROKEN_STITCHES, sum(np.isin(rows, of) for of in (state.broken_stitches, state.separated_stitches))
            )
        values = values_at(self._functions, frame.time)
        for number, series in function_series(self._at_start).items():
            value = values[number]
            if value is None or value.shape != series.row_shape:
                value = np.full(series.row_shape, np.nan)
            file.put(series.path, value)
        readings = frame.sensors
        for sensor in recorded_sensors(frame.system.scene):
            file.put(sensor.series.path, readings[sensor.name].numbers())
        for field in self._fields:
            values = _recorded(field, frame)
            values = self._thin.with_nothing(values) if field.at == "tets" else values
            with np.errstate(over="ignore"):  # beyond single precision, a value is infinite
                file.put(field_series(field, 0, 0).path, values.astype(np.float32))
        file.commit()


def _recorded(field: Field, frame: Frame) -> NDArray[np.float64]:
    """The field's values of tets or vertices; of points of bodies that touch with their skin, NaN."""
    values, system = field.values(frame), frame.system
    if field.at != "points":
        return values
    out = np.full((len(frame.state.positions), *field.shape), np.nan)
    for part in system.bodies:
        if not part.body.touches_with_skin:
            out[part.vertices] = values[part.points]
    return out


def _message_bytes(message: str) -> NDArray[np.uint8]:
    """The message in UTF-8, with zeros after it."""
    data, mark = message.encode(), "…".encode()
    if len(data) > MESSAGE_BYTES:
        data = data[: MESSAGE_BYTES - len(mark)].decode(errors="ignore").encode() + mark
    return np.frombuffer(data.ljust(MESSAGE_BYTES, b"\0"), dtype=np.uint8)
