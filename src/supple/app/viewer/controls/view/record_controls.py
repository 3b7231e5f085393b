"""The folder "Record" of the panel: screenshots, and HTML pages that play."""

from __future__ import annotations

import io
import threading
import time
from typing import Any

from supple.results.page.page import page_of_frames
from supple.results.view.model import RenderFrame
from supple.results.view.stage import Stage

_MOST_SECONDS = 120.0  # of a page
_MOST_BYTES = 300_000_000  # of recorded frames
_TALLEST = 2160  # of a screenshot [pixels]
_PICTURE_TIMEOUT = 20.0  # software OpenGL takes seconds [s]


class RecordControls:
    """Buttons for a screenshot and for recording; the visitor who presses one receives the file."""

    def __init__(self, server: Any, stage: Stage) -> None:
        self._stage, self._lock = stage, threading.Lock()
        self._frames: list[tuple[float, RenderFrame]] | None = None
        self._bytes, self._began = 0, 0.0
        gui = server.gui
        with gui.add_folder("Record", expand_by_default=False):
            self.screenshot = gui.add_button("Screenshot", hint="The picture as a PNG file")
            self.record = gui.add_button(
                "Record a page", hint="Start; press again to receive an HTML file that plays in any browser"
            )
        self.screenshot.on_click(self._send_screenshot)
        self.record.on_click(self._toggle)

    def note(self, frame: RenderFrame) -> None:
        """Called with every drawn frame."""
        with self._lock:
            if self._frames is None:
                return
            seconds = time.monotonic() - self._began
            if seconds > _MOST_SECONDS or self._bytes > _MOST_BYTES:
                return
            self._bytes += 2 * frame.positions.nbytes
            self._frames.append((seconds, frame))

    def _send_screenshot(self, event: Any) -> None:
        self.screenshot.disabled = True
        try:
            event.client.send_file_download("supple.png", png_of(event.client), save_immediately=True)
        except (RuntimeError, OSError, ValueError) as error:
            event.client.add_notification("No screenshot", f"the browser sent no picture: {error}", color="red")
        finally:
            self.screenshot.disabled = False

    def _toggle(self, event: Any) -> None:
        with self._lock:
            frames, self._frames = self._frames, None
            if frames is None:
                self._began, self._bytes, self._frames = time.monotonic(), 0, [(0.0, self._stage.frame)]
            self.record.label = "Stop, and receive the page" if frames is None else "Record a page"
        if frames is not None:
            event.client.send_file_download("supple.html", page_of_frames(frames).encode())


def png_of(client: Any) -> bytes:
    """The 3D view of a visitor, on white, as PNG file."""
    from PIL import Image

    scale = min(1.0, _TALLEST / client.camera.image_height)
    size = [round(scale * n) for n in (client.camera.image_height, client.camera.image_width)]
    shot = Image.fromarray(client.get_render(*size, transport_format="png", timeout=_PICTURE_TIMEOUT))
    if shot.mode == "RGBA":
        ground = Image.new("RGBA", shot.size, (255, 255, 255, 255))
        ground.alpha_composite(shot)
        shot = ground.convert("RGB")
    out = io.BytesIO()
    shot.save(out, "PNG")
    return out.getvalue()
