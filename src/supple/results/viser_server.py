"""The server of viser, without its messages on standard output and without its public tunnel; and how it serves."""

from __future__ import annotations

import contextlib
import http
import io
import threading
from collections.abc import Callable, Iterator
from typing import Any

from supple.errors import OutputError

_one_at_a_time = threading.Lock()


@contextlib.contextmanager
def serving_with(changed: Callable[[Callable[..., Any]], Callable[..., Any]]) -> Iterator[None]:
    """A server that viser starts within this block serves with `changed(serve)`.

    viser serves its page and its websocket with one call of `serve` of `websockets`, which is replaced meanwhile.

    Raises
    ------
    OutputError : where viser has started none that way, so that nothing protects it.
    """
    import websockets.asyncio.server as websockets_server

    used = False

    def serve(*arguments: Any, **options: Any) -> Any:
        nonlocal used
        used = True
        return changed(original)(*arguments, **options)

    with _one_at_a_time:
        original = websockets_server.serve
        websockets_server.serve = serve  # pyright: ignore[reportAttributeAccessIssue]
        try:
            yield
        finally:
            websockets_server.serve = original
    if not used:
        raise OutputError("this version of viser cannot be protected; install viser 1.1")


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
    """A server that refuses all visitors, for drawing a scene that is then written to a page."""
    with serving_with(_refusing):
        server = start_server("127.0.0.1", 0)
    try:
        yield server
    finally:
        stop_server(server)


def _refusing(serve: Callable[..., Any]) -> Callable[..., Any]:
    """`serve` for a server that answers every request with 403."""

    def refuse(connection: Any, request: Any) -> Any:
        return connection.respond(http.HTTPStatus.FORBIDDEN, "Supple: this server only writes a page\n")

    def changed(*arguments: Any, process_request: Any = None, **options: Any) -> Any:
        return serve(*arguments, process_request=refuse, **options)

    return changed
