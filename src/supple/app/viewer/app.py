"""The page: a server that displays a live simulation, or a recording, in browsers."""

from __future__ import annotations

import html
import socket
import threading
import webbrowser
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, nullcontext, suppress
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from supple.app.viewer.engine.engine import Engine
from supple.app.viewer.live_page import LivePage
from supple.app.viewer.protocol.live_source import LiveSource
from supple.app.viewer.replay import Replay
from supple.app.viewer.server.gate import gate, new_token, require_free_port
from supple.app.viewer.server.input_check import guard_inputs
from supple.app.viewer.server.page.served_page import ServedPage
from supple.app.viewer.server.uploads.transfers import refuse_transfers
from supple.results.recording.reader import read_recording
from supple.results.viser_server import start_server, stop_server


@dataclass(frozen=True)
class Address:
    """Where the page is served.

    Attributes
    ----------
    host, port : of the server; port 0 selects any free port
    token : the address must contain it (`?token=...`); None where every program of this machine may use the page
    """

    host: str = "127.0.0.1"
    port: int = 8080
    token: str | None = field(default_factory=new_token)


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
    content: LivePage | Replay


@contextmanager
def opened_page(source: LiveSource | str | Path, address: Address | None = None) -> Iterator[OpenPage]:
    """Serve a live scene, or the recording at a path, within a block.

    Raises
    ------
    SceneError, SolverError, OutputError : where the source cannot be simulated or read, or the port is not free.
    """
    address = Address() if address is None else address
    with ExitStack() as ends:
        if isinstance(source, LiveSource):
            engine = ends.enter_context(Engine(source))
            first = engine.latest()
            assert first is not None  # the constructor of the engine waits for it
            draw = partial(LivePage, simulation=engine, first=first)
        else:
            draw = partial(Replay, recording=ends.enter_context(read_recording(source)))
        require_free_port(address.host, address.port)  # viser would silently use the next port
        with gate(address.host, address.token, ServedPage(title_of(source))):
            server = start_server(address.host, address.port)
        ends.callback(stop_server, server)
        configure_page(server)
        content = draw(server)
        ends.callback(content.stop)
        host = socket.gethostname() if address.host in ("", "0.0.0.0", "::") else address.host
        query = f"/?token={address.token}" if address.token else ""
        yield OpenPage(f"http://{host}:{server.get_port()}{query}", server, content)


def title_of(source: LiveSource | str | Path) -> str:
    """The title of the page: that of a live scene, or the name of a recording or of its folder."""
    if isinstance(source, LiveSource):
        return source.title
    path = Path(source).resolve()
    return path.name if path.is_dir() or path.stem != "recording" else path.parent.name


def serve(source: LiveSource | str | Path, address: Address | None = None, *, open_browser: bool = True) -> None:
    """Serve a live scene, or the recording at a path, until interrupted.

    Raises
    ------
    SceneError, SolverError, OutputError : see `opened_page`.
    """
    with opened_page(source, address) as page:
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


def configure_page(server: Any) -> None:
    """Configure the page of viser: the panel is beside the picture; links and the share button are removed."""
    server.gui.configure_theme(show_logo=False, show_share_button=False, brand_color=(36, 108, 168))
    server.gui.main_panel.dock_right()
    guard_inputs(server)
    refuse_transfers(server)
