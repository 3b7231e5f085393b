"""`check_recording`: every check over every frame, in one pass through the file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from supple.results.check.checks.budgets import Balance, Energy, Momentum, Spin
from supple.results.check.checks.contact import Containment, Distance, Intersection, Obstacles
from supple.results.check.checks.joints import Joints, Welds
from supple.results.check.checks.plain_values import CONSTANTS, Converged, Finite, Sequence
from supple.results.check.checks.records import Records
from supple.results.check.checks.tets import Inversion, RestShape, Rigidity, Volume
from supple.results.check.checks.works import Works
from supple.results.check.frame_check import FrameCheck, skipped
from supple.results.check.report import CheckReport, CheckResult
from supple.results.check.settings import CheckSettings
from supple.results.check.snapshot import Scene, Snapshot
from supple.results.recording.reader import Recording, opened

CHECKS: tuple[type[FrameCheck], ...] = (
    Finite,
    Sequence,
    Converged,
    RestShape,
    Inversion,
    Intersection,
    Obstacles,
    Containment,
    Distance,
    Rigidity,
    Welds,
    Joints,
    Volume,
    Momentum,
    Spin,
    Energy,
    Balance,
    Works,
    Records,
)


def check_recording(
    recording: Recording | str | Path, *, progress: Callable[[int, int], None] | None = None, **settings: Any
) -> CheckReport:
    """Verify a recording, independently of the solver that made it.

    Parameters
    ----------
    recording : an open recording, or its path (.vtkhdf).
    settings : which checks, which frames, and what they allow, such as `only=["inversion"]`, `every=10` or
        `max_energy_gain=0.01`: the parameters of `CheckSettings`; without any, all checks on all frames.
    progress : is called with how many frames were looked at, and how many there are to look at.

    Returns
    -------
    CheckReport : one result for each check; `report.ok`, `report["inversion"].verdict`, `report.save("report.json")`.

    Raises
    ------
    OutputError : where the file cannot be read as a recording, or a setting is unusable.
    """
    wanted = CheckSettings(**settings)
    with opened(recording) as source, np.errstate(all="ignore"):
        scene = Scene(source)
        sound = all(np.isfinite(getattr(source, name)).all() for name in CONSTANTS)
        chosen = [check for check in CHECKS if check.name in wanted.chosen]
        checks = {check.name: check(scene, wanted) for check in chosen if sound or check.sees_all}
        numbers = sorted({*range(0, len(source), wanted.every), len(source) - 1})
        seen = 0
        for done, number in enumerate(numbers):
            at = Snapshot.of(scene, source[number])
            seen += at.finite
            for check in checks.values():
                if check.why_not is None and (at.finite or check.sees_all):
                    check.see(at)
            if progress is not None:
                progress(done + 1, len(numbers))
        results = tuple(_result(check.name, checks.get(check.name), seen) for check in chosen)
        return CheckReport(source.path, len(source), len(numbers), results)


def _result(name: str, check: FrameCheck | None, seen: int) -> CheckResult:
    if check is None:
        return skipped(name, "rest shapes, masses or gravity are not finite")
    if check.needs_frames and seen == 0:
        return skipped(name, "no frame has finite positions and velocities")
    return check.result()
