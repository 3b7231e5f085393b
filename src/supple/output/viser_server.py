"""viser's server, without its greetings and without its tunnel to the public."""

from __future__ import annotations

import contextlib
import io
from collections.abc import Iterator
from typing import Any

from supple.errors import OutputError


def start_server(host: str, port: int) -> Any:
    """A server of pages on `host`, at `port` or, where that is taken, a higher one; 0 takes any that is free.

    Raises
    ------
    OutputError : where there is no port to be had.
    """
    import viser
    from viser import _messages

    # viser greets on standard output, which belongs to whoever called us.
    with contextlib.redirect_stdout(io.StringIO()):
        try:
            server = viser.ViserServer(host=host, port=port, verbose=False)
        except OSError as error:
            raise OutputError(f"page: the server needs a port on {host} and got none: {error}") from None
    # Any visitor could else ask for an address through which the whole world sees the page.
    for request in (_messages.ShareUrlRequest, _messages.ShareUrlDisconnect):
        with contextlib.suppress(AssertionError):
            server._websock_server.unregister_handler(request)
    return server


def stop_server(server: Any) -> None:
    """Stop it, quietly."""
    with contextlib.redirect_stdout(io.StringIO()):
        server.stop()


@contextlib.contextmanager
def server_for_a_moment() -> Iterator[Any]:
    """A server that nobody is meant to visit: to draw on, and to take the drawing from."""
    server = start_server("127.0.0.1", 0)
    try:
        yield server
    finally:
        stop_server(server)
