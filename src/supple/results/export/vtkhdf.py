"""A copy of a recording: compressed, without unused space, and complete for VTK where its writer was killed."""

from __future__ import annotations

from pathlib import Path

from supple.errors import OutputError
from supple.results.recording.file import rewrite
from supple.results.recording.reader import Recording
from supple.runtime.replacing import whole_file


def write_vtkhdf(recording: Recording, output: Path) -> None:
    """Copy every complete frame to a compressed VTKHDF file.

    Raises
    ------
    OutputError : where the recording is damaged, or the file cannot be written.
    """
    with whole_file(output) as fresh:
        try:
            rewrite(recording.path, fresh, recording.layout, None, compress=True)
        except (KeyError, RuntimeError, TypeError, ValueError) as error:
            reason = " ".join(str(error).split())
            raise OutputError(f"{recording.path}: is damaged: {reason}; copy or record it again") from None
