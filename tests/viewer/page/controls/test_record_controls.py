"""What is recorded from a running simulation, and who gets it."""

import html
from types import SimpleNamespace

import numpy as np
import pytest


class Guest:
    """A visitor who keeps the files that are sent, and whose browser shows one shade after the other."""

    def __init__(self):
        self.files, self.shade = {}, 0
        self.camera = SimpleNamespace(image_height=41, image_width=60)

    def send_file_download(self, name, content, **_):
        self.files[name] = content

    def get_render(self, height, width, **_):
        self.shade += 20
        return np.full((height, width, 3), self.shade % 250, dtype=np.uint8)


@pytest.fixture
def guest():
    return Guest()


def test_a_page_of_what_was_seen(live, fake, guest, until):
    record, event = live.panel.record, SimpleNamespace(client=guest)
    record._toggle(event)
    assert record.recording
    assert record.record.label == "Stop"
    for k in range(3):
        wanted = fake.show(positions=fake.snapshot.positions + 0.1, time=0.1 * (k + 1))
        until(lambda: live.stage.moment.time == wanted.time)  # noqa: B023
    until(lambda: len(record._moments) >= 4)
    record._toggle(event)
    assert not record.recording
    assert record.record.label == "Record"
    assert b"__VISER_EMBED_DATA__" in guest.files["supple.html"]


def test_a_film_of_what_the_browser_shows(live, guest, until):
    image = pytest.importorskip("PIL.Image")
    import io

    record, event = live.panel.record, SimpleNamespace(client=guest)
    record.kind.value = "GIF"
    record._toggle(event)
    until(lambda: guest.shade >= 80)
    record._toggle(event)
    with image.open(io.BytesIO(guest.files["supple.gif"])) as made:
        assert made.n_frames >= 3
        assert made.size == (60, 40)


def test_a_video_of_what_the_browser_shows(live, guest, until, tmp_path):
    """Every picture of it is in the MP4, in order and in its shade."""
    ffmpeg = pytest.importorskip("imageio_ffmpeg")
    record, event = live.panel.record, SimpleNamespace(client=guest)
    record.kind.value = "MP4"
    record._toggle(event)
    assert record.recording
    until(lambda: guest.shade >= 100)
    record._toggle(event)
    assert record._message.content == ""
    (tmp_path / "film.mp4").write_bytes(guest.files["supple.mp4"])
    reader = ffmpeg.read_frames(str(tmp_path / "film.mp4"))
    facts = next(reader)
    assert (facts["size"], facts["codec"]) == ((60, 40), "h264")
    shades = [np.frombuffer(frame, np.uint8).mean() for frame in reader]
    assert len(shades) >= 4
    wanted = 20.0 * np.arange(1, len(shades) + 1) % 250
    np.testing.assert_allclose(shades, wanted, atol=6.0)


def test_a_picture_of_another_size_than_asked_for_is_not_taken(live, guest):
    """A browser may say and send anything."""
    record = live.panel.record
    guest.camera = SimpleNamespace(image_height=1e300, image_width=1e300)
    asked = []

    def another(height, width, **_):
        asked.append((height, width))
        return np.zeros((height + 2, width, 3), dtype=np.uint8)

    guest.get_render = another
    record._send_screenshot(SimpleNamespace(client=guest))
    assert asked == [(2160, 2160)]
    assert guest.files == {}
    assert "another size" in record._message.content


def test_a_browser_that_sends_no_picture_is_told(live, guest):
    record = live.panel.record

    def nothing(*_, **__):
        raise TimeoutError("no frame")

    guest.get_render = nothing
    record._send_screenshot(SimpleNamespace(client=guest))
    assert guest.files == {}
    assert "no frame" in record._message.content
    guest.get_render = Guest.get_render.__get__(guest)
    record._send_screenshot(SimpleNamespace(client=guest))
    assert guest.files["supple.png"].startswith(b"\x89PNG")


def test_what_is_not_installed_is_said(live, guest, monkeypatch):
    monkeypatch.setattr("supple.viewer.drawing.video_capture.find_spec", lambda name: None)
    record = live.panel.record
    record.kind.value = "MP4"
    record._toggle(SimpleNamespace(client=guest))
    assert not record.recording
    assert "pip install 'supple[video]'" in html.unescape(record._message.content)
