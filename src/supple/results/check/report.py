"""The results of a check of a recording."""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any

from supple.runtime.displayed import Displayed
from supple.runtime.replacing import whole_file


class Verdict(StrEnum):
    """How a check ended. Compares equal to its name as text."""

    PASS = "pass"
    FAIL = "fail"
    SKIPPED = "skipped"


@dataclass(frozen=True)
class CheckResult:
    """One check.

    Attributes
    ----------
    name : of the check; verdict : pass, fail or skipped
    message : what was found, or why the check was skipped
    worst : the number closest to failing, or furthest beyond, in the unit below; None where none exists
    unit : of that number, "" for a ratio
    frame, time : of that number, frames counted from 0, [s]; None where it belongs to no frame
    where : the body, and its tet, triangle or vertex
    failed_frames : number of checked frames in which the check failed; first_failure : the first of them, or None
    """

    name: str
    verdict: Verdict
    message: str
    worst: float | None = None
    unit: str = ""
    frame: int | None = None
    time: float | None = None
    where: str = ""
    failed_frames: int = 0
    first_failure: int | None = None


@dataclass(frozen=True, repr=False)
class CheckReport(Displayed):
    """All checks of one recording or series.

    Attributes
    ----------
    path : of the recording; frames : how many it has; frames_checked : number of frames that were checked
    results : one for each check, in order; notes : what was assumed of the files, one sentence each
    place : where the first failure is, as `shown.picture` draws it; None without one
    unfinished : how a run ended before its last frame; "" where it has all frames
    """

    path: Path
    frames: int
    frames_checked: int
    results: tuple[CheckResult, ...]
    notes: tuple[str, ...] = ()
    place: Any = None
    unfinished: str = ""

    def _facts(self) -> dict[str, str]:
        facts = {"frames": f"{self.frames_checked} of {self.frames}", "failed": str(len(self.failures))}
        return facts | {r.name: f"{r.verdict}: {r.message}" for r in self.results}

    @property
    def ok(self) -> bool:
        """Whether nothing failed."""
        return not self.failures

    @property
    def failures(self) -> tuple[CheckResult, ...]:
        """The checks that failed."""
        return tuple(result for result in self.results if result.verdict is Verdict.FAIL)

    @property
    def skipped(self) -> dict[str, list[str]]:
        """The names of the checks that were skipped, by the reason."""
        found: dict[str, list[str]] = {}
        for result in self.results:
            if result.verdict is Verdict.SKIPPED:
                found.setdefault(result.message, []).append(result.name)
        return found

    @property
    def verdict(self) -> str:
        """One line: what was checked, what was skipped, and what failed, first the check that failed first."""
        checked = "all" if self.frames == self.frames_checked else f"{self.frames_checked} of"
        begin = f"{self.path}: {checked} {self.frames} frames checked"
        begin += f" ({self.unfinished})" if self.unfinished else ""
        without = ", ".join(result.name for result in self.results if result.verdict is Verdict.SKIPPED)
        without = f"; skipped: {without}" if without else ""
        if self.ok:
            passed = sum(result.verdict is Verdict.PASS for result in self.results)
            return f"{begin}, {passed} checks passed{without}"
        failed = sorted(self.failures, key=lambda result: result.first_failure or 0)
        first = failed[0]
        at = "" if first.first_failure is None else f", first {first.name} in frame {first.first_failure}"
        return f"{begin}, FAILED: {', '.join(result.name for result in failed)}{at}{without}"

    def __getitem__(self, name: str) -> CheckResult:
        """The result of the check of that name."""
        for result in self.results:
            if result.name == name:
                return result
        raise KeyError(name)

    def __str__(self) -> str:
        lines = [f"{self.path}: {self.frames_checked} of {self.frames} frames checked"]
        lines += [f"{result.verdict:>7}  {result.name}: {result.message}" for result in self.results]
        return "\n".join(lines)

    def to_json(self) -> str:
        """The report as JSON; numbers that are not finite are written as text."""
        content: dict[str, Any] = {
            "path": str(self.path),
            "frames": self.frames,
            "frames_checked": self.frames_checked,
            "results": [asdict(result) for result in self.results],
            "notes": self.notes,
            "unfinished": self.unfinished,
            "verdict": self.verdict,
            "ok": self.ok,
        }
        for result in content["results"]:
            for key in ("worst", "time"):
                value = result[key]
                if value is not None and not math.isfinite(value):
                    result[key] = str(value)
        return json.dumps(content, indent=2, allow_nan=False) + "\n"

    def save(self, path: str | Path) -> Path:
        """Write the report as JSON, completely or not at all.

        Raises
        ------
        OutputError : where the file cannot be written.
        """
        path = Path(path)
        with whole_file(path) as fresh:
            fresh.write_text(self.to_json(), encoding="utf-8", newline="\n")
        return path
