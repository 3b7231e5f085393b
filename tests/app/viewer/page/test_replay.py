"""Recordings on the page, and their exports."""

import time

import numpy as np
import pytest

import supple as sp
from supple.app.viewer.app import opened_page
from supple.app.viewer.replay import Replay
from supple.results.recording.reader import read_recording
from supple.results.recording.recorder import Recorder
from supple.results.view.from_recording import evenly, model_of_recording, moment_of_frame
from supple.results.view.options import ViewOptions
from supple.results.view.page import page_of_moments

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


@pytest.fixture
def replay(server, recorded):
    with read_recording(recorded) as recording:
        made = Replay(server, recording)
        yield made
        made.stop()


def test_it_plays_in_a_loop(replay, until):
    seen = set()

    def all_of_it():
        seen.add(round(replay.stage.moment.time, 6))
        return len(seen) > 10 and max(seen) > 0.4 and replay.stage.moment.time < 0.2

    until(all_of_it, what="the second round")


def test_the_slider_selects_a_frame(replay, server, visit, until):
    visitor = visit(server.get_port())
    until(server.get_clients)
    # Paused first: a playing slider may already have the value that the visitor sets.
    visitor.press(replay.play)
    until(lambda: not replay.playing)
    for number in (7, 0, STEPS):
        visitor.set(replay.slider, float(replay._recording.times[number]))
        until(lambda: not replay.playing and replay.stage.moment is replay.moment(number))  # noqa: B023
        until(lambda: f"Frame {number} of {STEPS}" in replay.message.content)  # noqa: B023
    visitor.press(replay.play)
    until(lambda: replay.playing)
    visitor.leave()


def test_the_final_slider_value_is_sent_to_a_visitor_who_moves_it(replay, server, visit, until):
    visitor = visit(server.get_port())
    until(server.get_clients)
    aim = float(replay._recording.times[7]) + 1e-3  # a value that playing never sets
    visitor.set(replay.slider, aim)
    until(lambda: not replay.playing and replay.stage.moment is replay.moment(7))
    # A value of playing may arrive after that of the visitor; viser sends only values that differ from the last one.
    until(lambda: replay.slider.value not in (aim, replay._recording.times[7]))
    assert replay.slider.value == pytest.approx(aim, abs=1e-12)
    visitor.leave()


def test_frames_at_times_between_and_beyond_frames(replay):
    times = replay._recording.times
    assert replay.frame_at(-1.0) == 0
    assert replay.frame_at(99.0) == STEPS
    for number in range(STEPS + 1):
        assert replay.frame_at(float(times[number])) == number


def test_exported_pages_keep_times_and_drop_frames_above_the_limit(recorded, monkeypatch):
    from supple.results.view import page as module

    with read_recording(recorded) as recording:
        model = model_of_recording(recording)
        taken = [(frame.time, moment_of_frame(model, frame)) for frame in recording]
        whole = page_of_moments(taken, ViewOptions("tets", "volume ratio J"))
        monkeypatch.setattr(module, "_MOST_BYTES", 1)
        thin = page_of_moments(taken, ViewOptions("tets", "volume ratio J"))
    assert len(thin) < len(whole)
    assert "<title>ball · Supple</title>" in thin
    assert evenly(10, 4) == [0, 3, 6, 9]
    assert evenly(3, 9) == [0, 1, 2]


def test_a_recording_in_the_browser(recorded, look, browser, pixels, spot, tmp_path):
    """Pause, the slider, colors with their legend, a screenshot, and a page with stress from the export button."""
    with opened_page(recorded, 0) as page:
        screen, replay = look(page.url + "&fixedDpr=0.5", page.server), page.content
        where = lambda: spot(screen.shot()[:330], "red")  # noqa: E731 - above the legend
        agree = lambda: screen.reads(replay.slider) == pytest.approx(replay.slider.value, abs=1e-9)  # noqa: E731
        screen.tab.keyboard.press(" ")
        screen.wait(lambda: not replay.playing, "the pause")
        screen.wait(agree, "the time that is shown in the browser's slider")
        screen.slide(replay.slider, "Home")
        screen.wait(lambda: replay.stage.moment is replay.moment(0), "the first frame")
        screen.wait(lambda: where()[0] > 100, "the ball")
        left = where()[1][0]
        screen.slide(replay.slider, "End")
        screen.wait(lambda: replay.stage.moment is replay.moment(STEPS), "the last frame")
        screen.wait(lambda: abs(where()[1][0] - left) > 40, "the last frame in the picture")
        screen.tab.get_by_text("Record", exact=True).first.click()
        with screen.tab.expect_download(timeout=90_000) as screenshot:
            screen.press("Screenshot")
        picture = pytest.importorskip("PIL.Image").open(screenshot.value.path())
        assert spot(np.asarray(picture.convert("RGB")).astype(int), "red")[0] > 100
        screen.choose(replay.controls.color_by, "von Mises stress")
        screen.wait(lambda: where()[0] == 0, "the colors of the stress in the picture")
        screen.wait(lambda: screen.tab.locator("#supple-legend .bar").is_visible(), "the legend")
        with screen.tab.expect_download(timeout=90_000) as export:
            screen.press("Export as page (HTML)")
        export.value.save_as(tmp_path / "page.html")
        assert screen.errors == []
        screen.close()
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
    assert [each for each in asked if not each.startswith("blob:")] == [file.as_uri()]


def test_stitches_of_recordings_are_drawn(server, tmp_path):
    block, rubber = sp.shapes.box((0.2, 0.1, 0.2), (2, 1, 2)), sp.StableNeoHookean(youngs=1e5, poisson=0.4)
    bodies = [sp.Body("low", block, rubber), sp.Body("high", block, rubber, position=(0.0, 0.11, 0.0))]
    stitch = sp.SoftVertexTriangleStitch("high", "low", max_distance=0.02, youngs=5e4, poisson=0.4)
    path = tmp_path / "stitched.vtkhdf"
    for _ in sp.simulate(sp.Scene(bodies, stitches=[stitch]), sp.XPBD(substeps=2), 1 / 60, 1, sinks=[Recorder(path)]):
        pass
    with read_recording(path) as recording:
        Replay(server, recording).stop()
        drawn = server.scene._handle_from_node_name["/stitches"].points
        assert len(drawn) == len(recording.stitches) > 0
        assert np.all(np.linalg.norm(drawn[:, 1] - drawn[:, 0], axis=1) < 0.15)
