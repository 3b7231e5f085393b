"""`supple demo`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from supple.app.cli.arguments import ON_THE_WAY, CheckpointEvery, Overwrite, Steps
from supple.app.cli.commands.view import Full, Open, Port
from supple.app.cli.console import ExitCode


def demo(
    name: str | None = None,
    /,
    *,
    list_: Annotated[bool, Parameter(name=["--list", "-l"], negative="")] = False,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    steps: Steps = None,
    solver: str | None = None,
    page: bool = True,
    plot: bool = True,
    checkpoint_every: CheckpointEvery = ON_THE_WAY,
    overwrite: Overwrite = False,
    quiet: Annotated[bool, Parameter(name=["--quiet", "-q"], negative="")] = False,
    live: Annotated[bool, Parameter(name="--live", negative="")] = False,
    full: Full = False,
    port: Port = None,
    open_: Open = True,
) -> int:
    """Run a named demo, record it, and measure what it claims. Exit code 0: all claims hold, 1: one does not.

    Parameters
    ----------
    name
        Name of the demo; without it, the demos are listed.
    list_
        List the demos.
    output
        Run folder, which may not contain an earlier run; without it, out/NAME.
    steps
        Number of frames, instead of the demo's own. Claims that need more frames do not hold then.
    solver
        Kind of solver, xpbd or implicit, for a demo that has both.
    page
        Write index.html, which plays the recording in a browser.
    plot
        Write plot.png: energies, momentum, volume ratio and smallest J over time.
    checkpoint_every
        Number of frames from checkpoint to checkpoint, or a time such as 30s; 0: only at the start and the end.
        Without this, 100 frames or 30 s, whichever is shorter.
    overwrite
        Replace an earlier run in the folder.
    quiet
        Print only the claims and what was measured.
    live
        Show the scene in a browser while it runs, until Ctrl-C, so that it can be dragged and tuned. Nothing is
        recorded.
    full
        With --live: simulate with the meshes and the solver as they are, also where that is slower than real time.
    port
        With --live: port to serve at; without it, 8080 or the next free one.
    open_
        With --live: open the page in a browser.
    """
    from rich.markup import escape

    from supple.app.cli.console import shell_console
    from supple.app.demos.registry import DEMOS, find_demo

    console = shell_console()
    if list_ or name is None:
        width = max(map(len, DEMOS))
        for known in DEMOS.values():
            console.print(f"[bold]{known.name:<{width}}[/]  {escape(known.summary)}")
        return ExitCode.OK

    chosen = find_demo(name)
    if solver is not None:
        chosen = chosen.on(solver)
    if live:
        from supple.app.cli.commands.view import serve_page
        from supple.app.viewer.protocol.live_source import LiveSource

        def read() -> LiveSource:
            used = chosen.solver(solver)
            return LiveSource(chosen.name, chosen.scene(), used, chosen.dt, {}, not full, solver is not None)

        serve_page(read, chosen.name, port, open_)
        return ExitCode.OK

    from supple.app.cli.session import Products, run_session
    from supple.app.runs.run_folder import SceneSource

    products = Products(
        Path("out") / chosen.name if output is None else output,
        page,
        plot,
        quiet,
        checkpoints=checkpoint_every,
        overwrite=overwrite,
    )
    products.refuse_a_run()
    used = chosen.solver(solver)
    measurement = chosen.measurement()
    if not quiet:
        console.print(f"[bold]{chosen.name}[/]: {escape(chosen.explanation)}")
    outcome = run_session(
        chosen.scene(),
        used,
        chosen.dt,
        chosen.steps if steps is None else steps,
        products=products,
        source=SceneSource({"kind": "demo", "name": name, "solver": solver, "page": page, "plot": plot}),
        sinks=[measurement],
    )
    claims = measurement.claims() if outcome.frames else []
    for claim in claims:
        mark = "[green]holds[/]" if claim.holds else "[red]does not hold[/]"
        console.print(f"{mark}: {escape(claim.text)} ({escape(claim.measured)})")
    failed = outcome.code is ExitCode.OK and not all(claim.holds for claim in claims)
    return ExitCode.FAILED if failed else outcome.code
