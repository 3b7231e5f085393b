"""Run demos and examples and draw them, with what they measure, for docs/gallery.json and docs/images/gallery.

`python docs/draw_gallery.py` draws all, `python docs/draw_gallery.py squash ragdoll` some: the demos, and the examples
whose `main` takes sinks. It needs the extra `video`
and, on Debian, libegl1.
"""

from __future__ import annotations

import io
import json
import runpy
import sys
import tempfile
import time
from contextlib import redirect_stdout
from pathlib import Path

import numpy as np
from PIL import Image

import supple as sp
from supple.app.demos.registry import DEMOS
from supple.results.export.video import Film
from supple.results.export.video_worker import Studio, palette_of
from supple.results.view.from_recording import model_of_recording, render_frame_of
from supple.simulate import NullSink

FOLDER = Path(__file__).parent
PICTURES = FOLDER / "images" / "gallery"
LIST = FOLDER / "gallery.json"
EXAMPLES = {
    path.stem[3:]: path
    for path in sorted((FOLDER.parent / "examples").glob("[0-9]*.py"))
    if "sinks=()" in path.read_text(encoding="utf-8")
}
SIZE, SHARES = (400, 300), (0.0, 0.2, 0.5, 1.0)  # of each picture, and where in the film


class Sizes(NullSink):
    """Notes what a simulation is made of."""

    def begin(self, first, dt, steps):
        self.tets = sum(len(body.mesh.tets) for body in first.system.scene.bodies)
        self.triangles = sum(len(body.triangles) for body in first.system.scene.bodies if isinstance(body, sp.Shell))
        self.dt, self.frames = dt, steps

    def write(self, frame):
        self.solver = type(frame.solver).__name__.lower()


def run_demo(name: str, sinks: list) -> dict[str, object]:
    """Run a demo; what the gallery says of it."""
    demo, measurement = DEMOS[name], DEMOS[name].measurement()
    for _ in sp.simulate(demo.scene(), demo.solver(), demo.dt, demo.steps, sinks=[measurement, *sinks]):
        pass
    claims = [{"text": c.text, "measured": c.measured, "holds": bool(c.holds)} for c in measurement.claims()]
    command = f"supple demo {name}"
    return {"summary": demo.summary, "explanation": demo.explanation, "command": command, "claims": claims}


def run_example(path: Path, sinks: list) -> dict[str, object]:
    """Run an example whose simulation takes sinks; what the gallery says of it."""
    module = runpy.run_path(str(path))
    with redirect_stdout(io.StringIO()) as printed:
        module["main"](sinks=sinks)
    summary, explanation, *_ = (part.replace("\n", " ") for part in module["__doc__"].split("\n\n"))
    command = f"python examples/{path.name}"
    return {"summary": summary, "explanation": explanation, "command": command, "prints": printed.getvalue()}


def draw(name: str, folder: Path) -> dict[str, object]:
    """Run a demo or an example and save its picture; what the gallery says of it."""
    path, sizes = folder / f"{name}.vtkhdf", Sizes()
    began = time.perf_counter()
    sinks = [sizes, sp.Recorder(path)]
    entry = run_demo(name, sinks) if name in DEMOS else run_example(EXAMPLES[name], sinks)
    print(f"{name}: {time.perf_counter() - began:.0f} s", flush=True)
    with sp.read_recording(path) as recording:
        model = model_of_recording(recording)
        render_frames = [render_frame_of(model, recording[round(share * (len(recording) - 1))]) for share in SHARES]
    studio = Studio(model, render_frames, Film(size=SIZE))
    strip = np.concatenate([studio.picture(render_frame, 0.0) for render_frame in render_frames], axis=1)
    picture = Image.fromarray(strip)
    image = picture.quantize(palette=palette_of(picture, dark=False), dither=Image.Dither.FLOYDSTEINBERG)
    PICTURES.mkdir(exist_ok=True)
    image.save(PICTURES / f"{name}.png", optimize=True)
    counts = {"tets": sizes.tets} | ({"triangles": sizes.triangles} if sizes.triangles else {})
    return entry | {"solver": sizes.solver, **counts, "frames": sizes.frames, "dt": sizes.dt}


def main(names: list[str]) -> None:
    known = json.loads(LIST.read_text(encoding="utf-8")) if LIST.exists() else {}
    everything = [*DEMOS, *EXAMPLES]
    with tempfile.TemporaryDirectory() as folder:
        for name in names or everything:
            known[name] = draw(name, Path(folder))
            ordered = {name: known[name] for name in everything if name in known}
            LIST.write_text(json.dumps(ordered, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
