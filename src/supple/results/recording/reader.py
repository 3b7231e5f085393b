"""Reading a recording frame by frame."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Any, overload

from supple.results.recording.contents import RecordedContents
from supple.results.recording.frame import RecordedFrame
from supple.runtime.displayed import Showable, short_list, supplied


class Recording(RecordedContents, Showable, Sequence[RecordedFrame]):
    """A recorded simulation: a sequence of frames. Made by `read_recording`; close it, or use it in a `with` block.

    Attributes
    ----------
    path : of the file; times : (frames,) [s]
    scene : as it was described; its functions of time have the values of the frames, and are linear in between
    system : the scene as flat arrays, of which `rest_positions` (n, 3) [m], `masses` (n,) [kg], `tets` (m, 4) and
        `rest_volumes` (m,) [m^3] are some; triangles : (t, 3) boundaries of all bodies
    bodies : with their rows of these arrays; obstacles : of the scene; gravity : (3,) [m/s^2]
    stitches, joints : of the scene, with their places
    dt : time from frame to frame [s]
    details : which fields of the solver's details are kept; fields : of tets and vertices that were recorded
    sensors : of the scene, then obstacles and pins
    scene_text : the scene file's text, or None; solver : its description, or None; supple_version : of the writer
    """

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
            raise IndexError(f"{self.path}: frame {index} does not exist; there are {self._count}")
        return RecordedFrame(self, number)

    def __iter__(self) -> Iterator[RecordedFrame]:
        return (RecordedFrame(self, i) for i in range(self._count))

    def _facts(self) -> dict[str, str]:
        return {
            "file": str(self.path),
            "frames": f"{self._count} to {self.times[-1]:g} s",
            "bodies": short_list(body.name for body in self.bodies),
            "tets": str(len(self.tets)),
            "ended": str(self.statuses[-1]),
        }

    def check(self, *, progress: Callable[[int, int], None] | None = None, **settings: Any) -> Any:
        """Verify the recording, independently of the solver that made it; see `check_recording`.

        Parameters
        ----------
        progress : is called with how many frames were looked at, and how many there are to look at.
        settings : which checks, which frames, and what they allow.

        Returns
        -------
        CheckReport : one result for each check; `report.ok`, `report["inversion"].verdict`,
            `report.save("report.json")`.

        Raises
        ------
        OutputError : where a setting is unusable.
        """
        return supplied("check")(self, progress=progress, **settings)

    def plot(self, x: str = "time", y: str | Sequence[str] = ()) -> Any:
        """What was measured over time: energies, works, momenta, volumes, the smallest J, the time of each step.

        Cavities, cables and sensors have panels where there are some. A notebook shows the plot where it is the last
        line of a cell; `recording.plot().save("plot.pdf")` writes it.

        Parameters
        ----------
        x, y : columns of the table, `recording.plot("plate.displacement", "plate.force")`; with `y`, only these are
            drawn.
        """
        return supplied("plot")(self, x, y)

    def export(self, to: str, output: str | Path | None = None, **film: Any) -> Path:
        """Write the recording in another format; the path of what was written.

        Parameters
        ----------
        to : "glb", "obj", "vtu", "vtkhdf", "usd", "gif", "mp4", "png", "csv" or "html".
        output : file, with a suffix of the format, or folder; beside the recording, under its name, where it is not
            given. What is there is replaced.
        film : how a film or picture is drawn: `size`, `rate`, `slow`, `camera`, `view`, `eye`, `target`, `surface`,
            `color`, `shadows`, `dark`, `time`.

        Raises
        ------
        OutputError : where the format is unknown, needs something that is not installed or does not agree with the
            output's suffix, or the output cannot be written. No incomplete file is left.
        """
        return supplied("export")(self, to, output, **film)

    @property
    def frames(self) -> Recording:
        """The recording itself, which is the sequence of its frames."""
        return self

    def __enter__(self) -> Recording:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def read_recording(path: str | Path) -> Recording:
    """Open a recording, of a simulation that has ended, was killed, or is still running.

    A frame is read when it is used. Frames that are written after the recording was opened are not in it.

    Parameters
    ----------
    path : of the recording (.vtkhdf).

    Raises
    ------
    OutputError : where the file is missing, a folder, cut off, of another kind, of another version, or contradictory;
        the text starts with the path.
    """
    return Recording(path)


def opened(recording: Recording | str | Path) -> AbstractContextManager[Recording]:
    """The recording itself if it is open, otherwise one that is opened for this block."""
    return nullcontext(recording) if isinstance(recording, Recording) else read_recording(recording)
