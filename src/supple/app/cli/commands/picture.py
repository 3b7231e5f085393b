"""`supple picture`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from supple.app.cli.arguments import Seconds, exported
from supple.app.cli.film_options import PictureOptions

_USUAL = PictureOptions()


def picture(
    recording: Path,
    /,
    *,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    time: Seconds = None,
    look: PictureOptions = _USUAL,
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
    look
        How it is drawn.
    """
    moment = {} if time is None else {"time": time}
    print(exported(recording, "png", output, "picture.png", **look.given(), **moment))
