"""`supple export`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from supple.app.cli.arguments import Pixels, recording_at


def export(
    recording: Path,
    /,
    *,
    to: str,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    size: Pixels = None,
    rate: float | None = None,
    slow: float | None = None,
    camera: str | None = None,
    view: str | None = None,
    color: str | None = None,
    shadows: bool | None = None,
) -> None:
    """Write a recording in another program's format.

    Parameters
    ----------
    recording
        The recording (.vtkhdf), or the folder of its run.
    to
        glb (Blender, three.js), obj (a folder, one file per frame), vtu (the last frame), vtkhdf (compressed, or
        repaired after a kill), usd (extra: usd), mp4 or gif (a film; extra: video), png (see supple picture), html
        (a page), csv (a table of the reports of all frames).
    output
        File or folder to write, with a suffix of the format; without it, beside the recording and under its name.
    size
        Of a film or picture: width and height in pixels, such as 1920x1080. Without it 1280x720, of a gif 640x360.
    rate
        Frames per second of a film: 30 without it, of a gif 20.
    slow
        Slow motion: 4 makes a film four times as long as the simulation.
    camera
        fit (the whole motion, without it), follow (moves with the bodies) or orbit (turns once around them).
    view
        From where: corner (without it), front, side, top or back.
    color
        body (without it), or a field with a legend: J, von_mises or energy.
    shadows
        Whether bodies and obstacles cast soft shadows on floors: yes without it.
    """
    from supple.results.export.exporter import export as write

    given = {
        "size": size,
        "rate": rate,
        "slow": slow,
        "camera": camera,
        "view": view,
        "color": color,
        "shadows": shadows,
    }
    film = {key: value for key, value in given.items() if value is not None}
    print(write(recording_at(recording), to, output, **film))
