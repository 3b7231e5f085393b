"""The server of viser, without its messages on standard output and without its public tunnel."""

from __future__ import annotations

import contextlib
import io
from collections.abc import Iterator
from typing import Any

from supple.errors import OutputError


def start_server(host: str, port: int) -> Any:
    """A server of pages on `host`, at `port` or, where that is in use, a higher one; 0 takes any free port.

    Raises
    ------
    OutputError : where there is no free port.
    """
    import viser
    from viser import _messages

    # viser prints to standard output, which is for results of the caller.
    with contextlib.redirect_stdout(io.StringIO()):
        try:
            server = viser.ViserServer(host=host, port=port, verbose=False)
        except OSError as error:
            raise OutputError(f"page: the server found no free port on {host}: {error}; give another port") from None
    # Otherwise any visitor could request a public address for the page.
    for request in (_messages.ShareUrlRequest, _messages.ShareUrlDisconnect):
        with contextlib.suppress(AssertionError):
            server._websock_server.unregister_handler(request)
    return server


def stop_server(server: Any) -> None:
    """Stop it without output."""
    with contextlib.redirect_stdout(io.StringIO()):
        server.stop()


@contextlib.contextmanager
def temporary_server() -> Iterator[Any]:
    """A server without visitors, for drawing a scene that is then written to a page."""
    server = start_server("127.0.0.1", 0)
    try:
        yield server
    finally:
        stop_server(server)
