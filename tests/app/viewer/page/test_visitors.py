"""Many and slow visitors: they do not block the page, and no queue grows."""

import threading
import time

import numpy as np
import pytest

import supple as sp


@pytest.fixture
def busy(server, fake):
    """A page of a simulation that sends new snapshots all the time."""
    from supple.app.viewer.live_page import LivePage

    page, end = LivePage(server, fake, fake.snapshot), threading.Event()
    rest = fake.snapshot.positions

    def run():
        while not end.wait(0.005):
            fake.show(positions=rest + 0.1 * np.sin(fake.snapshot.frame), time=0.01 * fake.snapshot.frame)

    thread = threading.Thread(target=run)
    thread.start()
    yield page
    end.set()
    thread.join()
    page.stop()


def test_a_visitor_who_never_reads_does_not_block_others(busy, server, visit, until):
    stuck = visit(server.get_port(), reads=False)
    others = [visit(server.get_port()) for _ in range(9)]
    until(lambda: len(server.get_clients()) == 10)
    buffer = server._websock_server.get_message_buffer()
    before = busy.controller.snapshot.frame
    kept, taken = [], [other.taken for other in others]

    def well():
        kept.append(len(buffer.message_from_id))
        served = all(other.taken > before + 20 for other, before in zip(others, taken, strict=True))
        return served and busy.controller.snapshot.frame > before + 50 and len(kept) > 50

    until(well, 60.0)
    # For the visitor who never reads, only the newest values are kept.
    assert max(kept) <= min(kept) + 20
    for visitor in (stuck, *others):
        visitor.leave()


def test_the_frame_rate_decreases_where_the_server_falls_behind(server, until, monkeypatch):
    from supple.app.viewer import frame_rate as frame_rate_module
    from supple.app.viewer.frame_rate import FASTEST, FrameRate

    frame_rate = FrameRate(server)
    loop = server.get_event_loop()
    for late in (1, 2):
        free = threading.Event()
        loop.call_soon_threadsafe(free.wait, 20.0)
        with frame_rate.sending():
            pass
        assert not frame_rate.may_send()
        time.sleep(0.1)
        free.set()
        until(frame_rate.may_send)
        # The delay of the server counts like drawing. One late picture does not delay those after it.
        assert frame_rate.interval == FASTEST if late == 1 else frame_rate.interval >= 0.2
    clock = time.monotonic()
    monkeypatch.setattr(frame_rate_module.time, "monotonic", lambda: clock)
    for _ in range(2):
        frame_rate._processed(clock, 0.0)
    assert frame_rate.interval == FASTEST


def test_pictures_go_on_after_one_that_raises(server, until):
    from supple.app.viewer.frame_rate import FrameRate

    frame_rate = FrameRate(server)
    with pytest.raises(ValueError, match="no picture"), frame_rate.sending():
        raise ValueError("no picture")
    until(frame_rate.may_send)


def test_fine_skins_follow_their_tets_without_a_python_loop(fake):
    """The work for every picture: 100k vertices, with bounded work for each and without a Python loop."""
    from supple.mesh.skin import Embedding, Skin

    mesh = sp.shapes.box(size=(1.0, 1.0, 1.0), divisions=(8, 8, 8))
    points = np.random.default_rng(0).uniform(-0.5, 0.5, (100_000, 3))
    held = Embedding.of(mesh, points)
    skin = Skin(held.corners, held.weights, np.zeros((0, 3), dtype=np.int32))
    stretch = np.diag([1.0, 2.0, 0.5])
    np.testing.assert_allclose(skin.positions(mesh.vertices @ stretch), points @ stretch, atol=1e-9)
