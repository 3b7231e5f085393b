"""`supple picture`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from supple.app.cli.arguments import Pixels, Seconds, recording_at


def picture(
    recording: Path,
    /,
    *,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    time: Seconds = None,
    size: Pixels = None,
    camera: str | None = None,
    view: str | None = None,
    color: str | None = None,
    shadows: bool | None = None,
) -> None:
    """Draw one moment of a recording (extra: video).

    Parameters
    ----------
    recording
        The recording (.vtkhdf), or the folder of its run.
    output
        File to write (.png); without it, picture.png in the folder, or beside the recording and under its name.
    time
        In seconds: the end without it.
    size
        Width and height in pixels, such as 1920x1080. Without it 1280x720.
    camera
        fit (the whole motion, without it) or follow (the bodies at this moment).
    view
        From where: corner (without it), front, side, top or back.
    color
        body (without it), or a field with a legend: J, von_mises or energy.
    shadows
        Whether bodies and obstacles cast soft shadows on floors: yes without it.
    """
    from supple.results.export.exporter import export

    given = {"size": size, "camera": camera, "view": view, "color": color, "shadows": shadows, "time": time}
    if output is None and recording.is_dir():
        output = recording / "picture.png"
    film = {key: value for key, value in given.items() if value is not None}
    print(export(recording_at(recording), "png", output, **film))
