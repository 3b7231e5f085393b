"""A bound on connections that are open at the same time, before anybody has said who he is."""

from __future__ import annotations

import asyncio
from typing import Any


def bounded_connections(most: int) -> type[Any]:
    """A kind of connection for `websockets`' server: those beyond `most` are dropped as soon as they are made.

    Whoever opens connections and says nothing would else use up all files that a process may have open; nobody could
    get in any more, and asyncio would fill the log with it.
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
