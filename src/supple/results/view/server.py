"""viser's server on the loopback interface, behind the gate."""

from __future__ import annotations

import asyncio
import contextlib
import io
import logging
import socket
import threading
from collections.abc import Iterator
from typing import Any

from supple.errors import OutputError
from supple.results.view.gate import LARGEST_MESSAGE, Gate, limited

logger = logging.getLogger(__name__)

LOOPBACK = "127.0.0.1"
_one_at_a_time = threading.Lock()


def require_free_port(port: int) -> None:
    """Raise `OutputError` where no server can listen at this port; port 0 is any free one."""
    try:
        with socket.create_server((LOOPBACK, port)):
            pass
    except OSError as error:
        raise OutputError(
            f"cannot serve at {LOOPBACK}, port {port} ({error.strerror or error}); choose another --port"
        ) from None


@contextlib.contextmanager
def gated_server(token: str, port: int = 0) -> Iterator[Any]:
    """A server of viser within this block.

    Parameters
    ----------
    token : the address of the page must contain it, as `?token=...`
    port : where it is in use, the next free one; 0 takes any free port

    Raises
    ------
    OutputError : where all ports are taken, or viser does not serve in the way that the gate protects.
    """
    import viser

    with contextlib.redirect_stdout(io.StringIO()):  # viser prints there
        try:
            with _serving_behind(Gate(token)):
                server = viser.ViserServer(host=LOOPBACK, port=port, verbose=False)
        except OSError as error:
            raise OutputError(f"page: no port is free ({error}); give another one") from None
    try:
        yield server
    finally:
        with contextlib.redirect_stdout(io.StringIO()):
            server.stop()


@contextlib.contextmanager
def _serving_behind(gate: Gate) -> Iterator[None]:
    """A server that viser starts within this block is behind the gate.

    viser serves its page and its websocket with one call of `serve` of `websockets`, which is replaced meanwhile.
    """
    import websockets.asyncio.server as websockets_server

    used = False

    def serve(handler: Any, *arguments: Any, process_request: Any = None, **options: Any) -> Any:
        nonlocal used
        used = True
        asyncio.get_running_loop().set_exception_handler(_log_quietly)
        options["max_size"] = LARGEST_MESSAGE
        options["process_request"] = gate.answering(process_request)
        return original(limited(handler), *arguments, **options)

    with _one_at_a_time:
        original = websockets_server.serve
        websockets_server.serve = serve  # pyright: ignore[reportAttributeAccessIssue]
        try:
            yield
        finally:
            websockets_server.serve = original
    if not used:
        raise OutputError("this version of viser cannot be protected; install viser 1.1")


def _log_quietly(loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
    """Log an error in the handling of one message as one line, without a stack trace."""
    error = context.get("exception")
    logger.warning("the page: %s", f"{type(error).__name__}: {error}" if error else context.get("message"))
