"""Arguments of commands: numbers, parsed as strictly as those of a scene file, checkpoints, and paths of recordings."""

from __future__ import annotations

from collections.abc import Sequence
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


Steps = Annotated[int | None, Parameter(converter=steps)]
Pixels = Annotated[tuple[int, int] | None, Parameter(converter=pixels, n_tokens=1, accepts_keys=False)]
Seconds = Annotated[float | None, Parameter(converter=seconds)]
CheckpointEvery = Annotated[int | None, Parameter(converter=whole_number)]
Overwrite = Annotated[bool, Parameter(negative="")]


def interval(given: int | None) -> int | None:
    """The number of frames from checkpoint to checkpoint, or None where 0 is given; by default that of `RunFolder`.

    Raises
    ------
    OutputError : where it is below zero.
    """
    from supple.app.runs.run_folder import CHECKPOINT_EVERY

    if given is not None and given < 0:
        raise OutputError(f"--checkpoint-every is {given}; give a number of frames, or 0 for none on the way")
    return CHECKPOINT_EVERY if given is None else given or None


def recording_at(path: Path) -> Path:
    """The recording at a path, which may be the folder of a run.

    Raises
    ------
    OutputError : where there is none in the folder.
    """
    inside = path / "recording.vtkhdf"
    if path.is_dir() and not inside.exists():
        raise OutputError(f"{path} is a folder without recording.vtkhdf; name a recording, or the folder of a run")
    return inside if path.is_dir() else path
