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
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
) -> None:
    """Plot the measurements of a recording: energies, works, momenta, volumes, smallest J, time per step; cavities,
    cables and sensors.

    Parameters
    ----------
    recording
        The recording (.vtkhdf), or the folder of its run.
    output
        Picture to write (.png, .pdf or .svg); without it, plot.png beside the recording.
    """
    from supple.results.plots import plot_recording
    from supple.runtime.replacing import refuse_to_replace

    recording = recording_at(recording)
    picture = recording.with_name("plot.png") if output is None else output
    refuse_to_replace(recording, picture)
    print(plot_recording(recording, picture))
