"""Screenshots and videos, rendered by the browser of one visitor."""

from __future__ import annotations

import io
import itertools
import tempfile
import threading
import time
from collections.abc import Iterable
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.errors import OutputError

_MOST_SECONDS, _MOST_FRAMES = 60.0, 900
_SMALLEST_PAUSE = 0.05  # between pictures [s]
_TALLEST = 720  # [pixels]
_PICTURE_TIMEOUT = 20.0  # software OpenGL takes seconds [s]


def picture_of(client: Any, tallest: int = 2160, kind: str = "png") -> NDArray[np.uint8]:
    """The 3D view of a visitor as picture (height, width, 3 or 4).

    Raises
    ------
    OutputError : where the browser sends no picture.
    """
    # The size that a browser sends can be any number.
    height, width = (max(1.0, float(n)) for n in (client.camera.image_height, client.camera.image_width))
    scale = min(1.0, tallest / height, 4.0 * tallest / width)
    # Video encoders need even numbers of pixels.
    size = [max(2, int(n * scale) // 2 * 2) for n in (height, width)]
    try:
        picture = client.get_render(*size, transport_format=kind, timeout=_PICTURE_TIMEOUT)
    except (RuntimeError, TimeoutError, ConnectionError, OSError, ValueError) as error:
        raise OutputError(f"the browser sent no picture: {error}") from None
    if list(picture.shape[:2]) != size:
        raise OutputError("the browser sent a picture of another size")
    return picture


def png_of(client: Any) -> bytes:
    """The 3D view of a visitor, on white, as PNG file."""
    from PIL import Image

    shot = Image.fromarray(picture_of(client))
    if shot.mode == "RGBA":
        ground = Image.new("RGBA", shot.size, (255, 255, 255, 255))
        ground.alpha_composite(shot)
        shot = ground.convert("RGB")
    out = io.BytesIO()
    shot.save(out, "PNG")
    return out.getvalue()


def video_formats() -> dict[str, str]:
    """The video formats, and for each what has to be installed ("" where nothing is missing)."""
    missing = "" if find_spec("imageio_ffmpeg") else "needs imageio-ffmpeg: pip install 'supple[video]'"
    return {"gif": "", "mp4": missing}


class VideoCapture:
    """Captures pictures from the browser of one visitor until `end`."""

    def __init__(self, client: Any) -> None:
        self._client = client
        self._frames: list[bytes] = []  # as JPEG: a minute of pixels would be gigabytes
        self._size: tuple[int, ...] = ()
        self._times: list[float] = []
        self._error: OutputError | None = None
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="supple video capture", daemon=True)
        self._thread.start()

    def _run(self) -> None:
        began = time.monotonic()
        while not self._stop.is_set() and len(self._frames) < _MOST_FRAMES:
            now = time.monotonic() - began
            if now > _MOST_SECONDS:
                break
            try:
                picture = picture_of(self._client, _TALLEST, "jpeg")[..., :3]
            except OutputError as error:
                self._error = error
                break
            self._size = self._size or picture.shape
            if picture.shape != self._size:  # a resized window ends the video
                break
            self._frames.append(_packed(picture))
            self._times.append(now)
            self._stop.wait(_SMALLEST_PAUSE)

    def end(self, kind: str) -> bytes:
        """Stop, and return the video as a file.

        Raises
        ------
        OutputError : where there is no picture, or the encoder of this format is not installed.
        """
        self._stop.set()
        self._thread.join()
        missing = video_formats()[kind]
        if missing:
            raise OutputError(f"{kind.upper()} {missing}")
        if not self._frames:
            raise self._error or OutputError("there is no picture yet; record for longer")
        lasted = self._times[-1] - self._times[0]
        rate = max(1.0, (len(self._times) - 1) / lasted) if lasted > 0.0 else 10.0
        frames = (_unpacked(frame) for frame in self._frames)
        return gif_of(frames, rate) if kind == "gif" else mp4_of(frames, rate)


def _packed(frame: NDArray[np.uint8]) -> bytes:
    from PIL import Image

    out = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(frame)).save(out, "JPEG", quality=95, subsampling=0)
    return out.getvalue()


def _unpacked(frame: bytes) -> NDArray[np.uint8]:
    from PIL import Image

    with Image.open(io.BytesIO(frame)) as picture:
        return np.asarray(picture)


def gif_of(frames: Iterable[NDArray[np.uint8]], rate: float) -> bytes:
    """Frames (h, w, 3), at least one, as an animated GIF of `rate` frames per second."""
    from PIL import Image

    pictures = (Image.fromarray(frame) for frame in frames)
    first, out = next(pictures), io.BytesIO()
    first.save(out, "GIF", save_all=True, append_images=pictures, duration=round(1000.0 / rate), loop=0)
    return out.getvalue()


def mp4_of(frames: Iterable[NDArray[np.uint8]], rate: float) -> bytes:
    """Frames (h, w, 3), at least one, as H.264 video of `rate` frames per second."""
    import imageio_ffmpeg

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "video.mp4"
        pictures = iter(frames)
        first = next(pictures)
        height, width = first.shape[:2]
        writer = imageio_ffmpeg.write_frames(str(path), (width, height), fps=max(1, round(rate)), macro_block_size=2)
        writer.send(None)
        for frame in itertools.chain([first], pictures):
            writer.send(np.ascontiguousarray(frame))
        writer.close()
        return path.read_bytes()
