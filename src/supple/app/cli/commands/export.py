"""`supple export`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from supple.app.cli.arguments import exported
from supple.app.cli.film_options import FilmOptions

_USUAL = FilmOptions()


def export(
    recording: Path,
    /,
    *,
    to: str,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    film: FilmOptions = _USUAL,
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
    film
        How a film or picture is drawn.
    """
    print(exported(recording, to, output, **film.given()))
