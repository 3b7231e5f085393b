"""The page: a server that displays a live simulation in browsers of this machine."""

from __future__ import annotations

import html
import threading
import webbrowser
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, nullcontext, suppress
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from supple.app.viewer.controls.view.overlay import set_theme
from supple.app.viewer.engine.engine import Engine
from supple.app.viewer.live_page import LivePage
from supple.app.viewer.protocol.live_source import LiveSource
from supple.results.view.gate import new_token
from supple.results.view.server import gated_server, require_free_port

DEFAULT_PORT = 8080


@dataclass(frozen=True, eq=False)
class OpenPage:
    """A page while it is served.

    Attributes
    ----------
    url : for a browser; server : of viser
    content : draws the page
    """

    url: str
    server: Any
    content: LivePage


@contextmanager
def opened_page(
    source: LiveSource, port: int | None = None, again: Callable[[], LiveSource] | None = None
) -> Iterator[OpenPage]:
    """Serve a live scene within a block.

    Parameters
    ----------
    port : 0 takes any free port; None takes 8080, or the next free one
    again : reads the source again, for the button *Reload*; without it, the page lacks that button

    Raises
    ------
    SceneError, SolverError, OutputError : where the source cannot be simulated, or the port is not free.
    """
    if port is not None:
        require_free_port(port)
    with ExitStack() as ends:
        engine = ends.enter_context(Engine(source, again))
        first = engine.latest()
        assert first is not None  # the constructor of the engine waits for it
        token = new_token()
        server = ends.enter_context(gated_server(token, DEFAULT_PORT if port is None else port))
        configure_page(server, source.title)
        content = LivePage(server, engine, first)
        ends.callback(content.stop)
        yield OpenPage(f"http://localhost:{server.get_port()}/?token={token}", server, content)


def serve(
    source: LiveSource,
    port: int | None = None,
    *,
    open_browser: bool = True,
    again: Callable[[], LiveSource] | None = None,
) -> None:
    """Serve a live scene until interrupted; see `opened_page`.

    Raises
    ------
    SceneError, SolverError, OutputError : see `opened_page`.
    """
    with opened_page(source, port, again) as page:
        print(f"{page.url}  (press Ctrl+C to end)", flush=True)
        with browser_at(page.url) if open_browser else nullcontext(), suppress(KeyboardInterrupt):
            threading.Event().wait()


@contextmanager
def browser_at(url: str) -> Iterator[None]:
    """Open a browser at an address with a secret, which the list of processes must not show.

    The browser gets the name of a file that only this user can read; it leads to the address.
    """
    with TemporaryDirectory(prefix="supple-") as folder:
        path = Path(folder) / "open.html"
        path.write_text(
            f'<!doctype html><meta name="referrer" content="no-referrer"><title>Supple</title>'
            f'<meta http-equiv="refresh" content="0; url={html.escape(url)}">',
            encoding="utf-8",
        )
        webbrowser.open(path.as_uri())
        yield


def configure_page(server: Any, title: str) -> None:
    """Configure the page of viser: the panel has the title and is beside the picture, without links of viser."""
    set_theme(server, dark=False)
    server.gui.set_panel_label(title)
    server.gui.main_panel.dock_right()
