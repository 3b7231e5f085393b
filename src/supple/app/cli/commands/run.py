"""`supple run`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from supple.app.cli.arguments import ON_THE_WAY, CheckpointEvery, Confine, Overwrite, Seconds, Shell, Steps, Yes

if TYPE_CHECKING:
    from supple.app.scene_file.loader import Run


def run(
    scene: Path,
    /,
    *,
    output: Annotated[Path, Parameter(name=["--output", "-o"])] = Path("out"),
    steps: Steps = None,
    dt: Seconds = None,
    solver: str | None = None,
    shell: Shell = False,
    separate: Annotated[bool, Parameter(negative="")] = False,
    strict: Annotated[bool, Parameter(negative="")] = False,
    page: bool | None = None,
    plot: bool | None = None,
    fields: str | None = None,
    checkpoint_every: CheckpointEvery = ON_THE_WAY,
    confine: Confine = False,
    overwrite: Overwrite = False,
    yes: Yes = False,
    quiet: Annotated[bool, Parameter(name=["--quiet", "-q"], negative="")] = False,
) -> int:
    """Simulate a scene file into a run folder.

    The recording is written while the scene runs, and is always readable up to the last complete frame. After Ctrl-C or
    a kill, `supple resume` continues.

    Parameters
    ----------
    scene
        The scene file (.yaml); `supple schema` describes it. Or a mesh, which falls on a floor. Or a robot (.urdf);
        see docs/learn/robots.md.
    output
        Run folder; it is created where it does not exist, and may not contain an earlier run.
    steps
        Number of frames, instead of the file's.
    dt
        Time from frame to frame [s], instead of the file's; 1/60 may be written as such.
    solver
        Kind of solver, instead of the file's, with its default parameters.
    shell
        Of a mesh: simulate its surface as a thin sheet, such as cloth; it may be open.
    separate
        Move bodies apart that intersect at the start, where a small translation separates them, and print the moves.
    strict
        Exit with code 1 where a frame did not converge: see its status. The recording is complete.
    page
        Write index.html, which plays the recording in a browser; without this, as the scene file specifies.
    plot
        Write plot.png; without this, as the scene file specifies.
    fields
        Fields to record in addition, separated by commas, such as von_mises,contact_force; without this, as the scene
        file specifies. Their cost in bytes is printed before the run.
    checkpoint_every
        Number of frames from checkpoint to checkpoint, or a time such as 30s; 0: only at the start and the end.
        Without this, 100 frames or 30 s, whichever is shorter.
    confine
        Read meshes from the folder of the scene file, and folders below, only: for a file of a stranger.
    overwrite
        Replace an earlier run in the folder.
    yes
        Continue without a question where a mesh needs more than 10 times the tets that were asked for.
    quiet
        Print neither progress nor summary.
    """
    from supple.app.cli.console import reading
    from supple.app.cli.session import Products, run_session
    from supple.app.runs.run_folder import SceneSource
    from supple.app.scene_file.loader import load_run
    from supple.app.scene_file.resolved import resolved_scene
    from supple.solvers.registry import solver_of_kind

    products = Products(output, quiet=quiet, checkpoints=checkpoint_every, overwrite=overwrite)
    products.refuse_a_run()
    with reading(yes):
        described = load_run(scene, confine=confine, shell=shell)
    if separate:
        described = moved_apart(described)
    used = described.solver if solver is None else solver_of_kind(solver)
    dt, steps = described.dt if dt is None else dt, described.steps if steps is None else steps
    page = described.output.page if page is None else page
    plot = described.output.plot if plot is None else plot
    names = described.output.fields if fields is None else [name.strip() for name in fields.split(",") if name.strip()]
    origin = {"kind": "scene_file", "file": str(scene), "separate": separate, "page": page, "plot": plot}
    return run_session(
        described.scene,
        used,
        dt,
        steps,
        start=described.start,
        strict=strict,
        products=replace(products, page=page, plot=plot, compress=described.output.compress, fields=tuple(names)),
        source=SceneSource(origin, described.text, resolved_scene(described, solver=solver, dt=dt, steps=steps)),
    ).code


def moved_apart(described: Run) -> Run:
    """The run with its bodies moved apart; prints each move, also with --quiet.

    Raises
    ------
    SceneError : where small translations do not separate the bodies.
    """
    from rich.markup import escape

    from supple.app.cli.console import shell_console
    from supple.contact.start.separation import separate

    console = shell_console()
    separation = separate(described.scene, initial_positions=described.initial_positions)
    moves = [
        "moved body {!r} by ({:.6g}, {:.6g}, {:.6g}) m".format(move.body, *(move.shift + 0.0))
        for move in separation.moves
    ]
    for line in moves or ["nothing was moved: no surfaces intersect"]:
        console.print(escape(line))
    text = described.text
    if moves and text is not None:
        text = text.rstrip("\n") + "\n" + "".join(f"# supple run --separate {line}\n" for line in moves)
    return replace(described, scene=separation.scene, initial_positions=separation.initial_positions, text=text)
