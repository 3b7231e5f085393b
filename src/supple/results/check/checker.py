"""`check_recording` and `check_series`: every check over every frame, in one pass through the files."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from supple.mesh.io.series.open import open_series
from supple.mesh.io.series.series import Series
from supple.results.check.checks.budgets import Balance, Energy, Momentum, Spin
from supple.results.check.checks.contact import Containment, Distance, Intersection, Obstacles
from supple.results.check.checks.joints import Joints, Welds
from supple.results.check.checks.plain_values import CONSTANTS, Converged, Finite, Sequence
from supple.results.check.checks.records import Records
from supple.results.check.checks.series import Cells, Gaps, Scale
from supple.results.check.checks.tets import Inversion, RestShape, Rigidity, Volume
from supple.results.check.checks.tunnelling import GoingOn, Tunnelling
from supple.results.check.checks.works import Works
from supple.results.check.frame_check import UNKNOWN, FrameCheck, skipped
from supple.results.check.recorded import RecordedTrajectory
from supple.results.check.report import CheckReport, CheckResult, Verdict
from supple.results.check.series import SeriesMetadata, SeriesTrajectory
from supple.results.check.settings import CheckSettings
from supple.results.check.shown import place_of
from supple.results.check.trajectory import Trajectory
from supple.results.recording.reader import Recording, opened

CHECKS: tuple[type[FrameCheck], ...] = (
    Finite,
    Cells,
    Sequence,
    Gaps,
    Scale,
    Converged,
    RestShape,
    Inversion,
    Intersection,
    Tunnelling,
    GoingOn,
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
    progress : is called with how many frames were looked at, and how many there are to look at.
    settings : which checks, which frames, and what they allow, such as `only=["inversion"]`, `every=10` or
        `max_energy_gain=0.01`: the parameters of `CheckSettings`; without any, all checks on all frames.

    Returns
    -------
    CheckReport : one result for each check; `report.ok`, `report["inversion"].verdict`, `report.save("report.json")`.

    Raises
    ------
    OutputError : where the file cannot be read as a recording, or a setting is unusable.
    """
    wanted = CheckSettings(**settings)
    with opened(recording) as source:
        return _checked(RecordedTrajectory(source), wanted, progress)


def check_series(
    series: Series | str | Path,
    given: SeriesMetadata | None = None,
    *,
    progress: Callable[[int, int], None] | None = None,
    **settings: Any,
) -> CheckReport:
    """Verify the frames of any program: whatever their files, and what is given, determine.

    The first frame stands for the shape at rest.

    Parameters
    ----------
    series : an open series, or what it is in: a folder or pattern of meshes, a .pvd, .vtkhdf, USD, .glb or .npz file.
    given : density, material, gravity and time step, as far as they are known.
    progress, settings : as of `check_recording`.

    Returns
    -------
    CheckReport : one result for each check; those that need more than is known are skipped, with the reason.

    Raises
    ------
    MeshError : where the files cannot be read.
    OutputError : where a setting is unusable.
    """
    wanted = CheckSettings(**settings)
    opened_series = series if isinstance(series, Series) else open_series(series)
    return _checked(SeriesTrajectory(opened_series, given or SeriesMetadata()), wanted, progress)


def _checked(source: Trajectory, wanted: CheckSettings, progress: Callable[[int, int], None] | None) -> CheckReport:
    with np.errstate(all="ignore"):
        sound = all(np.isfinite(getattr(source, name)).all() for name in CONSTANTS)
        chosen = [_check_of(name, source.knows) for name in wanted.chosen]
        checks: dict[str, FrameCheck] = {}
        for check in chosen:
            if not check.needs - source.knows and (sound or check.sees_all):
                checks[check.name] = check(source, wanted)
        numbers = sorted({*range(0, len(source), wanted.every), len(source) - 1})
        seen = 0
        for done, number in enumerate(numbers):
            at = source.snapshot(number)
            seen += at.finite
            for check in checks.values():
                usable = at.finite and (at.moves or "times" not in check.needs)
                if check.why_not is None and (usable or check.sees_all):
                    check.add(at)
            if progress is not None:
                progress(done + 1, len(numbers))
        results = tuple(_result(check, checks.get(check.name), seen, source.knows) for check in chosen)
        if "times" not in source.knows:
            results = tuple(replace(result, time=None) for result in results)
        failures = [result for result in results if result.verdict is Verdict.FAIL]
        counts = len(source), len(numbers)
        return CheckReport(source.path, *counts, results, source.notes, place_of(source, failures), source.unfinished)


def _check_of(name: str, knows: frozenset[str]) -> type[FrameCheck]:
    """The check of a name; of several, the first one whose needs are known."""
    named = [check for check in CHECKS if check.name == name]
    return next((check for check in named if not check.needs - knows), named[0])


def _result(kind: type[FrameCheck], check: FrameCheck | None, seen: int, knows: frozenset[str]) -> CheckResult:
    for need in UNKNOWN:
        if need in kind.needs - knows:
            return skipped(kind.name, UNKNOWN[need])
    if check is None:
        return skipped(kind.name, "rest shapes, masses or gravity are not finite")
    if check.needs_frames and seen == 0:
        return skipped(kind.name, "no frame can be used: see the checks that failed")
    return check.result()
