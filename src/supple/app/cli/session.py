"""One simulation in the shell: run folder and progress, then a page, a plot and a summary."""

from __future__ import annotations

import logging
from collections.abc import Generator, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from supple.app.cli.arguments import ON_THE_WAY, Checkpoints
from supple.app.cli.console import ExitCode, print_error
from supple.app.cli.interrupts import Interrupts
from supple.app.cli.run_estimate import RunEstimate
from supple.app.runs.contents import RunPaths
from supple.app.runs.resume import resume
from supple.app.runs.run_folder import RunFolder, SceneSource
from supple.errors import OutputError
from supple.model.state import Status
from supple.results.frame import Frame
from supple.scene.scene import Scene
from supple.simulate import Sink, simulate
from supple.solvers.auto import Auto
from supple.solvers.solver import Solver

if TYPE_CHECKING:
    from supple.results.progress import ProgressBar

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class Products:
    """What a session writes and prints.

    Attributes
    ----------
    folder : the run folder
    page, plot : whether to write index.html and plot.png to it; compress : whether to compress the complete recording
    fields : to record in addition
    quiet : print neither progress nor summary
    checkpoints : when they are written
    overwrite : replace an earlier run in the folder
    """

    folder: Path
    page: bool = True
    plot: bool = True
    quiet: bool = False
    compress: bool = False
    fields: tuple[str, ...] = ()
    checkpoints: Checkpoints = ON_THE_WAY
    overwrite: bool = False

    def files(self, *, wanted: bool = True) -> dict[str, Path]:
        """The page and the plot, by name: those that are written, or those that are not."""
        every = {"page": (self.page, "index.html"), "plot": (self.plot, "plot.png")}
        return {name: self.folder / file for name, (is_wanted, file) in every.items() if is_wanted is wanted}

    def refuse_a_run(self) -> None:
        """Raise `OutputError` where a new run would replace an earlier one; before the scene is read."""
        paths = RunPaths(self.folder)
        paths.refuse_other_kinds()
        if not self.overwrite:
            paths.refuse_a_run()

    def refuse_folders(self) -> None:
        """Raise `OutputError` where a folder has the name of a file; before the simulation."""
        for path in self.files().values():
            if path.is_dir():
                raise OutputError(
                    f"{path}: this is a folder, and a file of that name must be written; choose another --output"
                )

    def waiting(self) -> AbstractContextManager[object]:
        """Shows in a terminal that the solver prepares the scene."""
        if self.quiet:
            return nullcontext()
        from supple.results.progress import error_console

        return error_console().status("preparing")

    def progress(self) -> list[ProgressBar]:
        """The sink that shows the progress; none where nothing is printed."""
        if self.quiet:
            return []
        from supple.results.progress import ProgressBar

        return [ProgressBar()]


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
    solver: Solver | Auto,
    dt: float,
    steps: int,
    *,
    products: Products,
    source: SceneSource,
    start: Mapping[str, Any] | None = None,
    strict: bool = False,
    sinks: Sequence[Sink] = (),
) -> Outcome:
    """Simulate into a new run folder, and print a summary.

    Parameters
    ----------
    strict : whether a frame that did not converge is a failure

    Raises
    ------
    SuppleError : where the input or the output folder cannot be used. Frames recorded before are kept.
    """
    products.refuse_folders()
    folder = RunFolder(
        products.folder,
        solver,
        checkpoint_every=products.checkpoints.frames,
        checkpoint_seconds=products.checkpoints.seconds,
        overwrite=products.overwrite,
        compress=products.compress,
        fields=products.fields,
        source=source,
    )
    if products.fields and not products.quiet:
        _print_cost(scene, steps, products.fields)
    every = [folder, *sinks, *([] if products.quiet else [_Announcement(), RunEstimate()]), *products.progress()]
    with products.waiting():
        frames = simulate(scene, solver, dt, steps, sinks=every, **(start or {}))
    return _driven(frames, products, strict)


def resume_session(
    scene: Scene | None, solver: Solver | Auto | None, steps: int | None, *, products: Products
) -> Outcome:
    """Resume the run in a folder, and print a summary; see `resume`.

    Raises
    ------
    SuppleError : where the run cannot be resumed, or the folder cannot be used.
    """
    products.refuse_folders()
    return _driven(resume(products.folder, scene, solver, steps=steps, sinks=products.progress()), products)


def _driven(frames: Generator[Frame], products: Products, strict: bool = False) -> Outcome:
    """Run the simulation until its end, or until Ctrl-C; with `strict`, fail where a frame did not converge."""
    outcome = Outcome()
    recording = RunPaths(products.folder).recording
    with Interrupts() as interrupts:
        try:
            for frame in frames:
                outcome.frames, outcome.last = outcome.frames + 1, frame
                outcome.worst_J = min(outcome.worst_J, frame.report.min_det_F)
                outcome.all_converged &= frame.report.status is Status.CONVERGED
                if interrupts.asked:
                    frames.close()
                    outcome.code = ExitCode.INTERRUPTED
        except KeyboardInterrupt:
            frames.close()
            outcome.code = ExitCode.INTERRUPTED
    if outcome.code is ExitCode.INTERRUPTED:
        _warn_of_older_files(replace(products, page=False, plot=False))
        last = "" if outcome.last is None else f" to frame {outcome.last.index}"
        print_error(f"interrupted; {recording} is complete{last}; continue with: supple resume {products.folder}")
        return outcome
    if outcome.last is not None and not outcome.last.report.status.can_go_on:
        outcome.code = ExitCode.SOLVER
    elif strict and not outcome.all_converged:
        outcome.code = ExitCode.FAILED
    _warn_of_older_files(products)
    _write_products(recording, products)
    if not products.quiet:
        _print_summary(outcome, recording, products)
    return outcome


class _Announcement:
    """A sink that prints what is simulated, once the solver has accepted the start."""

    def begin(self, first: Frame, dt: float, steps: int) -> None:
        from rich.markup import escape

        from supple.app.cli.console import shell_console

        bodies, console = first.system.scene.bodies, shell_console()
        tets = sum(len(body.mesh.tets) for body in bodies)
        named = f"{len(bodies)} {'body' if len(bodies) == 1 else 'bodies'}"
        console.print(f"scene      {named}, {tets:,} tets, {steps} frames of {dt:.6g} s")
        assert first.solver is not None
        console.print(f"solver     {escape(first.solver.account)}")

    def write(self, frame: Frame) -> None: ...

    def end(self) -> None: ...


def _print_cost(scene: Scene, steps: int, names: Sequence[str]) -> None:
    """Print what the recorded fields take on the disk, before the simulation begins."""
    from supple.app.cli.console import shell_console
    from supple.results.readings.fields import checked_fields, cost

    vertices, tets = (sum(len(getattr(body.mesh, key)) for body in scene.bodies) for key in ("vertices", "tets"))
    text = cost(checked_fields(names), vertices, tets, steps + 1)
    shell_console().print(f"fields     {text}", highlight=False)


def _warn_of_older_files(products: Products) -> None:
    """Warn of files beside the new recording that show an earlier one."""
    for path in products.files(wanted=False).values():
        if path.exists():
            logger.warning("%s shows an earlier run", path)


def _write_products(recording: Path, products: Products) -> None:
    from supple.results.page.page import write_page
    from supple.results.plots import plot_recording

    writers = {"page": write_page, "plot": plot_recording}
    for name, path in products.files().items():
        writers[name](recording, path)


def _print_summary(outcome: Outcome, recording: Path, products: Products) -> None:
    from rich.markup import escape

    from supple.app.cli.console import shell_console

    console = shell_console()
    if outcome.last is not None:
        report = outcome.last.report
        broken, pairs = len(outcome.last.state.broken_stitches), len(outcome.last.system.scene.stitching)
        energy = report.kinetic_energy + report.elastic_energy + report.potential_energy
        console.print(
            f"{outcome.frames} frames to t = {outcome.last.time:.6g} s ({report.status}); "
            f"smallest J {outcome.worst_J:.4g}; energy {energy:.6g} J"
            + (f"; {broken} of {pairs} stitched pairs have broken" if broken else "")
        )
    for name, path in {"recording": recording, **products.files()}.items():
        console.print(f"{name:<9}  {escape(str(path))}")
