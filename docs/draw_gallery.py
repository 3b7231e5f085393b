"""Run demos, measure their claims and draw them for docs/gallery.json and docs/images/gallery.

`python docs/draw_gallery.py` draws all, `python docs/draw_gallery.py squash bears` some. It needs the extra `video`
and, on Debian, libegl1.
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from PIL import Image

import supple as sp
from supple.app.demos.registry import DEMOS
from supple.results.export.video import Film
from supple.results.export.video_worker import Studio, palette_of
from supple.results.view.from_recording import model_of_recording, moment_of_frame

FOLDER = Path(__file__).parent
PICTURES = FOLDER / "images" / "gallery"
LIST = FOLDER / "gallery.json"
SIZE, SHARES = (400, 300), (0.0, 0.2, 0.5, 1.0)  # of each picture, and where in the film


def draw_demo(name: str, folder: Path) -> dict[str, object]:
    """Run one demo and save its picture; what the gallery says of it."""
    demo = DEMOS[name]
    measurement, path = demo.measurement(), folder / f"{name}.vtkhdf"
    began = time.perf_counter()
    scene = demo.scene()
    for _ in sp.simulate(scene, demo.solver(), demo.dt, demo.steps, sinks=[measurement, sp.Recorder(path)]):
        pass
    seconds = time.perf_counter() - began
    with sp.read_recording(path) as recording:
        model = model_of_recording(recording)
        moments = [moment_of_frame(model, recording[round(share * (len(recording) - 1))]) for share in SHARES]
    studio = Studio(model, moments, Film(size=SIZE))
    strip = np.concatenate([studio.picture(moment, 0.0) for moment in moments], axis=1)
    picture = Image.fromarray(strip)
    image = picture.quantize(palette=palette_of(picture, dark=False), dither=Image.Dither.FLOYDSTEINBERG)
    PICTURES.mkdir(exist_ok=True)
    image.save(PICTURES / f"{name}.png", optimize=True)
    claims = measurement.claims()
    print(f"{name}: {seconds:.0f} s, {sum(c.holds for c in claims)} of {len(claims)} claims hold", flush=True)
    return {
        "summary": demo.summary,
        "explanation": demo.explanation,
        "solver": demo.kinds[0],
        "tets": sum(len(body.mesh.tets) for body in scene.bodies),
        "frames": demo.steps,
        "dt": demo.dt,
        "claims": [{"text": c.text, "measured": c.measured, "holds": bool(c.holds)} for c in claims],
    }


def main(names: list[str]) -> None:
    known = json.loads(LIST.read_text(encoding="utf-8")) if LIST.exists() else {}
    with tempfile.TemporaryDirectory() as folder:
        for name in names or list(DEMOS):
            known[name] = draw_demo(name, Path(folder))
            ordered = {name: known[name] for name in DEMOS if name in known}
            LIST.write_text(json.dumps(ordered, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
