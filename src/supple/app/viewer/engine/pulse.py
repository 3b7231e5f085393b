"""Tells the page how a long step proceeds."""

from __future__ import annotations

import threading

from supple.app.viewer.engine.step_watch import StepWatch
from supple.app.viewer.protocol.outbox import Outbox

# A step that takes longer is reported [s], as often.
LONG = 0.5


def report_long_steps(watch: StepWatch, outbox: Outbox) -> None:
    """Send the progress of steps that take long, from another thread: the loop is within the step."""
    tick = threading.Event()

    def run() -> None:
        while not tick.wait(LONG):
            progress = watch.progress
            if progress is not None and progress.seconds > LONG:
                outbox.put_progress(progress)

    threading.Thread(target=run, name="pulse", daemon=True).start()
