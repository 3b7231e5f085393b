"""A limit for the number of open connections, also of those that have not been checked yet."""

from __future__ import annotations

import asyncio
from typing import Any


def bounded_connections(most: int) -> type[Any]:
    """A connection class for the server of `websockets`: connections beyond `most` are closed immediately.

    Otherwise silent connections could use all files that a process may open. Then nobody could connect, and asyncio
    would fill the log.
    """
    from websockets.asyncio.connection import Connection
    from websockets.asyncio.server import ServerConnection

    class Bounded(ServerConnection):
        count = 0

        def connection_made(self, transport: asyncio.BaseTransport) -> None:
            Bounded.count += 1
            if Bounded.count <= most:
                super().connection_made(transport)
                return
            Connection.connection_made(self, transport)  # without a handler
            assert isinstance(transport, asyncio.Transport)
            transport.abort()

        def connection_lost(self, exc: Exception | None) -> None:
            Bounded.count -= 1
            super().connection_lost(exc)

    return Bounded
