"""The main function of the simulation process: connects the pipes with the loop."""

from __future__ import annotations

import gc
import logging
import os
import pickle
import signal
import threading
import time
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import TYPE_CHECKING

from supple.app.viewer.protocol.command_queue import CommandQueue
from supple.app.viewer.protocol.live_source import LiveSource
from supple.app.viewer.protocol.outbox import Outbox
from supple.app.viewer.protocol.snapshots import Progress
from supple.errors import SuppleError

if TYPE_CHECKING:
    from supple.app.viewer.engine.scene.live_scene import LiveScene


def run_simulation(source: bytes, commands: Connection, snapshots: Connection, log_level: int, applied: int) -> None:
    """Simulate until the other end of `commands` is closed, by `Engine.close` or by the end of the page's process.

    Parameters
    ----------
    source : a pickled `LiveSource`, with the functions that it has
    applied : number of the last command to an earlier simulation of the same page
    """
    # Ctrl-C in a terminal reaches both processes; the process of the page ends this one.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    logging.basicConfig(level=log_level, format="%(levelname)s: %(message)s")
    inbox = CommandQueue()
    threading.Thread(target=_read, args=(commands, inbox), name="inbox", daemon=True).start()

    import numba

    from supple.runtime.threads import numba_threads

    # One core is left to the page and the browser: a kernel waits long for a thread that does not get a core.
    with numba_threads(max(1, numba.get_num_threads() - 1)):
        _simulate(pickle.loads(source), inbox, snapshots, applied)


def _simulate(source: LiveSource, inbox: CommandQueue, snapshots: Connection, applied: int) -> None:
    from supple.results.progress import CompileBar

    outbox, began = Outbox(snapshots), time.monotonic()
    with CompileBar() as kernels:
        pulse = Pulse(outbox, lambda: Progress(time.monotonic() - began, 0, kernels.current(), pulse.stage))
        try:
            from supple.app.viewer.engine.scene.live_scene import LiveScene

            pulse.stage = "preparing the scene"
            live = LiveScene(source)
            pulse.stage = "measuring steps"
            live.warm_up()
            live, chosen = _in_time(live)
            pulse.stage = "loading kernels"
            kernels.compile_rest()  # the first contact, too, does not wait for it
        except (SuppleError, MemoryError) as error:
            outbox.put_error(" ".join(str(error).split()) or type(error).__name__)
            return
    # Otherwise a collection looks at the objects of all loaded libraries, for a tenth of a second or more.
    gc.freeze()
    from supple.app.viewer.engine.simulation_loop import SimulationLoop

    loop = SimulationLoop(live, inbox, outbox)
    loop.applied = applied
    if chosen:
        logging.getLogger(__name__).info("%s", chosen)
        loop.notify("info", chosen)
    pulse.progress = lambda: loop.watch.progress
    loop.run()


def _in_time(live: LiveScene) -> tuple[LiveScene, str]:
    """The live scene, or where it is slower than real time, by counts, one that is faster; and what was chosen."""
    from supple.app.viewer.engine.scene.lightening import coarsened, linearized
    from supple.app.viewer.engine.scene.live_scene import LiveScene

    if not live.source.real_time:
        return live, ""
    chosen = []
    for choice in (linearized, coarsened):
        found = choice(live)
        if found is None:
            continue
        try:
            other = LiveScene(found[0])
            other.warm_up()
        except SuppleError:  # its surfaces are others, and may intersect at the start; or the solver lacks something
            continue
        if other.report.status.can_go_on:
            live = other
            chosen.append(found[1])
    line = f"to keep up with real time, the page {' and '.join(chosen)}; supple view --full keeps the scene as it is"
    return live, line if chosen else ""


def _read(commands: Connection, inbox: CommandQueue) -> None:
    while True:
        try:
            inbox.put_all(commands.recv())
        except (EOFError, OSError):
            break
        except Exception:
            logging.getLogger(__name__).exception("commands could not be read")
    inbox.close()
    # The loop may be within a long step, and its result is not needed.
    os._exit(0)


LONG = 0.5  # what takes longer is reported [s], as often


class Pulse:
    """Sends the progress of what takes long, from another thread: the simulation is within it.

    Attributes
    ----------
    progress : of what is done now, or None; stage : of the start
    """

    def __init__(self, outbox: Outbox, progress: Callable[[], Progress | None], stage: str = "") -> None:
        self.progress, self.stage, self._outbox = progress, stage, outbox
        threading.Thread(target=self._run, name="pulse", daemon=True).start()

    def _run(self) -> None:
        tick = threading.Event()
        while not tick.wait(LONG):
            progress = self.progress()
            if progress is not None and progress.seconds > LONG:
                self._outbox.put_progress(progress)
