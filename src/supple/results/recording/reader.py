"""Reading a recording frame by frame."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import overload

from supple.results.recording.contents import RecordedContents
from supple.results.recording.frame import RecordedFrame
from supple.runtime.displayed import Showable, short_list


class Recording(RecordedContents, Showable, Sequence[RecordedFrame]):
    """A recorded simulation: a sequence of frames. Made by `read_recording`; close it, or use it in a `with` block.

    Attributes
    ----------
    path : of the file; times : (frames,) [s]
    bodies, obstacles, stitches : of the scene
    rest_positions : (n, 3) [m]; masses : (n,) [kg]; tets : (m, 4); triangles : (t, 3); rest_volumes : (m,) [m^3]
    quadratic : rows (k,) and nodes (k, 10) of the quadratic tets, whose corners `tets` has; None without such
    gravity : (3,) [m/s^2]; dt : time from frame to frame [s]
    physics : the bodies' laws and what acts on them
    details : which fields of the solver's details are kept; fields : of tets and vertices that were recorded
    sensors : of the scene
    untouching : pairs that may pass through each other: numbers of bodies, then obstacles
    welds : vertices of soft bodies that are points of rigid ones; joints : of the scene
    loads : those whose forces follow from one value, by its name in the details; other_loads : names of works of others
    cavities, cables : of the scene
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
            raise IndexError(f"{self.path}: there is no frame {index}; there are {self._count}")
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
