"""One simulation in the shell: recorded, with progress, then a page, a plot, and where they are."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from supple.cli.complain import complain
from supple.cli.exit_codes import ExitCode
from supple.errors import OutputError
from supple.scene.scene import Scene
from supple.simulate import Frame, Sink, simulate
from supple.solver import Solver

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class Products:
    """What a session writes, and how much it says.

    Attributes
    ----------
    folder : for recording.vtkhdf, index.html and plot.png
    page, plot : whether to write the last two; compress : the recording, once it is whole
    quiet : print neither progress nor summary
    scene_text : the scene file's text, kept in the recording
    """

    folder: Path
    page: bool = True
    plot: bool = True
    quiet: bool = False
    compress: bool = False
    scene_text: str | None = None


@dataclass
class Outcome:
    """How a session ended.

    Attributes
    ----------
    code : the shell's exit code
    frames : how many were simulated; last : the last of them; worst_J : the smallest J in any of them
    """

    code: ExitCode = ExitCode.OK
    frames: int = 0
    last: Frame | None = None
    worst_J: float = field(default=float("inf"))


def run_session(
    scene: Scene,
    solver: Solver,
    dt: float,
    steps: int,
    *,
    products: Products,
    start: Mapping[str, Any] | None = None,
    sinks: Sequence[Sink] = (),
) -> Outcome:
    """Simulate, record, and tell.

    Raises
    ------
    SuppleError : where the input, or the place for the output, cannot be used. Whole frames recorded before stay.
    """
    from supple.output.recording.recorder import Recorder

    recording = products.folder / "recording.vtkhdf"
    for path in _wanted(products):
        if path.is_dir():  # told before the simulation, not after
            raise OutputError(f"{path}: is a folder, where a file is to be written; choose another --output")
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
    except KeyboardInterrupt:
        frames.close()
        _tell_of_older(replace(products, page=False, plot=False))
        complain(f"interrupted; {recording} holds the {outcome.frames} frames up to here")
        outcome.code = ExitCode.INTERRUPTED
        return outcome
    if outcome.last is not None and not outcome.last.report.status.can_go_on:
        report = outcome.last.report
        outcome.code = ExitCode.SOLVER
        complain(f"stopped at frame {outcome.last.index} ({report.status}): {report.message}; {recording} is whole")
    _tell_of_older(products)
    _write_products(recording, products)
    if not products.quiet:
        _tell(outcome, recording, products)
    return outcome


def _wanted(products: Products) -> list[Path]:
    """What is written beside the recording."""
    wanted = {"index.html": products.page, "plot.png": products.plot}
    return [products.folder / name for name, is_wanted in wanted.items() if is_wanted]


def _tell_of_older(products: Products) -> None:
    """Say which files beside the new recording show another one."""
    for wanted, name in ((products.page, "index.html"), (products.plot, "plot.png")):
        path = products.folder / name
        if not wanted and path.exists():
            logger.warning("%s shows an earlier run", path)


def _write_products(recording: Path, products: Products) -> None:
    if products.page:
        from supple.output.page import write_page

        write_page(recording, products.folder / "index.html")
    if products.plot:
        from supple.output.plots import plot_recording

        plot_recording(recording, products.folder / "plot.png")


def _tell(outcome: Outcome, recording: Path, products: Products) -> None:
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
    console.print(f"recording  {escape(str(recording))}")
    if products.page:
        console.print(f"page       {escape(str(products.folder / 'index.html'))}")
    if products.plot:
        console.print(f"plot       {escape(str(products.folder / 'plot.png'))}")
