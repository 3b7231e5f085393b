"""The options of the commands that write a run folder."""

from __future__ import annotations

from typing import Annotated

from cyclopts import Parameter

from supple.app.cli.numbers import whole_number
from supple.errors import OutputError

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
