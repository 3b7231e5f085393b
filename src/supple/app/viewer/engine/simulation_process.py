"""The main function of the simulation process: connects the pipes with the loop."""

from __future__ import annotations

import gc
import logging
import os
import signal
import threading
from multiprocessing.connection import Connection
from typing import TYPE_CHECKING

from supple.app.viewer.engine.step_watch import StepWatch
from supple.app.viewer.protocol.command_queue import CommandQueue
from supple.app.viewer.protocol.live_source import LiveSource
from supple.app.viewer.protocol.outbox import Outbox
from supple.errors import SuppleError

if TYPE_CHECKING:
    from supple.app.viewer.engine.scene.live_scene import LiveScene


def run_simulation(
    source: LiveSource, commands: Connection, snapshots: Connection, log_level: int, applied: int
) -> None:
    """Simulate until the other end of `commands` is closed, by `Engine.close` or by the end of the page's process.

    Parameters
    ----------
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
        _simulate(source, inbox, snapshots, applied)


def _simulate(source: LiveSource, inbox: CommandQueue, snapshots: Connection, applied: int) -> None:
    from supple.app.viewer.engine.scene.live_scene import LiveScene
    from supple.app.viewer.engine.simulation_loop import SimulationLoop
    from supple.app.viewer.protocol.outbox import ERROR, Outbox, packed
    from supple.results.progress import CompileBar

    try:
        live = LiveScene(source)
        with CompileBar() as kernels:
            live.warm_up()
            live, chosen = _in_time(live)
            kernels.compile_rest()  # the first contact, too, does not wait for it
        # Otherwise a collection looks at the objects of all loaded libraries, for a tenth of a second or more.
        gc.freeze()
    except (SuppleError, MemoryError) as error:
        snapshots.send_bytes(packed(ERROR, " ".join(str(error).split()) or type(error).__name__))
        return
    loop = SimulationLoop(live, inbox, Outbox(snapshots))
    loop.applied = applied
    if chosen:
        logging.getLogger(__name__).info("%s", chosen)
        loop.notify("info", chosen)
    report_long_steps(loop.watch, loop.outbox)
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
