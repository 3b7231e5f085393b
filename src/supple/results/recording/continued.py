"""A sink that adds frames to a recording that exists."""

from __future__ import annotations

import logging
from pathlib import Path

import numpy as np

from supple.errors import OutputError
from supple.model.state import Status
from supple.results.frame import Frame
from supple.results.recording.file import RecordingFile, rewrite
from supple.results.recording.reader import read_recording
from supple.results.recording.recorder import Recorder
from supple.runtime.replacing import output_error, remove_abandoned, temporary_name

logger = logging.getLogger(__name__)


class ContinuedRecorder(Recorder):
    """Continues a recording from one of its frames, which the simulation starts with.

    Frames after it that are computed again are compared with the recorded ones, which stay. From the first one that
    differs, the recorded ones are replaced.

    Parameters
    ----------
    path : of the recording; compress : compress the frames when the simulation ends

    Raises
    ------
    OutputError : as `Recorder`; and from `begin` where the recording does not contain the frame that it starts with.
    """

    def __init__(self, path: str | Path, *, compress: bool = False) -> None:
        super().__init__(path, compress=compress)
        self._next = 0

    def begin(self, first: Frame, dt: float, steps: int) -> None:
        """Reserve `steps` frames after `first`."""
        fresh = temporary_name(self.path)
        try:
            with read_recording(self.path) as recording:
                written, self._fields = len(recording), recording.fields
            layout = self._layout(first)
            self._next = self._number_of(first, dt) + 1
            self._wanted = max(self._next + steps, written)
            capacity = self.first_capacity(layout, written)
            rewrite(self.path, fresh, layout, capacity)
            self._file = RecordingFile(fresh, layout, capacity, written)
            self._file.write_count()
            self._file = self._file.moved(self.path)
            remove_abandoned(self.path)
        except OSError as error:
            raise output_error(self.path, error) from None
        except (RuntimeError, TypeError, ValueError, KeyError) as error:
            raise OutputError(f"{self.path}: cannot be continued: {' '.join(str(error).split())}") from None
        finally:
            if self._file is not None and self._file.path == fresh:
                self._file.close()
                self._file = None
            fresh.unlink(missing_ok=True)

    def _number_of(self, first: Frame, dt: float) -> int:
        """Which frame of the recording `first` is."""
        with read_recording(self.path) as recording:
            numbers = [k for k in range(len(recording)) if recording[k].index == first.index]
            if recording.dt != dt or recording.details != self._details or len(numbers) != 1:
                raise OutputError(f"{self.path}: does not contain frame {first.index} of this run; run again")
            recorded = recording[numbers[0]].state
        same = (
            recorded.time == first.time
            and np.array_equal(recorded.positions, first.state.positions)
            and np.array_equal(recorded.velocities, first.state.velocities)
            and np.array_equal(recorded.internal, first.state.internal)
        )
        if not same:
            raise OutputError(f"{self.path}: its frame {first.index} is not the one to continue from; run again")
        return numbers[0]

    def _put(self, frame: Frame) -> None:
        assert self._file is not None
        number, self._next = self._next, self._next + 1
        if number < self._file.written:
            if self._is_recorded(frame, number):
                return
            logger.warning(
                "%s: frame %d differs from the recorded one; replacing it and later ones", self.path, frame.index
            )
            self._file.written = number
        super()._put(frame)

    def _is_recorded(self, frame: Frame, number: int) -> bool:
        assert self._file is not None
        values = {
            "VTKHDF/Points": np.ascontiguousarray(frame.state.positions).tobytes(),
            "VTKHDF/PointData/velocities": np.ascontiguousarray(frame.state.velocities).tobytes(),
            "supple/frames/status": bytes([list(Status).index(frame.report.status)]),
        }
        return all(self._file.get(path, number) == value for path, value in values.items())
