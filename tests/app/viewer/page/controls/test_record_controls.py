"""Screenshots and recordings of a live simulation."""

import html
from types import SimpleNamespace

import numpy as np
import pytest


class Guest:
    """A visitor who stores received files, and whose browser renders one shade after the other."""

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


def test_recording_as_html_page(live, fake, guest, until):
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


def test_recording_as_gif(live, guest, until):
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


def test_recording_as_mp4_contains_every_picture(live, guest, until, tmp_path):
    """The MP4 contains every picture in order, with its shade."""
    ffmpeg = pytest.importorskip("imageio_ffmpeg")
    record, event = live.panel.record, SimpleNamespace(client=guest)
    record.kind.value = "MP4"
    record._toggle(event)
    assert record.recording
    until(lambda: guest.shade >= 100)
    record._toggle(event)
    assert record._message.content == ""
    (tmp_path / "video.mp4").write_bytes(guest.files["supple.mp4"])
    reader = ffmpeg.read_frames(str(tmp_path / "video.mp4"))
    facts = next(reader)
    assert (facts["size"], facts["codec"]) == ((60, 40), "h264")
    shades = [np.frombuffer(frame, np.uint8).mean() for frame in reader]
    assert len(shades) >= 4
    wanted = 20.0 * np.arange(1, len(shades) + 1) % 250
    np.testing.assert_allclose(shades, wanted, atol=6.0)


def test_a_picture_of_another_size_is_refused(live, guest):
    """A browser can send anything."""
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


def test_a_missing_picture_is_reported(live, guest):
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


def test_a_missing_encoder_is_reported(live, guest, monkeypatch):
    monkeypatch.setattr("supple.app.viewer.drawing.video_capture.find_spec", lambda name: None)
    record = live.panel.record
    record.kind.value = "MP4"
    record._toggle(SimpleNamespace(client=guest))
    assert not record.recording
    assert "pip install 'supple[video]'" in html.unescape(record._message.content)
