"""The folder "Record" of the panel: screenshots, videos, and HTML pages that play."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Any

from supple.app.viewer.drawing.moments.model import Moment
from supple.app.viewer.drawing.page_of_moments import page_of_moments
from supple.app.viewer.drawing.stage import Stage
from supple.app.viewer.drawing.video_capture import VideoCapture, png_of, video_formats
from supple.app.viewer.server.plain_markdown import plain
from supple.errors import SuppleError

_PAGE = "page (HTML)"
_MOST_SECONDS = 120.0  # of a page
_MOST_BYTES = 300_000_000  # of recorded moments


def _one_at_a_time(act: Callable[[Any, Any], None]) -> Callable[[Any, Any], None]:
    """An event handler that acts for its visitor, unless another picture or file is being made."""

    def react(self: RecordControls, event: Any) -> None:
        if event.client is None or not self._busy.acquire(blocking=False):
            return
        try:
            act(self, event.client)
        except SuppleError as error:
            self.show_message(str(error))
        finally:
            self._busy.release()

    return react


class RecordControls:
    """Buttons for a screenshot and for recording; the visitor who presses one receives the file."""

    def __init__(self, server: Any, stage: Stage) -> None:
        self._stage = stage
        self._lock = threading.Lock()
        # Only one picture or file at a time: each takes long, and few threads serve the visitors.
        self._busy = threading.Lock()
        self._moments: list[tuple[float, Moment]] | None = None
        self._capture: VideoCapture | None = None
        self._bytes, self._began = 0, 0.0
        kinds = video_formats()
        gui = server.gui
        with gui.add_folder("Record", expand_by_default=False):
            self.screenshot = gui.add_button("Screenshot", hint="The picture as a PNG file")
            self.kind = gui.add_dropdown(
                "Record as",
                (_PAGE, *(kind.upper() for kind in kinds)),
                initial_value=_PAGE,
                hint="A page can be turned while it plays; GIF and MP4 are films",
            )
            self.record = gui.add_button("Record", hint="Start, and press again to receive the file")
            missing_formats = [f"{kind.upper()} {missing}" for kind, missing in kinds.items() if missing]
            self._message = gui.add_markdown("; ".join(missing_formats), visible=bool(missing_formats))
        self.screenshot.on_click(self._send_screenshot)
        self.record.on_click(self._toggle)

    def note(self, moment: Moment) -> None:
        """Called with every drawn moment."""
        with self._lock:
            if self._moments is None:
                return
            seconds = time.monotonic() - self._began
            if seconds > _MOST_SECONDS or self._bytes > _MOST_BYTES:
                return
            self._bytes += 2 * moment.positions.nbytes
            self._moments.append((seconds, moment))

    @property
    def recording(self) -> bool:
        """Whether a recording is active."""
        return self._moments is not None or self._capture is not None

    def show_message(self, text: str) -> None:
        """Display a line below the buttons."""
        self._message.content, self._message.visible = plain(text), bool(text)

    @_one_at_a_time
    def _send_screenshot(self, client: Any) -> None:
        client.send_file_download("supple.png", png_of(client), save_immediately=True)
        self.show_message("")

    @_one_at_a_time
    def _toggle(self, client: Any) -> None:
        if self.recording:
            self._end(client)
        else:
            self._begin(client)

    def _begin(self, client: Any) -> None:
        kind = self.kind.value
        missing = video_formats().get(kind.lower(), "")
        if missing:
            self.show_message(f"{kind} {missing}")
            return
        with self._lock:
            self._began, self._bytes = time.monotonic(), 0
            if kind == _PAGE:
                self._moments = [(0.0, self._stage.moment)]
            else:
                self._capture = VideoCapture(client)
        self.record.label = "Stop"
        self.kind.disabled = True
        self.show_message("Recording.")

    def _end(self, client: Any) -> None:
        with self._lock:
            moments, self._moments = self._moments, None
            capture, self._capture = self._capture, None
        self.show_message("Writing the file.")
        try:
            if moments is not None:
                client.send_file_download("supple.html", page_of_moments(moments, self._stage.options).encode())
            elif capture is not None:
                kind = self.kind.value.lower()
                client.send_file_download(f"supple.{kind}", capture.end(kind))
            self.show_message("")
        finally:
            self.record.label = "Record"
            self.kind.disabled = False
