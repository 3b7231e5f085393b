"""Adds a body from a file of a visitor: it is uploaded, meshed in a child process, and placed above all bodies."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

import numpy as np

from supple.app.viewer.controls.controller import Controller, notify
from supple.app.viewer.protocol import limits
from supple.app.viewer.protocol.commands import AddMesh
from supple.app.viewer.protocol.snapshots import Snapshot
from supple.app.viewer.uploads import Upload, mesh_of_upload
from supple.errors import CommandError, SuppleError
from supple.mesh.meshing.child_process import DEFAULT_TETS

_HINT = f"A closed surface, at most {limits.LARGEST_UPLOAD // 2**20} MiB and {limits.MOST_UPLOADED_TRIANGLES} triangles"
# Characters that are not allowed in names of bodies, see `supple.kinds.checks.check_name`.
_FORBIDDEN = '/\\:*?"<>|'


class UploadControls:
    """The upload button, and a line with the progress. One file at a time is meshed.

    Parameters
    ----------
    size, youngs : return the values for the new body [m], [Pa]
    """

    def __init__(
        self, gui: Any, controller: Controller, size: Callable[[], float], youngs: Callable[[], float]
    ) -> None:
        self._controller, self._size, self._youngs = controller, size, youngs
        self.button = gui.add_upload_button("From a file", mime_type=",".join(limits.UPLOAD_FORMATS), hint=_HINT)
        self._message = gui.add_markdown("", visible=False)
        self._busy, self._stop = threading.Lock(), threading.Event()
        self.button.on_upload(self._take)

    def stop(self) -> None:
        """Stop the present file, and wait for its end."""
        self._stop.set()
        with self._busy:
            pass

    def _take(self, event: Any) -> None:
        """Called in a thread of viser, while page and simulation go on."""
        file, youngs = self.button.value, self._youngs()
        name = printable_name(file.name)
        if self._stop.is_set() or not self._busy.acquire(blocking=False):
            self._refuse(event.client, f"{name}: another file is being meshed; try again when it is done")
            return
        try:
            upload = checked_upload(name, file.content, self._size(), tets_in_time(self._controller.snapshot))
            self._show_message(_progress(0.0))
            vertices, tets = mesh_of_upload(upload, lambda seconds: self._show_message(_progress(seconds)), self._stop)
            added = self._controller.send(event.client, lambda: AddMesh(vertices, tets, youngs, body_name(name)))
            if added and upload.tets < DEFAULT_TETS:
                why = "a larger scene would be slower than real time"
                notify(event.client, "Added", f"{name}: {len(tets):,} tets; {why}", "blue")
        except SuppleError as error:
            self._refuse(event.client, str(error))
        except OSError as error:
            self._refuse(event.client, f"{name}: it cannot be saved: {error.strerror or error}")
        finally:
            self._show_message("")
            self._busy.release()

    def _refuse(self, client: Any, why: str) -> None:
        if not self._stop.is_set():
            notify(client, "Not added", why[:500], "red")

    def _show_message(self, text: str) -> None:
        if text != self._message.content and not self._stop.is_set():
            self._message.content, self._message.visible = text, bool(text)


_FEWEST = 300  # tets of a file: fewer lose its shape
_SHARE = 0.9  # of the time of a frame that a step may take


def tets_in_time(snapshot: Snapshot) -> int:
    """How many more tets the scene may have to keep up with real time, after what a step takes; 300 to 2,000."""
    scene, step = snapshot.description, 1e-3 * snapshot.timing.step_ms
    if step <= 0.0 or not scene.n_tets:
        return DEFAULT_TETS
    left = _SHARE * float(scene.values.get("dt", 1.0 / 60.0)) / snapshot.speed - step
    return int(np.clip(left / step * scene.n_tets, _FEWEST, DEFAULT_TETS))


def checked_upload(name: str, content: bytes, size: float, tets: int = DEFAULT_TETS) -> Upload:
    """A file from a browser, of a format and a size that are accepted; raises `CommandError` otherwise."""
    suffix = "." + name.rpartition(".")[2].lower()
    if suffix not in limits.UPLOAD_FORMATS:
        raise CommandError(f"{name}: give a surface as {', '.join(limits.UPLOAD_FORMATS)}")
    if not 0 < len(content) <= limits.LARGEST_UPLOAD:
        found = f"{len(content) / 2**20:.3g} MiB" if content else "empty"
        raise CommandError(f"{name}: it is {found}; the limit is {limits.LARGEST_UPLOAD // 2**20} MiB")
    return Upload(name, suffix, content, size, tets)


def _progress(seconds: float) -> str:
    # Without the name of the file, because this is Markdown.
    return f"The file is being meshed, {seconds:.0f} s."


def printable_name(name: str) -> str:
    """The last part of a path, in printable characters."""
    last = name.replace("\\", "/").rpartition("/")[2]
    return "".join(c if c.isprintable() else "?" for c in last)[-60:] or "file"


def body_name(file: str) -> str:
    """The name of a body from the name of a file."""
    stem = file.rpartition(".")[0]
    return "".join("_" if c in _FORBIDDEN else c for c in stem).strip(" .")[:40] or "mesh"
