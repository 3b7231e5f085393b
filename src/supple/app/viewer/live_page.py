"""The page of a live simulation: what it sends to all browsers, and when."""

from __future__ import annotations

import asyncio
import json
import logging
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from supple.app.viewer.protocol.commands import Command, SetView, Watch
from supple.app.viewer.visitor import Visitor
from supple.errors import CommandError, SuppleError
from supple.results.page.packed import Packer
from supple.runtime.kernel_count import KernelCount

if TYPE_CHECKING:  # what a scene needs is imported with it: the page is there before
    from supple.app.viewer.engine.engine import Engine
    from supple.app.viewer.protocol.snapshots import Snapshot
    from supple.app.viewer.server import PageServer
    from supple.results.view.model import Model, RenderFrame

logger = logging.getLogger(__name__)

# A message arrives every half a second. After this time the page displays "Busy" [s].
_SILENT_AFTER = 2.0
# Nobody watches where there was no browser for this time: one that loads the page again comes back sooner [s].
_UNWATCHED_AFTER = 2.0
_IDLE = 0.05  # between two looks at what browsers have drawn, while nothing changes [s]
_STATUS_EVERY = 0.25  # [s]
_TOLD_WITHIN = 0.5  # of an error, before the server ends [s]
# Of a page that is recorded.
_MOST_SECONDS, _MOST_BYTES = 120.0, 300_000_000


class LivePage:
    """Sends the newest snapshot to each browser that has drawn the one before, and their commands to the simulation.

    Page and simulation never wait for each other, nor does a browser for another one.

    Parameters
    ----------
    about : the title, and the command that starts the page again

    Attributes
    ----------
    simulation : see `attach`; frame : the newest one; None before they are there
    """

    def __init__(self, about: dict[str, Any]) -> None:
        self.simulation: Engine | None = None
        self.frame: RenderFrame | None = None
        self._snapshot: Snapshot | None = None
        self._about = about
        self._visitors: set[Visitor] = set()
        self._came = False  # whether there was a browser
        self._number, self._starts, self._view = 0, 0, SetView()
        self._notice, self._status, self._told_at = 0, "", 0.0
        self._watched, self._seen_at = True, time.monotonic()
        self._recorded: tuple[float, list[tuple[float, RenderFrame]]] | None = None
        self._restarts = threading.Lock()
        self._end = threading.Event()
        self._model: Model | None = None
        self._began, self._error, self._line = time.monotonic(), "", LastLine()
        self._kernels = KernelCount()

    @contextmanager
    def reading(self) -> Iterator[None]:
        """A block in which the scene is read: the page tells what the log says."""
        log = logging.getLogger("supple")
        log.addHandler(self._line)
        try:
            yield
        finally:
            log.removeHandler(self._line)

    def fail(self, error: str, patience: float) -> None:
        """Tell browsers why the page ends; one that was opened, and is not there yet, gets `patience` [s]."""
        self._error = error
        end = time.monotonic() + patience
        while not self._came and time.monotonic() < end and not self._end.wait(_IDLE):
            pass
        if self._came:
            self._end.wait(_STATUS_EVERY + _TOLD_WITHIN)

    def attach(self, simulation: Engine) -> None:
        """Show a simulation; see `Engine`."""
        self._about = {**self._about, "reload": simulation.again is not None}
        self._starts = simulation.starts
        if self._view != SetView():
            simulation.send(self._view)
        self.simulation = simulation

    def wait_for_frame(self) -> None:
        """Wait until the first frame is shown."""
        while self.frame is None and not self._end.wait(_IDLE / 10.0):
            pass

    def send(self, command: Command) -> None:
        """Send a command of a visitor.

        Raises
        ------
        CommandError : where the simulation is not there yet.
        """
        if self.simulation is None:
            raise CommandError("the simulation has not started yet")
        self.simulation.send(command)

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
        self._came = True
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
        if self.simulation is not None:
            self.simulation.send(wanted)

    def record(self, visitor: Visitor, on: object) -> None:
        """Begin to record frames, or give the visitor a page that plays them."""
        if on is True and self.frame is not None:
            self._recorded = time.monotonic(), [(0.0, self.frame)]
        elif self._recorded is not None:
            (_, frames), self._recorded = self._recorded, None
            threading.Thread(target=self._send_page, args=(visitor, frames), name="page", daemon=True).start()

    def _send_page(self, visitor: Visitor, frames: list[tuple[float, RenderFrame]]) -> None:
        from supple.results.page.page import page_of_frames

        packer = Packer()
        page = packer.add(bytearray(page_of_frames(frames).encode()), "u1")
        self._server.soon(visitor.put, "file", packer.block({"kind": "file", "name": "supple.html", "bytes": page}))

    def start_again(self, visitor: Visitor, *, reload: bool) -> None:
        """Start a simulation that has ended, or read its source again."""
        simulation = self.simulation
        if simulation is None or not (self._about["reload"] if reload else simulation.error is not None):
            return
        if self._restarts.acquire(blocking=False):
            act = simulation.reload if reload else simulation.restart
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
            simulation = self.simulation
            try:
                if simulation is None:
                    self._end.wait(_IDLE)
                else:
                    simulation.wait_for_news(_IDLE)
                    self._notice_visitors(simulation)
                    self._send_newest(simulation)
                self._send_status(simulation)
            except Exception:
                logger.exception("page: a snapshot could not be sent")  # the next ones can
            self._end.wait(0.002)

    def _notice_visitors(self, simulation: Engine) -> None:
        """Tell the simulation whether anybody watches."""
        now = time.monotonic()
        if self._visitors:
            self._seen_at = now
        watched = now - self._seen_at < _UNWATCHED_AFTER
        if watched != self._watched:
            self._watched = watched
            simulation.send(Watch(watched))

    def _send_newest(self, simulation: Engine) -> None:
        snapshot = simulation.latest()
        if simulation.starts != self._starts:
            self._starts, self._notice, self._model = simulation.starts, 0, None
            simulation.send(self._view)  # the new process does not know it
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
                assert self.frame is not None
                self._message = self._messages.of(snapshot, self.frame)
            self._server.soon(visitor.put, "frame", self._message)

    def _show(self, snapshot: Snapshot) -> None:
        from supple.app.viewer.messages import Messages, frame_of, model_of, plotted

        self._model = self._model or model_of(snapshot.description)
        frame, self._snapshot = frame_of(snapshot, self._model), snapshot
        if self.frame is None or frame.model is not self.frame.model:
            self._number += 1
            self._messages = Messages(frame, plotted(snapshot), self._about)
        self.frame, self._message = frame, None
        self._messages.note(snapshot)
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

    def _send_status(self, simulation: Engine | None) -> None:
        now = time.monotonic()
        if now - self._told_at < _STATUS_EVERY:
            return
        error = self._error or (simulation.error if simulation is not None else None)
        told = {"kind": "status", "error": error, "recording": self._recorded is not None, **self._about}
        told |= {"ended": bool(self._error), "busy": "" if error else self._waiting(simulation, now)}
        status = json.dumps(told)
        if status != self._status:
            self._status, self._told_at = status, now
            for visitor in self._visitors.copy():
                self._server.soon(visitor.put, "status", status)

    def _waiting(self, simulation: Engine | None, now: float) -> str:
        """What the page waits for, or ""."""
        from supple.app.viewer.protocol.snapshots import Progress

        if simulation is None:
            reading = f"reading and meshing{': ' * bool(self._line.text)}{self._line.text}"
            return Progress(now - self._began, 0, self._kernels.current(), reading).text()
        silent = max(0.0, now - simulation.heard_at)
        if self._snapshot is None:
            return (simulation.progress or Progress(silent, what="starting the simulation")).text()
        progress = simulation.progress or (Progress(silent) if silent > _SILENT_AFTER else None)
        return "" if progress is None else progress.text(self._snapshot.description.solver)


class LastLine(logging.Handler):
    """Keeps what the log said last."""

    text = ""

    def emit(self, record: logging.LogRecord) -> None:
        self.text = " ".join(record.getMessage().split())[:200]
