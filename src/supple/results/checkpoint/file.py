"""A checkpoint: everything that a run needs to resume with the bits of an uninterrupted one, in one file.

The file is a line that names the format, the SHA-256 of all that follows in hexadecimal digits, a line of JSON, and the
bytes of all arrays. It is written under a temporary name, brought to the disk, and renamed.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from supple.errors import OutputError
from supple.kinds.codec import check, decoded, described, encoded, restored
from supple.materials.laws.internal import COLUMNS
from supple.model.state import State
from supple.runtime.replacing import whole_file
from supple.solvers.implicit.stepping.conservation import EnergyMade
from supple.solvers.implicit.stepping.integrators import History
from supple.solvers.xpbd.assessment.assessment import Ledger
from supple.solvers.xpbd.assessment.softening import MeasuredWork
from supple.solvers.xpbd.contact.frame_forces import LoadedRows
from supple.solvers.xpbd.contact.memory import ContactMemory, ListMemory
from supple.solvers.xpbd.damping.kelvin_voigt import ViscousMemory
from supple.solvers.xpbd.memory import ControlMemory, ElementMemory, XPBDMemory
from supple.solvers.xpbd.sleep import SleepMemory

MEMORIES: tuple[type, ...] = (
    ContactMemory,
    ControlMemory,
    ElementMemory,
    EnergyMade,
    History,
    Ledger,
    ListMemory,
    LoadedRows,
    MeasuredWork,
    SleepMemory,
    ViscousMemory,
    XPBDMemory,
)


_FORMAT = b"supple checkpoint 1\n"
_FAMILY = b"supple checkpoint "
_DIGEST_LENGTH = 65  # hexadecimal digits, and a newline


@dataclass(frozen=True)
class RunFacts:
    """What a run is.

    Attributes
    ----------
    first_index : of the frame that it began with; steps : number of frames after it
    dt : time from frame to frame [s]
    scene : see `scene_hash`; span : begin and duration that it was computed with [s]
    solver : its description
    """

    first_index: int
    steps: int
    dt: float
    scene: str
    span: tuple[float, float]
    solver: str

    @property
    def last_index(self) -> int:
        """Of the frame that the run ends with."""
        return self.first_index + self.steps


@dataclass(frozen=True, eq=False)
class Checkpoint:
    """A run after one of its frames.

    Attributes
    ----------
    run : the whole run; index : of the frame
    state : with the solver's memory
    start_states, anchors : see `rebuilt_system`
    versions : of the programs that computed the frame, by name
    """

    run: RunFacts
    index: int
    state: State
    start_states: tuple[State, ...]
    anchors: tuple[NDArray[np.float64], ...]
    versions: dict[str, str]


def write_checkpoint(path: Path, checkpoint: Checkpoint) -> None:
    """Write a checkpoint; what is there is replaced in one moment.

    Raises
    ------
    OutputError : where the system refuses, or the solver's memory is of a class that is not registered.
    """
    tree, arrays = encoded(checkpoint, _classes())
    header = json.dumps({"content": tree, "arrays": described(arrays)}, separators=(",", ":")).encode() + b"\n"
    parts = [header, *(np.ascontiguousarray(array).tobytes() for array in arrays.values())]
    digest = hashlib.sha256()
    for part in parts:
        digest.update(part)
    with whole_file(path) as fresh, fresh.open("wb") as file:
        file.write(_FORMAT + digest.hexdigest().encode() + b"\n")
        for part in parts:
            file.write(part)


def read_checkpoint(path: Path) -> Checkpoint:
    """Read a checkpoint. Every bit of it is checked before it is used.

    Raises
    ------
    OutputError : where the file is missing, of another kind or version, or damaged; the text starts with the path.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise OutputError(f"{path}: cannot be read: {error.strerror or error}") from None
    if not data.startswith(_FORMAT):
        if data.startswith(_FAMILY):
            raise OutputError(f"{path}: was written by another version; simulate it again")
        raise OutputError(f"{path}: is not a checkpoint; give one that a run folder of Supple holds")
    content = data[len(_FORMAT) + _DIGEST_LENGTH :]
    written = data[len(_FORMAT) : len(_FORMAT) + _DIGEST_LENGTH]
    if written != hashlib.sha256(content).hexdigest().encode() + b"\n":
        raise _damaged(path, "its checksum is wrong")
    try:
        line, _, rest = content.partition(b"\n")
        header = json.loads(line)
        checkpoint = decoded(header["content"], restored(header["arrays"], memoryview(rest)), _classes())
        check(checkpoint, Checkpoint, "checkpoint")
        _check_consistency(checkpoint)
    except (ValueError, TypeError, KeyError, IndexError, AttributeError, RecursionError) as error:
        raise _damaged(path, f"its content is not what this version writes ({error})") from None
    return checkpoint


def _classes() -> dict[str, type]:
    return {kind.__name__: kind for kind in (Checkpoint, RunFacts, State, *MEMORIES)}


def _damaged(path: Path, what: str) -> OutputError:
    return OutputError(f"{path}: is damaged: {what}; delete it, so that an earlier checkpoint is used")


def _check_consistency(checkpoint: Checkpoint) -> None:
    """Raise `ValueError` for what the annotations cannot say."""
    run, states = checkpoint.run, (checkpoint.state, *checkpoint.start_states)
    if not run.first_index <= checkpoint.index <= run.last_index or not checkpoint.start_states:
        raise ValueError("it is of no frame of its run")
    for state in states:
        internal, shape = state.internal, (len(checkpoint.state.positions), 3)
        if state.positions.shape != shape or state.velocities.shape != shape or internal.shape[1:] != (COLUMNS,):
            raise ValueError("its states are of different sizes")
        if not all(np.isfinite(rows).all() for rows in (state.positions, state.velocities, internal)):
            raise ValueError("its numbers are not finite")
