"""The base class of checks: a check sees every frame, then returns its result."""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar, NamedTuple

from supple.results.check.report import CheckResult, Verdict
from supple.results.check.settings import CheckSettings
from supple.results.check.trajectory import Snapshot, Trajectory

# What a check may need, and what its result says where the files do not contain it and nobody gives it.
UNKNOWN = {
    "recording": "only recordings of Supple contain what it needs",
    "files": "all frames of a recording have the same cells",
    "tets": "the files have no tets",
    "times": "the time from frame to frame is not known; give --dt or --fps",
    "masses": "masses are not known; it needs tets and --density, or an array of masses",
    "gravity": "gravity is not known; give --gravity, 0 0 0 where none exists",
    "material": "the material is not known; it needs tets, --youngs and --poisson",
    "free": "what holds the parts is not known; --free says that nothing but gravity acts on them",
}
# Units of numbers that count errors.
COUNTED = ("numbers", "pairs", "pieces")


class At(NamedTuple):
    """Number and time [s] of a frame."""

    number: int
    time: float


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

    def see(self, at: Snapshot | At | None, value: float, failed: bool, where: str | Callable[[], str] = "") -> None:
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


class FrameCheck:
    """One check. A new one is one class, a line in `checker.CHECKS`, and one in `settings.NAMES`.

    Attributes
    ----------
    name : one of `settings.NAMES`; sees_all : whether it also sees frames with numbers that are not finite
    needs_frames : whether its result needs at least one frame; needs : keys of `UNKNOWN`
    unit : of its number; lowest : whether small numbers are the bad ones
    good, bad : texts of its result; `{worst}` in them stands for the worst number
    nothing : why it cannot be made where it has seen no number; "" where that is good
    in_order : what it judges, where it needs every frame
    of : the frames and what is known beside them; first, last : the frames that it saw first, and before this one
    why_not : why it cannot be made; it then sees no further frames
    """

    name: ClassVar[str]
    sees_all: ClassVar[bool] = False
    needs_frames: ClassVar[bool] = True
    needs: ClassVar[frozenset[str]] = frozenset()
    unit: ClassVar[str] = ""
    lowest: ClassVar[bool] = False
    nothing: ClassVar[str] = ""
    in_order: ClassVar[str] = ""
    good: str
    bad: ClassVar[str]

    def __init__(self, of: Trajectory, settings: CheckSettings) -> None:
        self.of, self.settings = of, settings
        self.tally = Tally(self.name, self.unit, lowest=self.lowest)
        self.first: Snapshot | None = None
        self.last: Snapshot | None = None
        self.why_not: str | None = None
        if self.in_order and settings.every > 1:
            self.why_not = f"{self.in_order} from one frame to the next only"
        self.begin()

    def begin(self) -> None:
        """Check what no frame changes, and prepare for the frames."""

    def add(self, at: Snapshot) -> None:
        """Check a frame; frames come in order."""
        self.first = self.first or at
        self.see(at)
        self.last = at

    def see(self, at: Snapshot) -> None:
        """Check a frame, after `last`."""

    def at(self, number: int) -> At:
        """Number and time of a frame."""
        return At(int(number), float(self.of.times[number]))

    def result(self) -> CheckResult:
        """The result of all frames."""
        if self.why_not is None and self.nothing and self.tally.worst is None:
            self.why_not = self.nothing
        if self.why_not is not None:
            return skipped(self.name, self.why_not)
        return self.tally.result(self.good, self.bad)
