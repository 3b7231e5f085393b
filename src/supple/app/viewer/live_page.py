"""The page of a live simulation: what it sends to all browsers, and when."""

from __future__ import annotations

import asyncio
import json
import logging
import threading
import time
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from supple.app.viewer.from_snapshot import RenderFrameBuilder
from supple.app.viewer.messages import Messages, waiting_text
from supple.app.viewer.protocol.commands import SetView, Watch
from supple.app.viewer.protocol.snapshots import Progress, Snapshot
from supple.app.viewer.visitor import Visitor
from supple.errors import SuppleError
from supple.results.page.packed import Packer
from supple.results.page.page import page_of_frames
from supple.results.view.model import RenderFrame

if TYPE_CHECKING:
    from supple.app.viewer.engine.engine import Engine
    from supple.app.viewer.server import PageServer

logger = logging.getLogger(__name__)

# A message arrives every half a second. After this time the page displays "Busy" [s].
_SILENT_AFTER = 2.0
# Nobody watches where there was no browser for this time: one that loads the page again comes back sooner [s].
_UNWATCHED_AFTER = 2.0
_IDLE = 0.05  # between two looks at what browsers have drawn, while nothing changes [s]
_STATUS_EVERY = 0.25  # [s]
# Of a page that is recorded.
_MOST_SECONDS, _MOST_BYTES = 120.0, 300_000_000


class LivePage:
    """Sends the newest snapshot to each browser that has drawn the one before, and their commands to the simulation.

    Page and simulation never wait for each other, nor does a browser for another one.

    Parameters
    ----------
    simulation : see `Engine`; about : the title, and the command that starts the page again

    Attributes
    ----------
    frame : the newest one
    """

    def __init__(self, simulation: Engine, about: dict[str, Any]) -> None:
        self.simulation = simulation
        self._about = {**about, "reload": simulation.again is not None}
        self._visitors: set[Visitor] = set()
        self._number, self._starts, self._view = 0, simulation.starts, SetView()
        self._notice, self._status, self._told_at = 0, "", 0.0
        self._watched, self._seen_at = True, time.monotonic()
        self._recorded: tuple[float, list[tuple[float, RenderFrame]]] | None = None
        self._restarts = threading.Lock()
        self._end = threading.Event()
        self._builder = RenderFrameBuilder()
        first = simulation.latest()
        assert first is not None  # the constructor of the engine waits for it
        self._show(first)

    def start(self, server: PageServer) -> None:
        """Start the thread that sends frames."""
        self._server = server
        self._thread = threading.Thread(target=self._run, name="live page", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End that thread."""
        self._end.set()
        self._thread.join()

    async def visit(self, connection: Any) -> None:
        """Serve a browser until it leaves. In the thread of the server, as all calls of visitors."""
        from websockets.exceptions import ConnectionClosed

        visitor = Visitor(self, connection)
        sender = asyncio.create_task(visitor.send_all())
        self._visitors.add(visitor)
        self._status = ""  # is sent again
        try:
            with suppress(ConnectionClosed):
                async for message in connection:
                    visitor.receive(message)
        finally:
            self._visitors.discard(visitor)
            visitor.release()
            sender.cancel()

    def view(self, wanted: SetView) -> None:
        """Ask the simulation for the values to draw, which computes no others."""
        self._view = wanted
        self.simulation.send(wanted)

    def record(self, visitor: Visitor, on: object) -> None:
        """Begin to record frames, or give the visitor a page that plays them."""
        if on is True:
            self._recorded = time.monotonic(), [(0.0, self.frame)]
        elif self._recorded is not None:
            (_, frames), self._recorded = self._recorded, None
            threading.Thread(target=self._send_page, args=(visitor, frames), name="page", daemon=True).start()

    def _send_page(self, visitor: Visitor, frames: list[tuple[float, RenderFrame]]) -> None:
        packer = Packer()
        page = packer.add(bytearray(page_of_frames(frames).encode()), "u1")
        self._server.soon(visitor.put, "file", packer.block({"kind": "file", "name": "supple.html", "bytes": page}))

    def start_again(self, visitor: Visitor, *, reload: bool) -> None:
        """Start a simulation that has ended, or read its source again."""
        if (self._about["reload"] if reload else self.simulation.error is not None) and self._restarts.acquire(False):
            act = self.simulation.reload if reload else self.simulation.restart
            threading.Thread(target=self._start, args=(visitor, act), name="restart", daemon=True).start()

    def _start(self, visitor: Visitor, act: Any) -> None:
        try:
            act()
        except SuppleError as error:
            self._server.soon(visitor.tell, "error", f"Not started: {error}")
        finally:
            self._restarts.release()

    def _run(self) -> None:
        while not self._end.is_set():
            self.simulation.wait_for_news(_IDLE)
            try:
                self._notice_visitors()
                self._send_newest()
                self._send_status()
            except Exception:
                logger.exception("page: a snapshot could not be sent")  # the next ones can
            self._end.wait(0.002)

    def _notice_visitors(self) -> None:
        """Tell the simulation whether anybody watches."""
        now = time.monotonic()
        if self._visitors:
            self._seen_at = now
        watched = now - self._seen_at < _UNWATCHED_AFTER
        if watched != self._watched:
            self._watched = watched
            self.simulation.send(Watch(watched))

    def _send_newest(self) -> None:
        if self.simulation.starts != self._starts:
            self._starts, self._notice, self._builder = self.simulation.starts, 0, RenderFrameBuilder()
            self.simulation.send(self._view)  # the new process does not know it
        snapshot = self.simulation.latest()
        if snapshot is None:
            return
        if snapshot is not self._snapshot:
            self._show(snapshot)
        for visitor in [visitor for visitor in self._visitors.copy() if visitor.is_free]:
            if visitor.has_scene != self._number:
                visitor.has_scene = self._number
                self._server.soon(visitor.put, "scene", self._messages.scene)
            elif visitor.seen is snapshot:
                continue
            visitor.is_free, visitor.seen = False, snapshot
            if self._message is None:
                self._message = self._messages.of(snapshot, self.frame)
            self._server.soon(visitor.put, "frame", self._message)

    def _show(self, snapshot: Snapshot) -> None:
        frame, self._snapshot = self._builder.frame(snapshot), snapshot
        if not self._number or frame.model is not self.frame.model:
            self._number += 1
            self._messages = Messages(frame, self._about)
        self.frame, self._message = frame, None
        for notice in snapshot.notices:
            if notice.number > self._notice:
                self._notice = notice.number
                for visitor in self._visitors.copy():
                    self._server.soon(visitor.tell, notice.level, notice.text)
        if self._recorded is not None:
            began, frames = self._recorded
            seconds = time.monotonic() - began
            if seconds < _MOST_SECONDS and 2 * len(frames) * frame.positions.nbytes < _MOST_BYTES:
                frames.append((seconds, replace(frame, tet_values={})))

    def _send_status(self) -> None:
        now = time.monotonic()
        if now - self._told_at < _STATUS_EVERY:
            return
        simulation = self.simulation
        silent = max(0.0, now - simulation.heard_at)
        progress = simulation.progress or (Progress(silent) if silent > _SILENT_AFTER else None)
        busy = "" if progress is None else waiting_text(progress, self._snapshot.description.solver)
        told = {"kind": "status", "error": simulation.error, "busy": busy, "recording": self._recorded is not None}
        status = json.dumps(told)
        if status != self._status:
            self._status, self._told_at = status, now
            for visitor in self._visitors.copy():
                self._server.soon(visitor.put, "status", status)
