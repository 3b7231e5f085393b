"""Films and pictures of a recording. A child process draws: without OpenGL, drawing ends its process."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import asdict
from importlib.util import find_spec
from pathlib import Path

from supple.errors import OutputError
from supple.results.export.film import Film
from supple.results.recording.reader import Recording
from supple.runtime.replacing import whole_file

_NEEDED = {"png": ("pyvista", "PIL"), "gif": ("pyvista", "PIL"), "mp4": ("pyvista", "imageio_ffmpeg")}


def write_video(recording: Recording, output: Path, film: Film) -> None:
    """Write a film (.mp4, which is H.264, or .gif), or a picture of one moment (.png)."""
    kind = output.suffix[1:].lower()
    missing = [name for name in _NEEDED[kind] if find_spec(name) is None]
    if missing:
        raise OutputError(f"export to {kind} needs {missing[0]}, which is not installed; pip install 'supple[video]'")
    with whole_file(output) as fresh:
        command = [sys.executable, "-m", "supple.results.export.video_worker", str(recording.path), str(fresh)]
        command.append(json.dumps(asdict(film)))
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode != 0 or not fresh.exists():
            raise OutputError(f"{output}: {_reason(done)}")


def _reason(done: subprocess.CompletedProcess[str]) -> str:
    lines = [line for line in done.stderr.splitlines() if line.strip()]
    last = lines[-1] if lines else ""
    if last.startswith("video: "):
        return last.removeprefix("video: ")
    signs = ("EGL", "OpenGL", "GLX", "X server", "OSMesa", "render window")
    if done.returncode < 0 or any(sign in done.stderr for sign in signs):
        return (
            "drawing needs OpenGL, which does not work here; on Debian and Ubuntu: apt install libegl1 libgl1 "
            f"(the drawing process ended with code {done.returncode})"
        )
    return f"the drawing process ended with code {done.returncode}: {last or 'without a message'}"
