"""The page survives random events of several visitors, with a real websocket."""

import random
import time

import numpy as np

from supple.app.viewer.from_snapshot import RenderFrameBuilder
from supple.app.viewer.protocol.commands import SetSpeed
from supple.app.viewer.protocol.snapshots import GrabState


def test_a_thousand_random_events(live, server, fake, visit, until, caplog, capfd):
    """Three visitors send random events, also places that no page would send; the page continues."""
    visitors = [visit(server.get_port()) for _ in range(3)]
    until(lambda: len(server.get_clients()) == 3)
    rng = random.Random(3)
    texts = ("", "30 kPa", "2e3", "-1", "1e300", "soft", "nan")
    numbers = (0.0, 0.5, -2.0, 1e9, float("nan"), float("inf"))
    for k in range(1000):
        visitor = rng.choice(visitors)
        handles = list(server.gui._gui_input_handle_from_uuid.values())
        what = rng.random()
        if what < 0.6:
            handle = rng.choice(handles)
            options = getattr(handle, "options", None)
            if options:
                value = rng.choice(options)
            elif isinstance(handle.value, str):
                value = rng.choice(texts)
            elif isinstance(handle.value, bool):
                value = rng.random() < 0.5
            elif isinstance(handle.value, (int, float)):
                ends = [-10.0 if handle.min is None else handle.min, 10.0 if handle.max is None else handle.max]
                value = rng.uniform(*ends)
                if isinstance(handle.value, float) and rng.random() < 0.2:
                    value = rng.choice(numbers)
            else:
                continue
            visitor.set(handle, value)
        elif what < 0.9:
            handle = rng.choice(live.stage.body_handles)
            phase = rng.choice(("start", "update", "update", "end"))
            visitor.drag(handle, phase, rng.choices(numbers, k=3), rng.choices(numbers, k=3))
        else:
            handle = rng.choice(live.stage.body_handles)
            visitor.click(handle, rng.choices(numbers, k=3), rng.choices(numbers, k=3))
        if k % 100 == 0:
            grabs = (GrabState(1, "body 0", (0.0, 0.0, 0.0), (1.0, 0.0, 0.0)),) if rng.random() < 0.5 else ()
            fake.show(grabs=grabs, time=0.01 * k)
    # All events have been handled once the last value has arrived; another visitor may have been faster.
    factors = iter(np.linspace(0.2, 0.9, 1000).round(4))

    def heard(visitor, message):
        message.append(float(next(factors)))
        visitor.set(live.panel.time.speed.handle, message[-1])
        time.sleep(1.2)  # a number counts when nothing more is typed
        return any(SetSpeed(factor) in fake.received for factor in message)

    for visitor in visitors:
        message = []
        until(lambda: heard(visitor, message), 60.0)  # noqa: B023 - it is asked for here and now
    fake.show(time=99.0)
    until(lambda: live.controller.snapshot.time == 99.0)
    assert len(server.get_clients()) == 3
    assert caplog.records == []
    printed = capfd.readouterr()
    assert "Traceback" not in printed.out + printed.err
    assert RenderFrameBuilder().frame(fake.snapshot).positions is not None
    for visitor in visitors:
        visitor.leave()
