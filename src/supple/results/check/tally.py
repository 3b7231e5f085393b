"""The worst number of a check, where it was, and in how many frames the check failed."""

from __future__ import annotations

from collections.abc import Callable

from supple.results.check.report import CheckResult, Verdict
from supple.results.check.snapshot import Snapshot
from supple.results.recording.frame import RecordedFrame

# Units of numbers that count errors.
COUNTED = ("numbers", "pairs", "pieces")


class Tally:
    """Collects one number per frame.

    Parameters
    ----------
    name : of the check; unit : of its number; lowest : whether small numbers are the bad ones.
    """

    def __init__(self, name: str, unit: str = "", *, lowest: bool = False) -> None:
        self.name, self.unit, self._lowest = name, unit, lowest
        self.worst: float | None = None
        self.frame: int | None = None
        self.time: float | None = None
        self.where = ""
        self.failed_frames = 0
        self.first_failure: int | None = None
        self._last_failure: int | None = None
        self._rank: tuple[bool, float] | None = None

    def see(
        self, at: Snapshot | RecordedFrame | None, value: float, failed: bool, where: str | Callable[[], str] = ""
    ) -> None:
        """Add a number of a frame, or of no frame (None). A frame may come several times in succession.

        Failures count as worse than other numbers.
        """
        number = None if at is None else at.number
        if failed and not (self.failed_frames and number == self._last_failure):
            self.failed_frames += 1
            self._last_failure = number
            if self.first_failure is None:
                self.first_failure = number
        rank = failed, -value if self._lowest else value
        if self._rank is None or rank > self._rank:
            self._rank, self.worst = rank, float(value)
            self.frame, self.time = (None, None) if at is None else (at.number, at.time)
            self.where = where() if callable(where) else where

    def result(self, good: str, bad: str) -> CheckResult:
        """The result. `good` and `bad` describe the worst number, for which `{worst}` stands."""
        failed = self.failed_frames > 0
        if self.worst == 0.0 and self.unit in COUNTED:
            # Nothing was found in any frame: no frame is worse than another.
            self.frame = self.time = None
        unit = self.unit[:-1] if self.unit in COUNTED and self.worst == 1.0 else self.unit
        number = "none" if self.worst is None else f"{self.worst:.6g} {unit}".rstrip()
        text = (bad if failed else good).replace("{worst}", number)
        if self.where:
            text += f" ({self.where})"
        if failed and self.first_failure is not None:
            frames = "1 frame" if self.failed_frames == 1 else f"{self.failed_frames} frames"
            text += f"; in {frames}, first {self.first_failure}"
        return CheckResult(
            self.name,
            Verdict.FAIL if failed else Verdict.PASS,
            text,
            self.worst,
            self.unit,
            self.frame,
            self.time,
            self.where,
            self.failed_frames,
            self.first_failure,
        )


def skipped(name: str, why: str) -> CheckResult:
    """The result of a check that could not be made."""
    return CheckResult(name, Verdict.SKIPPED, why)
