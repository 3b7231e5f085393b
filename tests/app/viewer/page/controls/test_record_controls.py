"""Screenshots and recordings of a live simulation."""

from types import SimpleNamespace

import numpy as np
import pytest


class Guest:
    """A visitor who stores received files, and whose browser renders one shade after the other."""

    def __init__(self):
        self.files, self.told, self.shade = {}, [], 0
        self.camera = SimpleNamespace(image_height=41, image_width=60)

    def send_file_download(self, name, content, **_):
        self.files[name] = content

    def add_notification(self, title, text, **_):
        self.told.append(text)

    def get_render(self, height, width, **_):
        self.shade += 20
        return np.full((height, width, 3), self.shade % 250, dtype=np.uint8)


@pytest.fixture
def guest():
    return Guest()


def test_recording_as_html_page(live, fake, guest, until):
    record, event = live.panel.record, SimpleNamespace(client=guest)
    record._toggle(event)
    assert record.record.label.startswith("Stop")
    for k in range(3):
        wanted = fake.show(positions=fake.snapshot.positions + 0.1, time=0.1 * (k + 1))
        until(lambda: live.stage.frame.time == wanted.time)  # noqa: B023
    until(lambda: len(record._frames) >= 4)
    record._toggle(event)
    assert record.record.label == "Record a page"
    assert b'<script id="data"' in guest.files["supple.html"]


def test_a_missing_picture_is_reported(live, guest):
    record = live.panel.record

    def nothing(*_, **__):
        raise TimeoutError("no frame")

    guest.get_render = nothing
    record._send_screenshot(SimpleNamespace(client=guest))
    assert guest.files == {}
    assert "no frame" in guest.told[0]
    guest.get_render = Guest.get_render.__get__(guest)
    record._send_screenshot(SimpleNamespace(client=guest))
    assert guest.files["supple.png"].startswith(b"\x89PNG")
