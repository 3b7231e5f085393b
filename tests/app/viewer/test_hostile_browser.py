"""A live page and browsers that send arbitrary messages, without effect on the simulation."""

import contextlib
import random
import threading
import time

import msgspec
import numpy as np
import pytest
import viser
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from supple.app.viewer.app import Address, opened_page
from supple.app.viewer.engine.engine import Engine
from supple.app.viewer.protocol.commands import Pause, Play, Reset, SetSpeed

from .conftest import small_source
from .server.test_gate import MALFORMED, camera

TIMEOUT = 120.0  # the first step compiles [s]


@pytest.fixture(scope="module")
def page():
    with opened_page(small_source(), Address(port=0)) as page, dial(page) as watcher:
        watcher.send(camera())  # time stands still where nobody watches
        threading.Thread(target=read, args=(watcher,), daemon=True).start()
        yield page


@pytest.fixture
def engine(page):
    engine = page.content.controller.simulation
    assert isinstance(engine, Engine)
    engine.wait_for(engine.send(Reset()), TIMEOUT)
    return engine


def dial(page):
    url = page.url.replace("http", "ws", 1)
    return connect(url, subprotocols=[f"viser-v{viser.__version__}"], max_size=None, open_timeout=TIMEOUT)


def read(tab):
    with contextlib.suppress(ConnectionClosed):
        for _ in tab:
            pass


def until_frame(engine, frame):
    end = time.monotonic() + TIMEOUT
    while (snapshot := engine.latest()).frame < frame:
        assert engine.alive
        assert time.monotonic() < end, "time stands still"
        time.sleep(0.01)
    return snapshot


def test_malformed_messages_do_not_change_the_simulation(page, engine):
    engine.send(Play())
    until_frame(engine, 2)
    for raw in MALFORMED.values():
        with contextlib.suppress(ConnectionClosed), dial(page) as bad:
            bad.send(raw)
    played = until_frame(engine, engine.latest().frame + 5)
    engine.wait_for(engine.send(Pause()), TIMEOUT)
    assert played.notices == ()
    # The simulation is bit for bit the same as without a browser.
    import supple as sp

    source = small_source()
    *_, last = sp.simulate(source.scene, source.solver, source.dt, engine.latest().frame)
    assert np.array_equal(engine.latest().positions, last.state.positions)


def test_ten_tabs_that_never_read_do_not_block_the_server(page, engine):
    engine.send(Play())
    tabs = [dial(page) for _ in range(10)]
    for tab in tabs:
        tab.send(camera())
    until_frame(engine, 30)
    for tab in tabs:
        tab.socket.close()  # without a closing handshake
    until_frame(engine, engine.latest().frame + 10)


def test_random_valid_messages_to_every_input_leave_a_finite_state(page, engine):
    engine.send(Play())
    rng = random.Random(3)
    nonsense = [-1, 0, 1, 7, 1e300, -1e300, 2**60, True, False, None, "", "x" * 2000, [], [1, 2], {}, {"a": [1]}, "1e5"]
    uuids = list(page.server.gui._gui_input_handle_from_uuid)
    assert len(uuids) > 10
    with dial(page) as tab:
        tab.send(camera())
        for k in range(1000):
            uuid = rng.choice([*uuids, "no such input"])
            update = {"type": "GuiUpdateMessage", "uuid": uuid, "updates": {"value": rng.choice(nonsense)}}
            with contextlib.suppress(ConnectionClosed):
                tab.send(msgspec.msgpack.encode(update))
            if k % 100 == 0:
                assert np.isfinite(engine.latest().positions).all()
        tab.ping().wait(TIMEOUT)
    snapshot = engine.wait_for(engine.send(Pause()), TIMEOUT)
    assert engine.alive
    assert np.isfinite(snapshot.positions).all()
    with dial(page) as tab:  # and the next visitor gets the page
        assert tab.recv(timeout=TIMEOUT)
    # The last messages are still handled, in threads: they may pause, reset or slow the time down again.
    end, still = time.monotonic() + TIMEOUT, engine.latest().frame
    while engine.latest().frame == still:
        assert engine.alive
        assert time.monotonic() < end, "time stands still"
        engine.send(SetSpeed(1.0))
        engine.send(Play())
        time.sleep(0.1)
