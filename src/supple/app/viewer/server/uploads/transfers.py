"""Receives files from browsers, instead of viser.

viser accepts files of any size for any input, keeps their parts in memory, and informs all visitors about each part.
This module accepts only files for the upload button, within limits, and informs only the visitor who sends them.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from supple.app.viewer.protocol import limits
from supple.errors import CommandError

# Called with the visitor (a handle of viser), the name of the file, its suffix and its content.
Accepted = Callable[[Any, str, str, bytes], None]


@dataclass
class _Transfer:
    """One file: what the browser announced, and what was received."""

    number: str
    name: str
    suffix: str
    size: int
    parts: int
    last: float
    came: list[bytes] = field(default_factory=list)


def refuse_transfers(server: Any) -> None:
    """Ignore all uploads, which viser would accept."""
    from viser import _messages

    handlers = server._websock_server._incoming_handlers
    for kind in (_messages.FileTransferStartUpload, _messages.FileTransferPart):
        handlers[kind] = []


class Transfers:
    """Receives the files of one upload button.

    Parameters
    ----------
    server : of viser; button : its handle
    accepted : called with each complete file, in the loop of the server; must not wait
    rejected : called with the visitor and the reason
    """

    def __init__(self, server: Any, button: Any, accepted: Accepted, rejected: Callable[[Any, str], None]) -> None:
        from viser import _messages

        self._server, self._button, self._accepted, self._rejected = server, button, accepted, rejected
        self._running: dict[Any, _Transfer] = {}  # by visitor, one each
        handlers = server._websock_server._incoming_handlers
        handlers[_messages.FileTransferStartUpload] = [self._begin]
        handlers[_messages.FileTransferPart] = [self._go_on]
        server.on_client_disconnect(lambda client: self._running.pop(client.client_id, None))

    def _begin(self, visitor: Any, message: Any) -> None:
        client = self._server.get_clients().get(visitor)
        if client is None or message.source_component_uuid != self._button._impl.uuid:
            return
        try:
            self._running[visitor] = self._announced(visitor, message)
        except CommandError as error:
            self._answer(client, message.transfer_uuid, message.size_bytes, message.size_bytes)
            self._rejected(client, str(error))

    def _announced(self, visitor: Any, message: Any) -> _Transfer:
        """The transfer that a message announces; raises `CommandError` where it is not accepted."""
        now = time.monotonic()
        for other, transfer in list(self._running.items()):
            if other == visitor or now - transfer.last > limits.UPLOAD_TIMEOUT:
                del self._running[other]
        # A browser sends only the name; of a path, the last part is used.
        name = printable_name(message.filename)
        suffix = "." + name.rpartition(".")[2].lower()
        if suffix not in limits.UPLOAD_FORMATS:
            raise CommandError(f"{name}: give a surface as {', '.join(limits.UPLOAD_FORMATS)}")
        if not 0 < message.size_bytes <= limits.LARGEST_UPLOAD:
            size = f"{message.size_bytes / 2**20:.3g} MiB" if message.size_bytes > 0 else "empty"
            raise CommandError(f"{name}: it is {size}; the limit is {limits.LARGEST_UPLOAD // 2**20} MiB")
        if len(self._running) >= limits.MOST_UPLOADS:
            raise CommandError(f"{name}: {len(self._running)} files are being uploaded already; try again in a minute")
        parts = -(-message.size_bytes // limits.UPLOAD_PART)
        if message.part_count != parts:
            raise CommandError(f"{name}: announced in {message.part_count} parts, expected {parts}")
        return _Transfer(message.transfer_uuid, name, suffix, message.size_bytes, parts, now)

    def _go_on(self, visitor: Any, message: Any) -> None:
        transfer, client = self._running.get(visitor), self._server.get_clients().get(visitor)
        if transfer is None or client is None or message.transfer_uuid != transfer.number:
            return  # of a transfer that was rejected
        came = len(transfer.came)
        whole = came < transfer.parts - 1
        due = limits.UPLOAD_PART if whole else transfer.size - came * limits.UPLOAD_PART
        if message.part_index != came or len(message.content) != due:
            del self._running[visitor]
            self._answer(client, transfer.number, transfer.size, transfer.size)
            self._rejected(client, f"{transfer.name}: it arrived damaged; try again")
            return
        transfer.came.append(message.content)
        transfer.last = time.monotonic()
        self._answer(client, transfer.number, came * limits.UPLOAD_PART + due, transfer.size)
        if len(transfer.came) == transfer.parts:
            del self._running[visitor]
            self._accepted(client, transfer.name, transfer.suffix, b"".join(transfer.came))

    def _answer(self, client: Any, number: str, came: int, size: int) -> None:
        """Tell the browser how much was received, for its progress bar."""
        from viser import _messages

        answer = _messages.FileTransferPartAck(self._button._impl.uuid, number, came, size)
        client._websock_connection.queue_message(answer)


def printable_name(name: str) -> str:
    """The last part of a path, in printable characters."""
    last = name.replace("\\", "/").rpartition("/")[2]
    return "".join(c if c.isprintable() else "?" for c in last)[-60:] or "file"
