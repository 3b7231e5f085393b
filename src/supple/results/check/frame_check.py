"""The base class of checks: a check sees every frame, then returns its result."""

from __future__ import annotations

from typing import ClassVar

from supple.results.check.report import CheckResult
from supple.results.check.settings import CheckSettings
from supple.results.check.snapshot import Scene, Snapshot
from supple.results.check.tally import Tally, skipped


class FrameCheck:
    """One check. A new one is one class, a line in `checker.CHECKS`, and one in `settings.NAMES`.

    Attributes
    ----------
    name : one of `settings.NAMES`; sees_all : whether it also sees frames with numbers that are not finite
    needs_frames : whether its result needs at least one frame
    unit : of its number; lowest : whether small numbers are the bad ones
    good, bad : texts of its result; `{worst}` in them stands for the worst number
    why_not : why it cannot be made; it then sees no further frames
    """

    name: ClassVar[str]
    sees_all: ClassVar[bool] = False
    needs_frames: ClassVar[bool] = True
    unit: ClassVar[str] = ""
    lowest: ClassVar[bool] = False
    good: str
    bad: ClassVar[str]

    def __init__(self, scene: Scene, settings: CheckSettings) -> None:
        self.scene, self.settings = scene, settings
        self.tally = Tally(self.name, self.unit, lowest=self.lowest)
        self.why_not: str | None = None
        self.begin()

    def begin(self) -> None:
        """Check what no frame changes, and prepare for the frames."""

    def see(self, at: Snapshot) -> None:
        """Check a frame; frames come in order."""

    def result(self) -> CheckResult:
        """The result of all frames."""
        if self.why_not is not None:
            return skipped(self.name, self.why_not)
        return self.tally.result(self.good, self.bad)
