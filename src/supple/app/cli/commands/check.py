"""`supple check`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from supple.app.cli.arguments import Steps, recording_at
from supple.app.cli.console import ExitCode

if TYPE_CHECKING:
    from supple.results.check.report import CheckReport

Names = Annotated[list[str] | None, Parameter(negative="", consume_multiple=False)]


def check(
    recording: Path,
    /,
    *,
    every: Steps = None,
    only: Names = None,
    skip: Names = None,
    max_volume_change: float | None = None,
    max_orthogonality_error: float | None = None,
    max_energy_gain: float | None = None,
    max_momentum_change: float | None = None,
    json: Path | None = None,
    quiet: Annotated[bool, Parameter(name=["--quiet", "-q"], negative="")] = False,
) -> ExitCode:
    """Verify a recording, independently of the solver that wrote it. Exit code 0: all checks passed, 1: one failed.

    Parameters
    ----------
    recording
        The recording (.vtkhdf), or the folder of its run.
    every
        Check every k-th frame and the last one.
    only
        Run only the check of this name; may be given several times.
    skip
        Omit the check of this name; may be given several times.
    max_volume_change
        Largest relative change of a body's volume. Without it: 0.5 where Poisson's ratio is 0.45 or more, otherwise
        unlimited.
    max_orthogonality_error
        Largest |F^T F - 1| of a rigid body; 0.01 without it.
    max_energy_gain
        Largest relative growth of the energy where no external work is done; 0.05 without it.
    max_momentum_change
        Largest relative change of momenta without an external force; 1e-6 without it.
    json
        Write the results to this file.
    quiet
        Print only failed checks.
    """
    from supple.results.check.checker import check_recording
    from supple.runtime.replacing import refuse_to_replace

    given = {
        "every": every,
        "only": only,
        "skip": skip,
        "max_volume_change": max_volume_change,
        "max_orthogonality_error": max_orthogonality_error,
        "max_energy_gain": max_energy_gain,
        "max_momentum_change": max_momentum_change,
    }
    recording = recording_at(recording)
    if json is not None:
        refuse_to_replace(recording, json)
    report = check_recording(recording, **{key: value for key, value in given.items() if value is not None})
    if json is not None:
        report.save(json)
    if not quiet or not report.ok:
        _print(report, only_failures=quiet)
    return ExitCode.OK if report.ok else ExitCode.FAILED


def _print(report: CheckReport, *, only_failures: bool) -> None:
    from rich.markup import escape
    from rich.table import Table

    from supple.app.cli.console import ShellConsole
    from supple.results.check.report import Verdict

    colors = {Verdict.PASS: "green", Verdict.FAIL: "bold red", Verdict.SKIPPED: "dim"}
    checked = "all" if report.frames == report.frames_checked else f"{report.frames_checked} of"
    title = escape(f"{report.path}: {checked} {report.frames} frames checked")
    table = Table(title=title, title_justify="left", box=None, pad_edge=False)
    table.add_column("check", style="bold", no_wrap=True)
    table.add_column("verdict", no_wrap=True)
    table.add_column("found", overflow="fold")
    table.add_column("frame", justify="right", no_wrap=True)
    table.add_column("time [s]", justify="right", no_wrap=True)
    for result in report.results:
        if only_failures and result.verdict is not Verdict.FAIL:
            continue
        table.add_row(
            result.name,
            f"[{colors[result.verdict]}]{result.verdict}[/]",
            escape(result.message),
            "" if result.frame is None else str(result.frame),
            "" if result.time is None else f"{result.time:.6g}",
        )
    ShellConsole().print(table)
