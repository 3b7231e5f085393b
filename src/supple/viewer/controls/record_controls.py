"""The part of the panel that keeps what is seen: pictures, films, and pages that play."""

from __future__ import annotations

import threading
import time
from typing import Any

from supple.errors import SuppleError
from supple.viewer.drawing.moments.model import Moment
from supple.viewer.drawing.page_of_moments import page_of_moments
from supple.viewer.drawing.stage import Stage
from supple.viewer.drawing.video_capture import Film, kinds_of_films, png_of
from supple.viewer.server.plain_markdown import plain

_PAGE = "page (HTML)"
_MOST_SECONDS = 120.0  # of a page
_MOST_BYTES = 300_000_000  # of moments that are kept


class RecordControls:
    """Buttons for a screenshot and for recording; who presses them is sent the file."""

    def __init__(self, server: Any, stage: Stage) -> None:
        self._stage = stage
        self._lock = threading.Lock()
        # Pictures and files are made one at a time: they take long, and the threads that serve visitors are few.
        self._busy = threading.Lock()
        self._taken: list[tuple[float, Moment]] | None = None
        self._film: Film | None = None
        self._bytes, self._began = 0, 0.0
        kinds = kinds_of_films()
        gui = server.gui
        with gui.add_folder("Record", expand_by_default=False):
            self.screenshot = gui.add_button("Screenshot")
            self.kind = gui.add_dropdown("Record as", (_PAGE, *(kind.upper() for kind in kinds)), initial_value=_PAGE)
            self.record = gui.add_button("Record")
            lacking = [f"{kind.upper()} {missing}" for kind, missing in kinds.items() if missing]
            self._said = gui.add_markdown("; ".join(lacking), visible=bool(lacking))
        self.screenshot.on_click(self._take_picture)
        self.record.on_click(self._toggle)

    def note(self, moment: Moment) -> None:
        """Called with every moment that is shown."""
        with self._lock:
            if self._taken is None:
                return
            seconds = time.monotonic() - self._began
            if seconds > _MOST_SECONDS or self._bytes > _MOST_BYTES:
                return
            self._bytes += 2 * moment.positions.nbytes
            self._taken.append((seconds, moment))

    @property
    def recording(self) -> bool:
        """Whether something is being recorded."""
        return self._taken is not None or self._film is not None

    def say(self, text: str) -> None:
        """Show a line below the buttons."""
        self._said.content, self._said.visible = plain(text), bool(text)

    def _take_picture(self, event: Any) -> None:
        if event.client is None or not self._busy.acquire(blocking=False):
            return
        try:
            event.client.send_file_download("supple.png", png_of(event.client), save_immediately=True)
            self.say("")
        except SuppleError as error:
            self.say(str(error))
        finally:
            self._busy.release()

    def _toggle(self, event: Any) -> None:
        if event.client is None or not self._busy.acquire(blocking=False):
            return
        try:
            if self.recording:
                self._end(event.client)
            else:
                self._begin(event.client)
        finally:
            self._busy.release()

    def _begin(self, client: Any) -> None:
        kind = self.kind.value
        missing = kinds_of_films().get(kind.lower(), "")
        if missing:
            self.say(f"{kind} {missing}")
            return
        with self._lock:
            self._began, self._bytes = time.monotonic(), 0
            if kind == _PAGE:
                self._taken = [(0.0, self._stage.moment)]
            else:
                self._film = Film(client)
        self.record.label = "Stop"
        self.kind.disabled = True
        self.say("Recording.")

    def _end(self, client: Any) -> None:
        with self._lock:
            taken, self._taken = self._taken, None
            film, self._film = self._film, None
        self.say("Writing the file.")
        try:
            if taken is not None:
                client.send_file_download("supple.html", page_of_moments(taken, self._stage.options).encode())
            elif film is not None:
                kind = self.kind.value.lower()
                client.send_file_download(f"supple.{kind}", film.end(kind))
            self.say("")
        except SuppleError as error:
            self.say(str(error))
        finally:
            self.record.label = "Record"
            self.kind.disabled = False
