"""Draw the pictures of docs/reference/live_page.md: `python docs/draw_live_page.py`.

It needs Chromium and the packages of the tests.
"""

from __future__ import annotations

import io
import shutil
from pathlib import Path

import numpy as np
from PIL import Image
from playwright.sync_api import sync_playwright

import supple as sp
from supple.app.viewer.app import opened_page
from supple.app.viewer.protocol.commands import Grab, Pause, Play, ReleaseGrab, Reset, SetParameter, SetSpeed, Step
from supple.app.viewer.protocol.live_source import LiveSource

FOLDER = Path(__file__).parent / "images"
FLAGS = "--headless --no-sandbox --disable-gpu --use-angle=swiftshader --enable-unsafe-swiftshader"
SIZE = {"width": 960, "height": 600}


def scene() -> LiveSource:
    """A bear with a fine skin, a ball, and two blocks that are stitched to each other."""
    rubber = sp.StableNeoHookean(youngs=6e4, poisson=0.45, density=1000.0, damping=0.01)
    skin = sp.shapes.gummy_bear_surface(height=0.5, resolution=36)
    mesh = sp.shapes.gummy_bear(height=0.5, edge_length=0.05)
    bear = sp.Body("bear", mesh, rubber, position=(0.0, 0.27, 0.0), skin=skin, friction=0.4)
    ball = sp.Body("ball", sp.shapes.sphere(radius=0.16, edge_length=0.06), rubber, position=(0.55, 0.2, 0.15))
    block = sp.shapes.box((0.3, 0.12, 0.2), (5, 2, 3))
    low = sp.Body("low", block, rubber, position=(-0.55, 0.08, 0.1), friction=0.4)
    high = sp.Body("high", block, rubber, position=(-0.55, 0.22, 0.1), friction=0.4)
    stitch = sp.SoftVertexTriangleStitch("high", "low", max_distance=0.03, youngs=5e4, poisson=0.45)
    floor = sp.HalfSpace(friction=0.6, name="floor")
    made = sp.Scene([bear, ball, low, high], obstacles=[floor], stitches=[stitch])
    return LiveSource("pictures", made, sp.XPBD(accuracy=0.1), 1 / 60)


def save(tab, name: str) -> None:
    """Save a picture of the page with few colors, so that the file is small."""
    shot = Image.open(io.BytesIO(tab.screenshot())).convert("RGB")
    shot.quantize(256, method=Image.Quantize.MEDIANCUT, dither=Image.Dither.FLOYDSTEINBERG).save(
        FOLDER / name, optimize=True
    )
    print(name, (FOLDER / name).stat().st_size // 1000, "kB")


def draw_live(tab, page) -> None:
    """All views of a live simulation."""
    simulation = page.content.simulation

    def settle(seconds: float = 3.0) -> None:
        tab.wait_for_timeout(1000 * seconds)

    def show(name: str, **values) -> None:
        set_values = """(values) => {
          const { fields } = supplePage.block.description;
          values.field = fields.find(({ key }) => key === values.field) ?? null;
          for (const control of supplePage.gui.controllersRecursive())
            if (control.domElement.dataset.name in values) control.setValue(values[control.domElement.dataset.name]);
        }"""
        tab.evaluate(set_values, values)
        settle()
        save(tab, name)

    simulation.send(Play())
    while simulation.latest().time < 0.5:
        settle(0.1)
    snapshot = simulation.latest()
    bear = snapshot.positions[snapshot.description.body("bear").vertices]
    ear = int(np.argmax(bear[:, 1]))
    target = tuple(float(x) for x in bear[ear] + np.array([-0.1, 0.5, 0.0]))
    simulation.send(Grab(1, "bear", (ear,), (1.0,), target, stiffness=0.05))
    settle()
    for command in (SetSpeed(0.05), Pause()):  # how fast it is here says nothing about the reader's computer
        simulation.send(command)
    settle()
    save(tab, "live.png")
    for command in (ReleaseGrab(1), SetSpeed(1.0), Reset(), SetParameter("youngs", 1.5e4), Step(15)):
        simulation.send(command)
    settle()
    show("live_stress.png", surface="tets", field="von_mises")
    show("live_exploded.png", field="J", explode=0.4)
    show("live_cut.png", field="energy", explode=0.0, axis=2, cut=0.5)
    for command in (Reset(), SetParameter("youngs", 6e4), Step(40)):
        simulation.send(command)
    settle()
    show("live_stitches.png", surface="skin", cut=0.0, contacts=True)


def main() -> None:
    """All pictures."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=FLAGS.split())
        with opened_page("pictures", 0) as page, page.simulating(scene()):
            tab = browser.new_page(viewport=SIZE)
            tab.set_default_timeout(120_000)
            tab.goto(page.url)
            tab.wait_for_timeout(4000)
            draw_live(tab, page)
            tab.close()
        browser.close()


if __name__ == "__main__":
    main()
