"""The base class of checks: a check sees every frame, then returns its result."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar, NamedTuple

from supple.output.check.report import CheckResult
from supple.output.check.settings import CheckSettings
from supple.output.check.snapshot import Scene, Snapshot


class Moment(NamedTuple):
    """Which frame a number belongs to."""

    number: int
    time: float


class FrameCheck(ABC):
    """One check. A new one is one class, a line in `checker.CHECKS`, and one in `settings.NAMES`.

    Attributes
    ----------
    name : one of `settings.NAMES`; sees_all : whether it also sees frames with numbers that are not finite
    needs_frames : whether its result needs at least one frame
    """

    name: ClassVar[str]
    sees_all: ClassVar[bool] = False
    needs_frames: ClassVar[bool] = True

    def __init__(self, scene: Scene, settings: CheckSettings) -> None:
        self.scene, self.settings = scene, settings

    @abstractmethod
    def see(self, at: Snapshot) -> None:
        """Check a frame; frames come in order."""

    @abstractmethod
    def result(self) -> CheckResult:
        """The result of all frames."""
