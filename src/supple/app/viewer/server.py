"""The server of a page on the loopback interface, behind the gate, in a thread of its own."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import socket
import threading
from collections.abc import Awaitable, Callable, Iterator
from typing import Any

from supple.app.viewer.gate import LARGEST_MESSAGE, Gate
from supple.errors import OutputError

logger = logging.getLogger(__name__)

LOOPBACK = "127.0.0.1"
_PORTS = 200  # that are tried from the first one


def require_free_port(port: int) -> None:
    """Raise `OutputError` where no server can listen at this port; port 0 is any free one."""
    try:
        with socket.create_server((LOOPBACK, port)):
            pass
    except OSError as error:
        raise OutputError(
            f"cannot serve at {LOOPBACK}, port {port} ({error.strerror or error}); choose another --port"
        ) from None


class PageServer:
    """A running server.

    Attributes
    ----------
    port : at which it listens; loop : of its thread
    """

    def __init__(self, port: int, loop: asyncio.AbstractEventLoop) -> None:
        self.port, self.loop = port, loop

    def soon(self, act: Callable[..., object], *arguments: Any) -> None:
        """Call a function in the thread of the server; nothing happens where it has ended."""
        with contextlib.suppress(RuntimeError):
            self.loop.call_soon_threadsafe(act, *arguments)


@contextlib.contextmanager
def served(gate: Gate, visit: Callable[[Any], Awaitable[None]], port: int = 0) -> Iterator[PageServer]:
    """A server within this block.

    Parameters
    ----------
    visit : is called in the thread of the server with each websocket that passed the gate
    port : where it is in use, the next free one; 0 takes any free port

    Raises
    ------
    OutputError : where all ports are taken.
    """
    started, ended = threading.Event(), asyncio.Event()
    made: list[PageServer | OSError] = []

    async def run() -> None:
        asyncio.get_running_loop().set_exception_handler(_log_quietly)
        try:
            server = await _listening(gate, visit, port)
        except OSError as error:
            made.append(error)
            started.set()
            return
        made.append(PageServer(next(iter(server.sockets)).getsockname()[1], asyncio.get_running_loop()))
        started.set()
        await ended.wait()
        server.close()
        await server.wait_closed()

    thread = threading.Thread(target=asyncio.run, args=(run(),), name="page server", daemon=True)
    thread.start()
    started.wait()
    server = made[0]
    if isinstance(server, OSError):
        raise OutputError(f"page: no port is free ({server}); give another one")
    try:
        yield server
    finally:
        server.soon(ended.set)
        thread.join()


async def _listening(gate: Gate, visit: Callable[[Any], Awaitable[None]], port: int) -> Any:
    from websockets.asyncio.server import serve

    async def handle(connection: Any) -> None:
        try:
            await visit(connection)
        except Exception as error:
            logger.warning("a browser was disconnected: %s: %s", type(error).__name__, error)
            await connection.close(1011, "an error of the server")

    quiet = logging.getLogger(f"{__name__}.connections")  # of those that fail, it writes stack traces
    quiet.setLevel(logging.CRITICAL)
    last = port + _PORTS if port else 0
    while True:
        try:
            options = {"process_request": gate.answer, "max_size": LARGEST_MESSAGE, "compression": None}
            return await serve(handle, LOOPBACK, port, logger=quiet, **options)
        except OSError:
            if port >= min(last, 65535):
                raise
            port += 1


def _log_quietly(loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
    """Log an error in the handling of one message as one line, without a stack trace."""
    error = context.get("exception")
    logger.warning("the page: %s", f"{type(error).__name__}: {error}" if error else context.get("message"))
