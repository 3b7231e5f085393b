"""Serving a page from the shell: address, port and access."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from supple.app.cli.numbers import whole_number

if TYPE_CHECKING:
    from supple.app.viewer.protocol.live_source import LiveSource

DEFAULT_PORT = 8080

Host = Annotated[str, Parameter(name="--host")]
Port = Annotated[int | None, Parameter(name="--port", converter=whole_number)]
Open = Annotated[bool, Parameter(name="--open")]
UseToken = Annotated[bool, Parameter(name="--token")]


def serve_page(source: LiveSource | Path, host: str, port: int | None, open_browser: bool, use_token: bool) -> None:
    """Serve a live scene, or the recording at a path, until Ctrl-C.

    The address of the page contains a secret, unless only this machine can reach it and the user wants none. A given
    port must be free; without one, 8080 or the next free port above it is used.

    Raises
    ------
    SuppleError : where the source cannot be shown, or the address cannot be used.
    """
    from supple.app.viewer.app import Address, serve
    from supple.app.viewer.server.gate import first_free_port, is_loopback, new_token, require_free_port
    from supple.errors import OutputError

    if port is not None and not 0 <= port <= 65535:
        raise OutputError(f"--port is {port}; give a number from 1 to 65535, or 0 for any free one")
    require_free_port(host, port or 0)
    chosen = first_free_port(host, DEFAULT_PORT) if port is None else port
    if not use_token and not is_loopback(host):
        raise OutputError(f"a page at {host} can be reached from other machines and needs its token; remove --no-token")
    serve(source, Address(host, chosen, new_token() if use_token else None), open_browser=open_browser)
