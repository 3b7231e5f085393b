"""`supple export`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from supple.app.cli.recordings import recording_at


def export(
    recording: Path,
    /,
    *,
    to: str,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
) -> None:
    """Write a recording in another program's format.

    Parameters
    ----------
    recording
        The recording (.vtkhdf), or the folder of its run.
    to
        glb (Blender, three.js), obj (a folder, one file per frame), vtu (the last frame), vtkhdf (compressed, or
        repaired after a kill), usd (extra: usd), gif or mp4 (extra: video), html (a page), csv (a table of the reports
        of all frames).
    output
        File or folder to write, with a suffix of the format; without it, beside the recording and under its name.
    """
    from supple.results.export.exporter import export as write

    print(write(recording_at(recording), to, output))
