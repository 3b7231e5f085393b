"""`sp.view`: the live page of a scene that a program or a notebook describes."""

from __future__ import annotations

import html
import sys
from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from numpy.typing import ArrayLike

from supple.app.viewer.app import browser_at, opened_page, serve
from supple.app.viewer.protocol.live_source import LiveSource
from supple.errors import OutputError, SceneError, SolverError
from supple.model.system import build_system, initial_state
from supple.scene.scene import Scene
from supple.simulate import check_timing
from supple.solvers.auto import Auto, solver_for
from supple.solvers.solver import Solver

_LEAST, _MOST = 100, 4000  # heights [pixels]


class LiveView:
    """A live page that is open until `close`, or until the program ends; as a context, to the end of its block.

    Attributes
    ----------
    url : its address, with a secret; height : in a notebook [pixels]; engine : the simulation, which takes commands
    """

    def __init__(self, source: LiveSource, port: int | None, height: int, *, framed: bool, open_browser: bool) -> None:
        self.height = height
        with ExitStack() as ends:
            page = ends.enter_context(opened_page(source.title, port, command=_command(), framed=framed))
            if open_browser:
                ends.enter_context(browser_at(page.url))
            ends.enter_context(page.simulating(source))
            self.url, self.engine = page.url, page.content.simulation
            self._ends = ends.pop_all()

    def close(self) -> None:
        """End the simulation and the page; the second time, nothing happens."""
        self._ends.close()

    def __enter__(self) -> LiveView:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"LiveView({self.url})"

    def _repr_html_(self) -> str:
        return (
            f'<iframe src="{html.escape(self.url)}" title="Supple" '
            f'style="width:100%;height:{self.height}px;border:0" allowfullscreen></iframe>'
        )


def view(
    scene: Scene,
    solver: Solver | Auto | None = None,
    dt: float = 1 / 60,
    *,
    initial_positions: Mapping[str, ArrayLike] | None = None,
    full: bool = False,
    block: bool | None = None,
    open_browser: bool | None = None,
    port: int | None = None,
    height: int = 600,
) -> LiveView | None:
    """Show a scene that is simulated live, and can be dragged and tuned, in a browser or a notebook.

    A script prints the address, opens a browser, and waits until Ctrl-C; then it continues. A notebook shows the page
    as the output of the cell, which need not wait. Motions, loads and pressures may be functions of Python: the process
    of the simulation gets a copy of them.

    Parameters
    ----------
    scene, solver : as of `simulate`; dt : time from frame to frame [s].
    initial_positions : by body name, (n, 3) [m], as of `simulate`.
    full : keep meshes and solver as they are, though the scene be slower than real time; without a solver of your own
        and `full`, the page takes what keeps up.
    block : wait until Ctrl-C and return None; otherwise return a `LiveView` with `url` and `close()`. None: wait,
        unless in a notebook.
    open_browser : None: unless in a notebook.
    port : of the server on this machine; None: 8080, or the next free one.
    height : in a notebook [pixels].

    Raises
    ------
    SceneError, SolverError : where the scene cannot be simulated.
    OutputError : where the port cannot be used, or a value is wrong.
    """
    if not isinstance(scene, Scene):
        raise SceneError(f"view: the scene is a {type(scene).__name__}; give a Scene")
    if solver is not None and not isinstance(solver, Solver | Auto):
        raise SolverError(f"view: the solver is {solver!r}; give XPBD(...) or Implicit(...)")
    dt, _ = check_timing("view", dt, 0)
    for name, value in (("block", block), ("open_browser", open_browser), ("full", full)):
        if not isinstance(value, bool | None):
            raise OutputError(f"view: {name} is {value!r}; give True or False")
    for name, value, least, most in (("port", port, 0, 65535), ("height", height, _LEAST, _MOST)):
        wrong = isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most
        if wrong and not (name == "port" and value is None):
            raise OutputError(f"view: {name} is {value!r}; give a whole number from {least} to {most}")
    start = initial_state(scene, initial_positions)  # raises for wrong ones
    chosen = solver if isinstance(solver, Solver) else solver_for(solver or Auto(), build_system(scene, start), dt)
    title = ", ".join(body.name for body in scene.bodies[:3])
    source = LiveSource(title, scene, chosen, dt, dict(initial_positions or {}), not full, chosen is solver)  # pyright: ignore[reportArgumentType]
    notebook = _in_notebook()
    open_browser = not notebook if open_browser is None else open_browser
    if block or (block is None and not notebook):
        serve(lambda: source, title, port, open_browser=open_browser, reload=False, command=_command())
        return None
    return LiveView(source, port, height, framed=notebook, open_browser=open_browser)


def _in_notebook() -> bool:
    """Whether a kernel of Jupyter executes this."""
    ipython: Any = sys.modules.get("IPython")
    shell = None if ipython is None else ipython.get_ipython()
    return shell is not None and hasattr(shell, "kernel")


def _command() -> str:
    """What starts the page again, where it has ended."""
    script = getattr(sys.modules.get("__main__"), "__file__", None)
    return "the cell with sp.view(...)" if _in_notebook() or script is None else f"python {Path(script).name}"
