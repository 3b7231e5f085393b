"""Serving a page from the shell."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from supple.app.cli.numbers import whole_number

if TYPE_CHECKING:
    from supple.app.viewer.protocol.live_source import LiveSource

Port = Annotated[int | None, Parameter(name="--port", converter=whole_number)]
Open = Annotated[bool, Parameter(name="--open")]


def serve_page(source: LiveSource | Path, port: int | None, open_browser: bool) -> None:
    """Serve a live scene, or the recording at a path, until Ctrl-C.

    A given port must be free; without one, 8080 or the next free port above it is used.

    Raises
    ------
    SuppleError : where the source cannot be shown, or the port cannot be used.
    """
    from supple.app.viewer.app import serve
    from supple.errors import OutputError

    if port is not None and not 0 <= port <= 65535:
        raise OutputError(f"--port is {port}; give a number from 1 to 65535, or 0 for any free one")
    serve(source, port, open_browser=open_browser)
