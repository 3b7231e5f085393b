"""The page of a recording, which `tests/app/viewer/page/test_recorded_page.py` plays in a browser."""

import numpy as np

from supple.results.recording.reader import read_recording
from supple.results.view import page as page_module
from supple.results.view.from_recording import model_of_recording, render_frame_of
from supple.results.view.page import write_page


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
    frame = render_frame_of(model, recording[5])
    np.testing.assert_allclose(page_module._rounded(frame).positions, frame.positions, atol=0.51 * quantum)


def test_pages_of_open_recordings_leave_them_open(tmp_path, recorded):
    with read_recording(recorded[0]) as recording:
        write_page(recording, tmp_path / "index.html")
        assert recording[3].report.iterations == 3
