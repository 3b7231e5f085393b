"""Films and pictures of a recording. A child process draws: without OpenGL, drawing ends its process."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import asdict, dataclass
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from supple.errors import OutputError, SceneError
from supple.kinds.checks import finite_vector
from supple.kinds.validators import Limits
from supple.results.recording.reader import Recording
from supple.results.view.camera import PRESETS
from supple.results.view.fields import COLOR_BY_BODY, FIELDS
from supple.runtime.replacing import whole_file

CAMERAS = ("fit", "follow", "orbit")
DRAWN = ("skin", "tets")
COLORS = {field.key: field for field in FIELDS.values()}
# Of the sides [pixels]: encoders of H.264 take no more than the largest, and no odd ones.
_LEAST, _MOST = 64, 4096

Place = tuple[float, float, float]


@dataclass(frozen=True)
class Film:
    """How a film, or a picture, is drawn. Its look is that of the page.

    Parameters
    ----------
    size : width and height [pixels], even
    rate : frames per second; the speed is that of the simulation, divided by `slow`
    slow : slow motion: how much longer the film is than the simulation, as a ratio
    camera : "fit" shows the whole motion, "follow" moves with the bodies, "orbit" turns once around them
    view : from where: "corner", "front", "side", "top" or "back"
    eye : (3,) place of the camera [m], with `target` and instead of `view`; None: where it sees what `camera` says
    target : (3,) place that the camera looks at [m], around which "orbit" turns
    surface : of bodies: "skin", or "tets", the surface that is simulated, also where a body has a skin
    color : "body", or a field of the tets: "J", "von_mises" or "energy"; rigid bodies are grey then
    range : (low, high) ends of the color scale, in the unit of the field; None: what the film shows, in round numbers
    connections : whether stitches and joints are drawn, as lines
    shadows : whether bodies and obstacles cast soft shadows
    dark : whether the background is dark
    time : of a picture [s]; None: the end
    render : whether light is traced (extra: render): slow, with translucent bodies, soft shadows and depth of field
    samples : paths of light of each pixel, with `render`: more have less grain and take longer; None: 64

    Raises
    ------
    OutputError : where a value is unusable.
    """

    size: tuple[int, int] = (1280, 720)
    rate: float = 30.0
    slow: float = 1.0
    camera: str = "fit"
    view: str = "corner"
    eye: Place | None = None
    target: Place | None = None
    surface: str = "skin"
    color: str = COLOR_BY_BODY
    range: tuple[float, float] | None = None
    connections: bool = True
    shadows: bool = True
    dark: bool = False
    time: float | None = None
    render: bool = False
    samples: int | None = None

    def __post_init__(self) -> None:
        choices = {"camera": CAMERAS, "view": PRESETS, "surface": DRAWN, "color": (COLOR_BY_BODY, *COLORS)}
        for key, names in choices.items():
            if getattr(self, key) not in names:
                raise OutputError(f"export: {key} is {getattr(self, key)!r}; give one of {', '.join(names)}")
        object.__setattr__(self, "size", tuple(self.size))
        if len(self.size) != 2 or not all(
            isinstance(n, int) and _LEAST <= n <= _MOST and n % 2 == 0 for n in self.size
        ):
            raise OutputError(f"export: size is {self.size!r}; give even pixels from {_LEAST} to {_MOST}, as 1280x720")
        for key, most in (("rate", 240.0), ("slow", 1e4)):
            value = getattr(self, key)
            if isinstance(value, bool) or not isinstance(value, (int, float)) or not 0.0 < value <= most:
                raise OutputError(f"export: {key} is {value!r}; give a number above zero, at most {most:g}")
        if self.time is not None and not isinstance(self.time, (int, float)):
            raise OutputError(f"export: time is {self.time!r}; give seconds")
        if self.samples is not None:
            if isinstance(self.samples, bool) or not isinstance(self.samples, int) or not 1 <= self.samples <= 65_536:
                raise OutputError(f"export: samples is {self.samples!r}; give a whole number from 1 to 65536")
            if not self.render:
                raise OutputError("export: samples are those of traced light; give render too")
        if self.render and not self.shadows:
            raise OutputError("export: traced light casts shadows; leave out render, or the wish for no shadows")
        if self.range is not None:
            self._require_range()
        if self.eye is not None or self.target is not None:
            self._require_places()

    def _require_range(self) -> None:
        try:
            low, high = Limits().checked(self.range, "export: range")
        except SceneError as error:
            raise OutputError(str(error)) from None
        if not np.isfinite([low, high]).all():
            raise OutputError(f"export: range is ({low:g}, {high:g}); give two finite numbers")
        object.__setattr__(self, "range", (low, high))
        if self.color == COLOR_BY_BODY:
            raise OutputError(f"export: range is that of a field; give color too: {', '.join(COLORS)}")

    def _require_places(self) -> None:
        if self.eye is None or self.target is None:
            missing = "eye" if self.eye is None else "target"
            raise OutputError(f"export: {missing} is missing; give eye and target together")
        try:
            eye, target = finite_vector(self.eye, "export: eye"), finite_vector(self.target, "export: target")
        except SceneError as error:
            raise OutputError(str(error)) from None
        if not np.linalg.norm(eye - target) > 0.0:
            raise OutputError("export: eye and target are the same place; move one, so that the camera has a direction")
        if self.camera == "follow" or self.view != "corner":
            raise OutputError("export: eye and target place the camera; leave out view, and camera follow")
        object.__setattr__(self, "eye", tuple(eye.tolist()))
        object.__setattr__(self, "target", tuple(target.tolist()))


# Without and with traced light: the extra, what it must have, and the program.
_RENDERERS = {False: ("video", "pyvista", "video_worker"), True: ("render", "mitsuba", "render_worker")}
_ENCODERS = {"mp4": ("imageio_ffmpeg",)}


def write_video(recording: Recording, output: Path, film: Film) -> None:
    """Write a film (.mp4, which is H.264, or .gif), or a picture of one instant (.png)."""
    kind = output.suffix[1:].lower()
    extra, library, worker = _RENDERERS[film.render]
    missing = [name for name in (library, "PIL", *_ENCODERS.get(kind, ())) if find_spec(name) is None]
    if missing:
        raise OutputError(f"export to {kind} needs {missing[0]}, which is not installed; pip install 'supple[{extra}]'")
    with whole_file(output) as fresh:
        command = [sys.executable, "-m", f"supple.results.export.{worker}", str(recording.path), str(fresh)]
        command.append(json.dumps(asdict(film)))
        # What takes minutes shows a bar, on standard output of the child: that of errors has the reason of its end.
        shown = film.render and sys.__stderr__ is not None and sys.__stderr__.isatty()
        bar = sys.__stderr__ if shown else subprocess.DEVNULL
        done = subprocess.run(command, stdout=bar, stderr=subprocess.PIPE, text=True, check=False)
        if done.returncode != 0 or not fresh.exists():
            raise OutputError(f"{output}: {_reason(done, film.render)}")


def _reason(done: subprocess.CompletedProcess[str], render: bool) -> str:
    lines = [line for line in done.stderr.splitlines() if line.strip()]
    last = lines[-1] if lines else ""
    if last.startswith("video: "):
        return last.removeprefix("video: ")
    signs = ("EGL", "OpenGL", "GLX", "X server", "OSMesa", "render window")
    if not render and (done.returncode < 0 or any(sign in done.stderr for sign in signs)):
        return (
            "drawing needs OpenGL, which does not work here; on Debian and Ubuntu: apt install libegl1 libgl1 "
            f"(the drawing process ended with code {done.returncode})"
        )
    return f"the drawing process ended with code {done.returncode}: {last or 'without a message'}"
