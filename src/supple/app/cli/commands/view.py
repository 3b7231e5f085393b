"""`supple view`."""

from __future__ import annotations

import webbrowser
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from supple.app.cli.arguments import Shell, Yes, exported, recording_at, whole_number

if TYPE_CHECKING:
    from supple.app.viewer.protocol.live_source import LiveSource

Port = Annotated[int | None, Parameter(name="--port", converter=whole_number)]
Full = Annotated[bool, Parameter(name="--full", negative="")]
Open = Annotated[bool, Parameter(name="--open")]

SCENE_FILES = (".yaml", ".yml", ".urdf", ".xacro")
RECORDINGS = (".vtkhdf", ".hdf", ".h5")


def view(
    source: Path,
    /,
    *more: Path,
    solver: str | None = None,
    shell: Shell = False,
    full: Full = False,
    port: Port = None,
    open_: Open = True,
    confine: bool = True,
    yes: Yes = False,
) -> None:
    """Show a scene that is simulated live and can be dragged and tuned, or a recording, in a browser.

    A live page runs until Ctrl-C. Only this machine can open it, at an address that contains a secret; from another
    one, use `ssh -L`. A recording is written to an HTML file beside it, which plays by itself.

    Parameters
    ----------
    source
        A scene file (.yaml), a surface (.stl, .obj ...), a robot (.urdf), or a recording (.vtkhdf, or the folder that
        holds it). The button *Reload* of the page reads the file again.
    more
        Further surfaces: their bodies stand beside the first one.
    solver
        Kind of solver, instead of the file's, with its default parameters.
    shell
        Of a surface: simulate it as a thin sheet, such as cloth; it may be open.
    full
        Simulate with the meshes and the solver as they are. Without this, a scene that would be slower than real time
        gets meshes of fewer tets on the page, with the same skins, or another solver unless --solver is given.
    port
        Port to serve at; without it, 8080 or the next free one.
    open_
        Open the page in a browser.
    confine
        Read meshes from the folder of the scene file, and folders below, only.
    yes
        Continue without a question where a mesh needs more than 10 times the tets that were asked for.
    """
    from supple.app.cli.console import reading

    paths = [find_source(path) for path in (source, *more)]
    recordings = [path for path in paths if path.suffix.lower() in RECORDINGS]
    if recordings:
        given = {"--solver": solver is not None, "--port": port is not None, "--full": full, "--shell": shell}
        given |= {"another file": bool(more)}
        show_recording(recordings[0], [name for name, value in given.items() if value], open_)
        return

    title = ", ".join(path.stem for path in paths)

    def read() -> LiveSource:  # imports most of the library: the page is there before
        from supple.app.scene_file.several_meshes import load_run_of
        from supple.app.viewer.protocol.live_source import LiveSource
        from supple.solvers.registry import solver_of_kind

        with reading(yes):
            run = load_run_of(paths, confine=confine, shell=shell)
        if solver is not None:
            run = replace(run, solver=solver_of_kind(solver))
        used = run.chosen_solver
        if used.because:
            print(f"solver {used.kind}: {used.because}")
        return LiveSource(title, run.scene, used, run.dt, run.initial_positions, not full, solver is not None)

    serve_page(read, title, port, open_, reload=True)


def show_recording(path: Path, unused: list[str], open_browser: bool) -> None:
    """Write the page of a recording beside it, print where, and open it.

    Raises
    ------
    OutputError : where options are given that a recording does not use, or the page cannot be written.
    """
    from supple.errors import OutputError

    if unused:
        raise OutputError(f"{path} is a recording, whose page is one file; leave out {' and '.join(unused)}")
    page = exported(path, "html", None)
    print(page)
    if open_browser:
        webbrowser.open(page.resolve().as_uri())


def find_source(path: Path) -> Path:
    """The scene file or recording at a path, which may be a folder.

    Raises
    ------
    OutputError : where the file does not exist.
    """
    from supple.errors import OutputError

    path = recording_at(path)
    if not path.exists():
        raise OutputError(f"{path}: the file does not exist")
    suffix = path.suffix.lower()
    if suffix not in (*SCENE_FILES, *RECORDINGS) and suffix not in _mesh_files():
        raise OutputError(f"{path} is neither a scene file (.yaml), nor a mesh, nor a recording (.vtkhdf)")
    return path


def _mesh_files() -> tuple[str, ...]:
    from supple.app.scene_file.entries.mesh_sources import MESH_FILES  # takes long

    return MESH_FILES


def serve_page(
    read: Callable[[], LiveSource], title: str, port: int | None, open_browser: bool, *, reload: bool = False
) -> None:
    """Serve a live scene until Ctrl-C.

    A given port must be free; without one, 8080 or the next free port above it is used.

    Parameters
    ----------
    read : the scene; reload : whether the page has the button *reload*, which reads it again

    Raises
    ------
    SuppleError : where the source cannot be read or shown, or the port cannot be used.
    """
    from supple.app.viewer.app import serve
    from supple.errors import OutputError

    if port is not None and not 0 <= port <= 65535:
        raise OutputError(f"--port is {port}; give a number from 1 to 65535, or 0 for any free one")
    serve(read, title, port, open_browser=open_browser, reload=reload)
