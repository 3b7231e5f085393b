"""The page plays in a browser without a network."""

from __future__ import annotations

import time

import numpy as np

from supple.results.recording.reader import read_recording
from supple.results.view import page as page_module
from supple.results.view.from_recording import model_of_recording, moment_of_frame
from supple.results.view.page import write_page


def test_the_page_plays_in_a_browser(tmp_path, tools, browser, pixels):
    tools.record(tmp_path / "r.vtkhdf", 30)
    page_file = write_page(tmp_path / "r.vtkhdf", tmp_path / "index.html")
    page = browser.new_page(viewport={"width": 480, "height": 360})
    page.set_default_timeout(90_000)
    errors, asked = [], []
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.on("console", lambda message: errors.append(message.text) if message.type == "error" else None)
    page.on("request", lambda request: asked.append(request.url))
    page.goto(page_file.as_uri())
    page.wait_for_selector("canvas")
    shots, end = [], time.monotonic() + 90.0
    while time.monotonic() < end:  # until bodies are drawn, and have moved
        page.wait_for_timeout(250)
        shots.append(pixels(page)[:300])  # above the player's bar
        if _red(shots[0]) <= 100:
            shots = shots[1:]
        elif _moved(shots[0], shots[-1]) > 200:
            break
    title = page.title()
    page.close()
    assert errors == []
    assert [url for url in asked if not url.startswith("blob:")] == [page_file.as_uri()]
    assert title == "cube, slab · Supple"
    assert shots, "the red body was never drawn"
    assert _moved(shots[0], shots[-1]) > 200


def _red(shot: np.ndarray) -> int:
    """Pixels of the color of the first body; only the orange edge of the warning has it too."""
    return int(np.count_nonzero((shot[..., 0] - shot[..., 2] > 60) & (shot[..., 1] < 140)))


def _moved(a: np.ndarray, b: np.ndarray) -> int:
    return int(np.count_nonzero(np.abs(a - b).max(axis=2) > 60))


def test_pages_are_self_contained_and_leave_no_server(tmp_path, recorded, capfd):
    import threading

    path = write_page(recorded[0], tmp_path / "index.html")
    assert list(tmp_path.iterdir()) == [path]
    text = path.read_text(encoding="utf-8")
    assert "__VISER_EMBED_DATA__" in text
    assert "<title>cube, slab · Supple</title>" in text
    assert capfd.readouterr().out == ""
    assert not [t for t in threading.enumerate() if "viser" in t.name.lower()]


def test_long_recordings_are_shown_with_fewer_frames(tmp_path, recorded, monkeypatch):
    whole = write_page(recorded[0], tmp_path / "whole.html").stat().st_size
    monkeypatch.setattr(page_module, "_MOST_BYTES", 2000)
    assert write_page(recorded[0], tmp_path / "thin.html").stat().st_size < whole


def test_vertices_are_rounded_by_less_than_a_pixel(recording):
    model = model_of_recording(recording)
    quantum = page_module.quantum_of(model.view)
    assert quantum < 2.0 * model.view.radius / 4000.0
    moment = moment_of_frame(model, recording[5])
    np.testing.assert_allclose(page_module._rounded(moment).positions, moment.positions, atol=0.51 * quantum)


def test_pages_of_open_recordings_leave_them_open(tmp_path, recorded):
    with read_recording(recorded[0]) as recording:
        write_page(recording, tmp_path / "index.html")
        assert recording[3].report.iterations == 3
