"""`supple plot`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from supple.app.cli.arguments import recording_at


def plot(
    recording: Path,
    /,
    *,
    x: str = "time",
    y: Annotated[list[str] | None, Parameter(negative="", consume_multiple=True)] = None,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
) -> None:
    """Plot the measurements of a recording: energies, works, momenta, volumes, smallest J, time per step; cavities,
    cables, sensors, and forces of obstacles and pins over their displacements.

    Parameters
    ----------
    recording
        The recording (.vtkhdf), or the folder of its run.
    x
        With --y: the column of the table (`supple table`) on the horizontal axis, such as plate.displacement.
    y
        Columns to draw instead of everything, such as plate.force.
    output
        Picture to write (.png, .pdf or .svg); without it, plot.png beside the recording, or curves.png with --y.
    """
    from supple.results.plots import plot as plotted
    from supple.results.recording.reader import opened
    from supple.runtime.replacing import refuse_to_replace

    recording = recording_at(recording)
    picture = recording.with_name("curves.png" if y else "plot.png") if output is None else output
    refuse_to_replace(recording, picture)
    with opened(recording) as source:
        print(plotted(source, x, y or ()).save(picture))
