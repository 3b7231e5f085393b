"""One simulation in the shell: recording and progress, then a page, a plot and a summary."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from supple.cli.exit_codes import ExitCode
from supple.cli.print_error import print_error
from supple.errors import OutputError
from supple.scene.scene import Scene
from supple.simulate import Frame, Sink, simulate
from supple.state import Status
from supple.system import Solver

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class Products:
    """What a session writes and prints.

    Attributes
    ----------
    folder : for recording.vtkhdf, index.html and plot.png
    page, plot : whether to write the last two; compress : whether to compress the complete recording
    quiet : print neither progress nor summary
    scene_text : the scene file's text, kept in the recording
    """

    folder: Path
    page: bool = True
    plot: bool = True
    quiet: bool = False
    compress: bool = False
    scene_text: str | None = None

    def files(self, *, wanted: bool = True) -> dict[str, Path]:
        """The page and the plot, by name: those that are written, or those that are not."""
        every = {"page": (self.page, "index.html"), "plot": (self.plot, "plot.png")}
        return {name: self.folder / file for name, (is_wanted, file) in every.items() if is_wanted is wanted}


@dataclass
class Outcome:
    """How a session ended.

    Attributes
    ----------
    code : the shell's exit code
    frames : number of simulated frames; last : the last frame; worst_J : the smallest J of all frames
    all_converged : whether every frame did
    """

    code: ExitCode = ExitCode.OK
    frames: int = 0
    last: Frame | None = None
    worst_J: float = field(default=float("inf"))
    all_converged: bool = True


def run_session(
    scene: Scene,
    solver: Solver,
    dt: float,
    steps: int,
    *,
    products: Products,
    start: Mapping[str, Any] | None = None,
    strict: bool = False,
    sinks: Sequence[Sink] = (),
) -> Outcome:
    """Simulate, record, and print a summary.

    Parameters
    ----------
    strict : whether a frame that did not converge is a failure

    Raises
    ------
    SuppleError : where the input or the output folder cannot be used. Frames recorded before are kept.
    """
    from supple.output.recording.recorder import Recorder

    recording = products.folder / "recording.vtkhdf"
    for path in products.files().values():
        if path.is_dir():  # reported before the simulation
            raise OutputError(
                f"{path}: this is a folder, and a file of that name must be written; choose another --output"
            )
    recorder = Recorder(recording, scene_text=products.scene_text, solver=solver, compress=products.compress)
    all_sinks: list[Sink] = [recorder, *sinks]
    if not products.quiet:
        from supple.output.progress import ProgressBar

        all_sinks.append(ProgressBar())
    outcome = Outcome()
    frames = simulate(scene, solver, dt, steps, sinks=all_sinks, **(start or {}))
    try:
        for frame in frames:
            outcome.frames, outcome.last = outcome.frames + 1, frame
            outcome.worst_J = min(outcome.worst_J, frame.report.min_det_F)
            outcome.all_converged &= frame.report.status is Status.CONVERGED
    except KeyboardInterrupt:
        frames.close()
        _warn_of_older_files(replace(products, page=False, plot=False))
        print_error(f"interrupted; {recording} holds the {outcome.frames} frames up to here")
        outcome.code = ExitCode.INTERRUPTED
        return outcome
    if outcome.last is not None and not outcome.last.report.status.can_go_on:
        report = outcome.last.report
        outcome.code = ExitCode.SOLVER
        print_error(
            f"stopped at frame {outcome.last.index} ({report.status}): {report.message}; {recording} is complete"
        )
    elif strict and not outcome.all_converged:
        outcome.code = ExitCode.FAILED
    _warn_of_older_files(products)
    _write_products(recording, products)
    if not products.quiet:
        _print_summary(outcome, recording, products)
    return outcome


def _warn_of_older_files(products: Products) -> None:
    """Warn of files beside the new recording that show an earlier one."""
    for path in products.files(wanted=False).values():
        if path.exists():
            logger.warning("%s shows an earlier run", path)


def _write_products(recording: Path, products: Products) -> None:
    from supple.output.page import write_page
    from supple.output.plots import plot_recording

    writers = {"page": write_page, "plot": plot_recording}
    for name, path in products.files().items():
        writers[name](recording, path)


def _print_summary(outcome: Outcome, recording: Path, products: Products) -> None:
    from rich.markup import escape

    from supple.cli.console import shell_console

    console = shell_console()
    if outcome.last is not None:
        report = outcome.last.report
        energy = report.kinetic_energy + report.elastic_energy + report.potential_energy
        console.print(
            f"{outcome.frames} frames to t = {outcome.last.time:.6g} s ({report.status}); "
            f"smallest J {outcome.worst_J:.4g}; energy {energy:.6g} J"
        )
    for name, path in {"recording": recording, **products.files()}.items():
        console.print(f"{name:<9}  {escape(str(path))}")
