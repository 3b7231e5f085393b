"""`supple resume`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from supple.app.cli.arguments import Steps


def resume(
    folder: Path,
    /,
    *,
    steps: Steps = None,
    quiet: Annotated[bool, Parameter(name=["--quiet", "-q"], negative="")] = False,
) -> int:
    """Resume a run that was interrupted or killed, or add frames to one.

    It continues from its last checkpoint, in the same recording. The frames have the bits of a run that was never
    interrupted.

    Parameters
    ----------
    folder
        The run folder: what was given to `supple run` or `supple demo` as --output.
    steps
        New number of frames of the whole run; without it, the number that was given to the run.
    quiet
        Print neither progress nor summary.
    """
    from supple.app.cli.session import Products, resume_session
    from supple.app.runs.contents import RunPaths
    from supple.app.runs.journal import read_journal

    origin = read_journal(RunPaths(folder).journal).origin
    scene, solver = None, None
    if origin.get("kind") == "demo":
        from supple.app.demos.registry import find_demo

        solver_kind = origin.get("solver")
        demo = find_demo(str(origin.get("name")))
        demo = demo if solver_kind is None else demo.on(solver_kind)
        scene, solver = demo.scene(), demo.solver(solver_kind)
    page, plot = bool(origin.get("page", True)), bool(origin.get("plot", True))
    return resume_session(scene, solver, steps, products=Products(folder, page, plot, quiet)).code
