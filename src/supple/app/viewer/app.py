"""The page: a server that displays a live simulation in browsers of this machine."""

from __future__ import annotations

import html
import shlex
import sys
import threading
import webbrowser
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, nullcontext, suppress
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from supple.app.viewer.engine.engine import Engine
from supple.app.viewer.gate import Gate, new_token
from supple.app.viewer.live_page import LivePage
from supple.app.viewer.protocol.live_source import LiveSource
from supple.app.viewer.server import require_free_port, served
from supple.results.page.page import client

DEFAULT_PORT = 8080


@dataclass(frozen=True, eq=False)
class OpenPage:
    """A page while it is served.

    Attributes
    ----------
    url : for a browser; port : of the server
    content : what it shows
    """

    url: str
    port: int
    content: LivePage


@contextmanager
def opened_page(
    source: LiveSource, port: int | None = None, again: Callable[[], LiveSource] | None = None
) -> Iterator[OpenPage]:
    """Serve a live scene within a block.

    Parameters
    ----------
    port : 0 takes any free port; None takes 8080, or the next free one
    again : reads the source again, for the button *reload*; without it, the page lacks that button

    Raises
    ------
    SceneError, SolverError, OutputError : where the source cannot be simulated, or the port is not free.
    """
    if port is not None:
        require_free_port(port)
    with ExitStack() as ends:
        token = new_token()
        gate = Gate(token, client(source.title))
        engine = ends.enter_context(Engine(source, again))
        command = shlex.join(["supple", *sys.argv[1:]])
        content = LivePage(engine, {"title": source.title, "command": command})
        server = ends.enter_context(served(gate, content.visit, DEFAULT_PORT if port is None else port))
        content.start(server)
        ends.callback(content.stop)
        yield OpenPage(f"http://localhost:{server.port}/?token={token}", server.port, content)


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
