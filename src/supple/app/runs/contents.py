"""What a run folder contains."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path

from supple.app.scene_file.resolved import SCENE_NAME
from supple.errors import OutputError

_KEPT = 2


@dataclass(frozen=True)
class RunPaths:
    """The paths in a run folder.

    Attributes
    ----------
    folder : the run folder
    """

    folder: Path

    @property
    def recording(self) -> Path:
        """All frames."""
        return self.folder / "recording.vtkhdf"

    @property
    def table(self) -> Path:
        """The reports of all frames."""
        return self.folder / "report.csv"

    @property
    def own(self) -> Path:
        """The folder of everything that follows."""
        return self.folder / "run"

    @property
    def journal(self) -> Path:
        """What was run, when, where and by what; see `Journal`."""
        return self.own / "run.json"

    @property
    def log(self) -> Path:
        """A line for each event."""
        return self.own / "run.log"

    @property
    def scene(self) -> Path:
        """The scene file as resolved, of a run of a scene file."""
        return self.own / SCENE_NAME

    @property
    def checkpoint_folder(self) -> Path:
        """The folder of the checkpoints."""
        return self.own / "checkpoints"

    def checkpoint(self, index: int) -> Path:
        """The checkpoint of one frame."""
        return self.checkpoint_folder / f"{index:08d}.checkpoint"

    def checkpoints(self) -> list[Path]:
        """All checkpoints, the latest first."""
        found = (path for path in self.checkpoint_folder.glob("*.checkpoint") if path.stem.isdecimal())
        return sorted(found, key=lambda path: int(path.stem), reverse=True)

    def remove_old_checkpoints(self) -> None:
        """Keep the first checkpoint and the latest two."""
        for path in self.checkpoints()[_KEPT:-1]:
            path.unlink(missing_ok=True)

    def remove_checkpoints_after(self, index: int) -> None:
        """Delete checkpoints of later frames: a resumed run has found them unusable."""
        for path in self.checkpoints():
            if int(path.stem) > index:
                path.unlink(missing_ok=True)

    def refuse_other_kinds(self) -> None:
        """Raise `OutputError` where a file has the name of a folder, or a folder that of the recording."""
        name = self.recording.name
        if self.folder.exists() and not self.folder.is_dir():
            raise OutputError(f"{self.folder}: is not a folder, and must be one to hold {name}; give another")
        if self.recording.is_dir():
            raise OutputError(f"{self.recording}: is a folder, and must be a file; give another folder to run in")

    def refuse_a_run(self) -> None:
        """Raise `OutputError` where a new run would replace an earlier one."""
        if self.recording.exists() or self.journal.exists():
            raise OutputError(
                f"{self.folder}: contains a run; give another folder, continue it with `supple resume`, or replace it "
                "with --overwrite (overwrite=True)"
            )

    def remove_run(self) -> None:
        """Delete an earlier run, and what a run left that was killed before it had a journal."""
        if self.journal.exists():
            self.journal.unlink()
            shutil.rmtree(self.own)
        for path in (self.recording, *self.checkpoints()):
            path.unlink(missing_ok=True)
