"""Serving a page from the shell: address, port and access."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from supple.cli.numbers import whole_number

if TYPE_CHECKING:
    from supple.viewer.protocol.live_source import LiveSource

DEFAULT_PORT = 8080

Host = Annotated[str, Parameter(name="--host")]
Port = Annotated[int | None, Parameter(name="--port", converter=whole_number)]
Open = Annotated[bool, Parameter(name="--open")]


def serve_page(source: LiveSource | Path, host: str, port: int | None, open_browser: bool) -> None:
    """Serve a live scene, or the recording at a path, until Ctrl-C.

    If other machines can reach the page, its address contains a secret. A given port must be free; without one, 8080 or
    the next free port above it is used.

    Raises
    ------
    SuppleError : where the source cannot be shown, or the address cannot be used.
    """
    from supple.errors import OutputError
    from supple.viewer.app import Address, serve
    from supple.viewer.server.gate import first_free_port, is_loopback, new_token, require_free_port

    if port is not None and not 0 <= port <= 65535:
        raise OutputError(f"--port is {port}; give a number from 1 to 65535, or 0 for any free one")
    require_free_port(host, port or 0)
    chosen = first_free_port(host, DEFAULT_PORT) if port is None else port
    token = None if is_loopback(host) else new_token()
    serve(source, Address(host, chosen, token), open_browser=open_browser)
