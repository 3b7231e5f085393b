"""The page: a server that displays a live simulation in browsers of this machine."""

from __future__ import annotations

import html
import shlex
import sys
import threading
import webbrowser
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from supple.app.viewer.gate import Gate, new_token
from supple.app.viewer.live_page import LivePage
from supple.app.viewer.server import require_free_port, served
from supple.errors import SuppleError
from supple.results.page.client import client

if TYPE_CHECKING:
    from supple.app.viewer.protocol.live_source import LiveSource

DEFAULT_PORT = 8080
_ARRIVES = 10.0  # until a browser that was opened is there [s]


@dataclass(frozen=True, eq=False)
class OpenPage:
    """A page while it is served; it tells that it waits until `simulating`.

    Attributes
    ----------
    url : for a browser; port : of the server
    content : what it shows
    """

    url: str
    port: int
    content: LivePage

    @contextmanager
    def simulating(self, source: LiveSource, again: Callable[[], LiveSource] | None = None) -> Iterator[None]:
        """Show a live scene within a block; see `Engine`.

        Raises
        ------
        SceneError, SolverError : where the source cannot be simulated.
        """
        from supple.app.viewer.engine.engine import Engine

        with Engine(source, again, wait=False) as engine:
            self.content.attach(engine)
            engine.wait_for_start()
            self.content.wait_for_frame()
            yield


@contextmanager
def opened_page(
    title: str, port: int | None = None, *, command: str | None = None, framed: bool = False
) -> Iterator[OpenPage]:
    """Serve a page within a block.

    Parameters
    ----------
    port : 0 takes any free port; None takes 8080, or the next free one
    command : that starts the page again; None: that of the shell
    framed : whether pages of this machine, and VS Code, may show it within themselves, as notebooks do

    Raises
    ------
    OutputError : where the port is not free.
    """
    if port is not None:
        require_free_port(port)
    with ExitStack() as ends:
        token = new_token()
        content = LivePage({"title": title, "command": command or shlex.join(["supple", *sys.argv[1:]])})
        gate = Gate(token, client(title), framed=framed)
        server = ends.enter_context(served(gate, content.visit, DEFAULT_PORT if port is None else port))
        content.start(server)
        ends.callback(content.stop)
        yield OpenPage(f"http://localhost:{server.port}/?token={token}", server.port, content)


def serve(
    read: Callable[[], LiveSource],
    title: str,
    port: int | None = None,
    *,
    open_browser: bool = True,
    reload: bool,
    command: str | None = None,
) -> None:
    """Serve a live scene until interrupted.

    Its address is printed, and opened, before the scene is there; the page tells what it waits for, and errors.

    Parameters
    ----------
    read : the scene; reload : whether the page may have it read again
    port, command : see `opened_page`

    Raises
    ------
    SceneError, SolverError, OutputError : where the scene cannot be read or simulated, or the port is not free.
    """
    with opened_page(title, port, command=command) as page, ExitStack() as ends, suppress(KeyboardInterrupt):
        print(f"{page.url}  (press Ctrl+C to end)", flush=True)
        if open_browser:
            ends.enter_context(browser_at(page.url))
        try:
            with page.content.reading():
                source = read()
            with page.simulating(source, read if reload else None):
                threading.Event().wait()
        except SuppleError as error:
            page.content.fail(str(error), _ARRIVES if open_browser else 0.0)
            raise


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
