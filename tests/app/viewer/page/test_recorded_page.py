"""Pages of recordings."""

import time

import numpy as np
import pytest

import supple as sp
from supple.results.recording.reader import read_recording
from supple.results.recording.recorder import Recorder
from supple.results.view.from_recording import evenly, model_of_recording, render_frame_of
from supple.results.view.options import ViewOptions
from supple.results.view.page import page_of_frames
from supple.results.view.stage import Stage

STEPS = 30


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """A ball that flies to the right in half a second."""
    path = tmp_path_factory.mktemp("replay") / "recording.vtkhdf"
    rubber = sp.StableNeoHookean(youngs=1e5, poisson=0.4)
    ball = sp.Body("ball", sp.shapes.sphere(radius=0.3, edge_length=0.25), rubber, velocity=(2.0, 0.0, 0.0))
    scene = sp.Scene([ball], gravity=(0.0, -1.0, 0.0))
    for _ in sp.simulate(scene, sp.XPBD(substeps=2), 1 / 60, STEPS, sinks=[Recorder(path)]):
        pass
    return path


def test_exported_pages_keep_times_and_drop_frames_above_the_limit(recorded, monkeypatch):
    from supple.results.view import page as module

    with read_recording(recorded) as recording:
        model = model_of_recording(recording)
        taken = [(frame.time, render_frame_of(model, frame)) for frame in recording]
        whole = page_of_frames(taken, ViewOptions("tets", "volume ratio J"))
        monkeypatch.setattr(module, "_MOST_BYTES", 1)
        thin = page_of_frames(taken, ViewOptions("tets", "volume ratio J"))
    assert len(thin) < len(whole)
    assert "<title>ball · Supple</title>" in thin
    assert evenly(10, 4) == [0, 3, 6, 9]
    assert evenly(3, 9) == [0, 1, 2]


def test_a_page_with_the_volume_ratio_plays_alone(recorded, browser, pixels, tmp_path):
    with read_recording(recorded) as recording:
        model = model_of_recording(recording)
        render_frames = [(frame.time, render_frame_of(model, frame)) for frame in recording]
        (tmp_path / "page.html").write_text(page_of_frames(render_frames, ViewOptions("tets", "von Mises stress")))
    plays_alone(browser, pixels, tmp_path / "page.html")


def plays_alone(browser, pixels, file):
    """An exported page draws a body in colors of viridis, moves it, and needs nothing else."""
    tab = browser.new_page(viewport={"width": 480, "height": 320})
    tab.set_default_timeout(90_000)
    asked, errors = [], []
    tab.on("request", lambda request: asked.append(request.url))
    tab.on("pageerror", lambda error: errors.append(str(error)))
    tab.on("console", lambda message: errors.append(message.text) if message.type == "error" else None)
    tab.goto(file.as_uri())
    places, end = [], time.monotonic() + 90.0
    while time.monotonic() < end and not (len(places) > 2 and max(places) - min(places) > 40):
        tab.wait_for_timeout(100)
        r, g, b = np.moveaxis(pixels(tab)[:260, 160:], 2, 0)
        colored = np.maximum(np.maximum(r, g), b) - np.minimum(np.minimum(r, g), b) > 60
        if colored.sum() > 100:
            places.append(np.nonzero(colored)[1].mean())
    title = tab.title()
    tab.close()
    assert (title, errors) == ("ball · Supple", [])
    assert places, "the body was never drawn"
    assert max(places) - min(places) > 40
    # What the page has made itself is not asked of anybody.
    assert [item for item in asked if not item.startswith("blob:")] == [file.as_uri()]


def test_stitches_of_recordings_are_drawn(server, tmp_path):
    block, rubber = sp.shapes.box((0.2, 0.1, 0.2), (2, 1, 2)), sp.StableNeoHookean(youngs=1e5, poisson=0.4)
    bodies = [sp.Body("low", block, rubber), sp.Body("high", block, rubber, position=(0.0, 0.11, 0.0))]
    stitch = sp.SoftVertexTriangleStitch("high", "low", max_distance=0.02, youngs=5e4, poisson=0.4)
    path = tmp_path / "stitched.vtkhdf"
    for _ in sp.simulate(sp.Scene(bodies, stitches=[stitch]), sp.XPBD(substeps=2), 1 / 60, 1, sinks=[Recorder(path)]):
        pass
    with read_recording(path) as recording:
        model = model_of_recording(recording)
        Stage(server, render_frame_of(model, recording[0]), ViewOptions())
        drawn = server.scene._handle_from_node_name["/stitches"].points
        assert len(drawn) == len(recording.stitches) > 0
        assert np.all(np.linalg.norm(drawn[:, 1] - drawn[:, 0], axis=1) < 0.15)
