"""`supple check`."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from supple.app.cli.arguments import Seconds, Steps, Vector, recording_at
from supple.app.cli.console import ExitCode

if TYPE_CHECKING:
    from supple.results.check.report import CheckReport

Names = Annotated[list[str] | None, Parameter(negative="", consume_multiple=False)]
Flag = Annotated[bool, Parameter(negative="")]


def check(
    path: Path,
    /,
    *more: Path,
    every: Steps = None,
    only: Names = None,
    skip: Names = None,
    max_volume_change: float | None = None,
    max_orthogonality_error: float | None = None,
    max_energy_gain: float | None = None,
    max_momentum_change: float | None = None,
    density: float | None = None,
    youngs: float | None = None,
    poisson: float | None = None,
    law: str | None = None,
    gravity: Vector = None,
    dt: Seconds = None,
    fps: float | None = None,
    free: Flag = False,
    json: Path | None = None,
    picture: Path | None = None,
    quiet: Annotated[bool, Parameter(name=["--quiet", "-q"], negative="")] = False,
) -> ExitCode:
    """Verify the frames of any program, or a recording, independently of the solver that wrote it.

    Exit code 0: all checks passed, 1: one failed, 2: the files cannot be read.

    Parameters
    ----------
    path
        A recording (.vtkhdf) or the folder of its run. Of other programs: a folder or pattern of meshes, one for each
        frame; a .pvd, .npz, .vtkhdf, USD or .glb file; a folder with positions.npy.
    more
        Further files of the same series, as the shell expands a pattern.
    every
        Check every k-th frame and the last one.
    only
        Run only the check of this name; may be given several times.
    skip
        Omit the check of this name; may be given several times.
    max_volume_change
        Largest relative change of a body's volume. Without it: 0.5 where Poisson's ratio is 0.45 or more, unlimited
        below, 0.005 where the material is not known.
    max_orthogonality_error
        Largest |F^T F - 1| of a rigid body; 0.01 without it.
    max_energy_gain
        Largest relative growth of the energy where no external work is done; 0.05 without it.
    max_momentum_change
        Largest relative change of momenta without an external force; 1e-6 without it, 1e-3 of a series.
    density
        Of a series [kg/m^3].
    youngs
        Young's modulus of a series [Pa].
    poisson
        Poisson's ratio of a series.
    law
        Of the elastic energy of a series: stable_neo_hookean (without it), neo_hookean, fixed_corotated or
        st_venant_kirchhoff.
    gravity
        Of a series, three numbers [m/s^2].
    dt
        From frame to frame of a series, in seconds, where its files have no times.
    fps
        Frames per second of a series, instead of dt.
    free
        Nothing but gravity acts on the parts of the series: momentum is checked.
    json
        Write the results to this file.
    picture
        Draw the place of the first failure to this file (.png, .pdf or .svg).
    quiet
        Print only failed checks.
    """
    from supple.errors import OutputError
    from supple.results.check.series import SeriesMetadata
    from supple.results.check.settings import CheckSettings
    from supple.runtime.replacing import refuse_to_replace

    values = locals()
    if fps is not None:
        if dt is not None or not fps > 0.0:
            raise OutputError(f"check: fps is {fps}; give a number above zero, or dt, not both")
        values["dt"] = 1.0 / fps
    settings, given = (
        {field.name: values[field.name] for field in fields(kind) if values.get(field.name) is not None}
        for kind in (CheckSettings, SeriesMetadata)
    )
    if not free:
        del given["free"]
    CheckSettings(**settings)
    for output in (json, picture):
        if output is not None:
            for item in (path, *more):
                refuse_to_replace(item, output)
    report = _report((path, *more), given, settings)
    if json is not None:
        report.save(json)
    if picture is not None and report.place is not None:
        from supple.results.check.shown import draw

        draw(report.place, picture)
    if not quiet or not report.ok:
        _print(report, only_failures=quiet)
    return ExitCode.OK if report.ok else ExitCode.FAILED


def _report(paths: tuple[Path, ...], given: dict[str, Any], settings: dict[str, Any]) -> CheckReport:
    from supple.errors import OutputError
    from supple.mesh.io.series.open import open_series
    from supple.results.check.checker import check_recording, check_series
    from supple.results.check.series import SeriesMetadata
    from supple.results.recording.checked_hdf5 import is_of_another_program

    folder = paths[0].is_dir() and not (paths[0] / "recording.vtkhdf").exists()
    if (
        len(paths) == 1
        and not folder
        and paths[0].suffix.lower() in ("", ".vtkhdf")
        and not is_of_another_program(paths[0])
    ):
        if given:
            raise OutputError(f"{paths[0]}: a recording contains its {next(iter(given))}; omit the option")
        return check_recording(recording_at(paths[0]), **settings)
    return check_series(open_series(*paths), SeriesMetadata(**given), **settings)


def _print(report: CheckReport, *, only_failures: bool) -> None:
    from rich.markup import escape
    from rich.table import Table

    from supple.app.cli.console import ShellConsole
    from supple.results.check.report import Verdict

    colors = {Verdict.PASS: "green", Verdict.FAIL: "bold red", Verdict.SKIPPED: "dim"}
    console = ShellConsole()
    console.print(f"[{colors[Verdict.PASS if report.ok else Verdict.FAIL]}]{escape(report.verdict)}[/]", soft_wrap=True)
    table = Table(box=None, pad_edge=False)
    table.add_column("check", style="bold", no_wrap=True)
    table.add_column("verdict", no_wrap=True)
    table.add_column("found", overflow="fold")
    table.add_column("frame", justify="right", no_wrap=True)
    table.add_column("time [s]", justify="right", no_wrap=True)
    for result in report.results:
        if result.verdict is Verdict.SKIPPED or (only_failures and result.verdict is not Verdict.FAIL):
            continue
        table.add_row(
            result.name,
            f"[{colors[result.verdict]}]{result.verdict}[/]",
            escape(result.message),
            "" if result.frame is None else str(result.frame),
            "" if result.time is None else f"{result.time:.6g}",
        )
    console.print(table)
    if only_failures:
        return
    for why, names in report.skipped.items():
        console.print(f"[dim]skipped[/]  [bold]{escape(', '.join(names))}[/]: {escape(why)}", soft_wrap=True)
    for note in report.notes:
        console.print(f"[dim]note[/]  {escape(note)}", soft_wrap=True)
