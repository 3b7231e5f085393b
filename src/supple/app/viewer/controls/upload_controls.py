"""Adds a body from a file of a visitor: it is uploaded, meshed in a child process, and placed above all bodies."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

from supple.app.viewer.controls.controller import Controller, notify
from supple.app.viewer.protocol import limits
from supple.app.viewer.protocol.commands import AddMesh
from supple.app.viewer.server.uploads.meshing import Upload, mesh_of_upload
from supple.app.viewer.server.uploads.transfers import Transfers
from supple.errors import SuppleError

_HINT = f"A closed surface, at most {limits.LARGEST_UPLOAD // 2**20} MiB and {limits.MOST_UPLOADED_TRIANGLES} triangles"
# Characters that are not allowed in names of bodies, see `supple.scene.values.check_name`.
_FORBIDDEN = '/\\:*?"<>|'


class UploadControls:
    """The upload button, and a line with the progress. One file at a time is meshed.

    Parameters
    ----------
    size, youngs : return the values for the new body [m], [Pa]
    """

    def __init__(
        self, server: Any, controller: Controller, size: Callable[[], float], youngs: Callable[[], float]
    ) -> None:
        self._controller, self._size, self._youngs = controller, size, youngs
        self.button = server.gui.add_upload_button("From a file", mime_type=",".join(limits.UPLOAD_FORMATS), hint=_HINT)
        self._message = server.gui.add_markdown("", visible=False)
        self._busy, self._stop = threading.Lock(), threading.Event()
        self.transfers = Transfers(server, self.button, self._take, self._refuse)

    def stop(self) -> None:
        """Stop the present file, and wait for its end."""
        self._stop.set()
        with self._busy:
            pass

    def _take(self, client: Any, name: str, suffix: str, content: bytes) -> None:
        upload, youngs = Upload(name, suffix, content, self._size()), self._youngs()
        if self._stop.is_set() or not self._busy.acquire(blocking=False):
            self._refuse(client, f"{name}: another file is being meshed; try again when it is done")
            return
        self._show_message(_progress(0.0))
        threading.Thread(target=self._work, args=(client, upload, youngs), name="supple upload", daemon=True).start()

    def _work(self, client: Any, upload: Upload, youngs: float) -> None:
        """Runs in its own thread, while page and simulation go on."""
        try:
            vertices, tets = mesh_of_upload(upload, lambda seconds: self._show_message(_progress(seconds)), self._stop)
            self._controller.send(client, lambda: AddMesh(vertices, tets, youngs, body_name(upload.name)))
        except SuppleError as error:
            self._refuse(client, str(error))
        except OSError as error:
            self._refuse(client, f"{upload.name}: it cannot be saved: {error.strerror or error}")
        finally:
            self._show_message("")
            self._busy.release()

    def _refuse(self, client: Any, why: str) -> None:
        if not self._stop.is_set():
            notify(client, "Not added", why[:500], "red")

    def _show_message(self, text: str) -> None:
        if text != self._message.content and not self._stop.is_set():
            self._message.content, self._message.visible = text, bool(text)


def _progress(seconds: float) -> str:
    # Without the name of the file, because this is Markdown.
    return f"The file is being meshed, {seconds:.0f} s."


def body_name(file: str) -> str:
    """The name of a body from the name of a file."""
    stem = file.rpartition(".")[0]
    return "".join("_" if c in _FORBIDDEN else c for c in stem).strip(" .")[:40] or "mesh"
