"""Arguments of commands: numbers, parsed as strictly as those of a scene file, checkpoints, and paths of recordings."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter, Token

from supple.errors import OutputError


def whole_number(_: Any, tokens: Sequence[Token]) -> int:
    """A count. Nothing is rounded: 1.5 is an error."""
    text = tokens[0].value
    try:
        return int(text)
    except ValueError:
        raise ValueError(f"{text!r} is not a whole number") from None


def steps(_: Any, tokens: Sequence[Token]) -> int:
    """A number of frames, no larger than that of a scene file."""
    from supple.app.scene_file.document import MAX_STEPS

    number = whole_number(_, tokens)
    if number > MAX_STEPS:
        raise ValueError(f"at most {MAX_STEPS} frames are possible")
    return number


def seconds(_: Any, tokens: Sequence[Token]) -> float:
    """A time [s], as a number or a fraction such as 1/60."""
    from supple.app.scene_file.model import number_or_fraction

    text = tokens[0].value
    try:
        return number_or_fraction(text)
    except ValueError:
        raise ValueError(f"{text!r} is neither a number nor a fraction such as 1/60") from None


def pixels(_: Any, tokens: Sequence[Token]) -> tuple[int, int]:
    """Width and height, as 1280x720."""
    width, cross, height = (text := tokens[0].value).lower().partition("x")
    if not (cross and width.isdecimal() and height.isdecimal()):
        raise ValueError(f"{text!r} is not a width and a height such as 1280x720")
    return int(width), int(height)


@dataclass(frozen=True)
class Checkpoints:
    """When a run writes checkpoints: after this many frames, and this many seconds by the clock."""

    frames: int | None = 100
    seconds: float | None = 30.0


ON_THE_WAY = Checkpoints()


def checkpoints(_: Any, tokens: Sequence[Token]) -> Checkpoints:
    """A number of frames, or a time such as 30s; 0 for none on the way."""
    text = tokens[0].value
    if text.endswith("s"):
        try:
            every = float(text[:-1])
        except ValueError:
            every = math.nan
        if not 0.0 < every < math.inf:
            raise ValueError(f"{text!r} is not a time such as 30s")
        return Checkpoints(None, every)
    frames = whole_number(_, tokens)
    if frames < 0:
        raise ValueError(
            f"{frames} is below zero; give a number of frames, a time such as 30s, or 0 for none on the way"
        )
    return Checkpoints(frames) if frames else Checkpoints(None, None)


Steps = Annotated[int | None, Parameter(converter=steps)]
Pixels = Annotated[tuple[int, int] | None, Parameter(converter=pixels, n_tokens=1, accepts_keys=False)]
Vector = Annotated[tuple[float, float, float] | None, Parameter(negative="")]
Seconds = Annotated[float | None, Parameter(converter=seconds)]
CheckpointEvery = Annotated[Checkpoints, Parameter(converter=checkpoints, n_tokens=1, accepts_keys=False)]
Confine = Annotated[bool, Parameter(negative="")]
Yes = Annotated[bool, Parameter(name=["--yes", "-y"], negative="")]
Shell = Annotated[bool, Parameter(negative="")]
Overwrite = Annotated[bool, Parameter(negative="")]


def recording_at(path: Path) -> Path:
    """The recording at a path, which may be the folder of a run.

    Raises
    ------
    OutputError : where none exists in the folder.
    """
    inside = path / "recording.vtkhdf"
    if path.is_dir() and not inside.exists():
        raise OutputError(f"{path} is a folder without recording.vtkhdf; name a recording, or the folder of a run")
    return inside if path.is_dir() else path


def exported(run: Path, to: str, output: Path | None, in_folder: str | None = None, **film: Any) -> Path:
    """Export a recording, or that of the folder of a run; the path of what was written.

    Parameters
    ----------
    in_folder : the name of the output in the folder of a run, where no output is given; see `export` otherwise
    """
    from supple.results.export.exporter import export

    if output is None and in_folder is not None and run.is_dir():
        output = run / in_folder
    return export(recording_at(run), to, output, **film)
