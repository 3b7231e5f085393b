"""The cost of the live page: the same frames without it, in its process, and with the page served, alternately.

A ball of 5k tets falls on a floor. Each round simulates the same frames in all three ways, as fast as possible. Ratios
are computed within a round, and their median over the rounds, which reduces the effect of other load on the machine.
Then the last two ways run in real time.

usage: python -m benchmarks.live
"""

from __future__ import annotations

import contextlib
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from statistics import median
from typing import Any

import supple as sp
from benchmarks.table import circumstances
from supple.app.viewer.app import opened_page
from supple.app.viewer.engine.engine import Engine
from supple.app.viewer.protocol.commands import Play, Reset, Step
from supple.app.viewer.protocol.live_source import LiveSource

WAYS = {
    "headless": "simulate(), no page",
    "engine": "in the simulation process, snapshots read at 60 Hz",
    "page": "the same with a served page, and a websocket that reads all messages",
}
LISTEN = """
import sys
from websockets.sync.client import connect
with connect(sys.argv[1], max_size=None, compression=None) as page:
    print("connected", flush=True)
    for message in page:
        if isinstance(message, bytes):
            page.send('{"act": "drawn"}')
"""


def source(edge_length: float) -> LiveSource:
    """A ball half a meter above the floor."""
    ball = sp.Body(
        "ball",
        sp.shapes.sphere(radius=0.5, edge_length=edge_length),
        sp.EdgesAndVolume(edge_compliance=1e-4, density=1000.0, damping=0.003),
        position=(0.0, 1.0, 0.0),
    )
    return LiveSource("ball", sp.Scene([ball], [sp.HalfSpace(friction=0.5)]), sp.XPBD(), 1 / 60)


def headless(live: LiveSource, frames: int) -> float:
    """Wall-clock time per frame of `simulate` [ms]."""
    began = time.perf_counter()
    for _ in sp.simulate(live.scene, live.solver, live.dt, frames):
        pass
    return 1e3 * (time.perf_counter() - began) / frames


def behind(engine: Engine, frames: int, look: float) -> float:
    """The same in the engine's process, from the command until this process receives the last frame [ms]."""
    began = time.perf_counter()
    engine.send(Reset())
    number = engine.send(Step(frames))
    while True:
        snapshot = engine.latest()
        if snapshot is not None and snapshot.applied >= number and snapshot.frame >= frames:
            return 1e3 * (time.perf_counter() - began) / frames
        time.sleep(look)


def played(engine: Engine, seconds: float) -> float:
    """The simulated time per wall-clock time of a simulation in real time."""
    engine.send(Reset())
    engine.send(Play())
    end = time.perf_counter() + seconds
    while time.perf_counter() < end:
        engine.latest()
        time.sleep(1 / 60)
    snapshot = engine.latest()
    assert snapshot is not None
    engine.wait_for(engine.send(Reset()))
    return snapshot.timing.real_time_ratio


@contextlib.contextmanager
def listening(url: str) -> Iterator[None]:
    """A process with a websocket that receives what a browser would receive."""
    listener = subprocess.Popen(
        [sys.executable, "-c", LISTEN, url.replace("http", "ws", 1)], stdout=subprocess.PIPE, text=True
    )
    try:
        assert listener.stdout is not None
        assert listener.stdout.readline().strip() == "connected"
        yield
    finally:
        listener.kill()
        listener.wait()


def main(rounds: int = 15, frames: int = 90, edge_length: float = 0.1, seconds: float = 10.0) -> dict[str, Any]:
    """Run all programs alternately and print their times [ms/frame]; returns the figures."""
    live = source(edge_length)
    at_start = circumstances()
    with Engine(live) as engine, opened_page("ball", 0) as page, page.simulating(live), listening(page.url):
        behind_page = page.content.simulation
        assert isinstance(behind_page, Engine)
        programs: dict[str, Callable[[], float]] = {
            "headless": lambda: headless(live, frames),
            "engine": lambda: behind(engine, frames, 1 / 60),
            "page": lambda: behind(behind_page, frames, 0.005),
        }
        for warm_up in programs.values():
            warm_up()
        times: dict[str, list[float]] = {way: [] for way in WAYS}
        for _ in range(rounds):
            for way, run in programs.items():
                times[way].append(run())
        clocks = {"engine": played(engine, seconds), "page": played(behind_page, seconds)}
        tets = engine.description.n_tets
    print(
        f"\nXPBD, 20 substeps, {tets} tets, {frames} frames of 1/60 s, {rounds} rounds; "
        f"load {at_start['load']} at the start, {circumstances()['load']} at the end"
    )
    ways = {}
    for way, text in WAYS.items():
        ratio = median(own / base for own, base in zip(times[way], times["headless"], strict=True))
        ways[way] = {"best": min(times[way]), "median": median(times[way]), "ratio": ratio}
        clock = f"played: {clocks[way]:.3f} of real time" if way in clocks else ""
        print(
            f"{text:<66} {ways[way]['best']:6.2f} ms/frame at best, {ways[way]['median']:6.2f} in the median, "
            f"ratio {ratio:4.2f}  {clock}"
        )
    counts = {"tets": tets, "frames": frames, "rounds": rounds}
    return {**at_start, **counts, "ways": ways, "real_time": clocks["page"]}


def run() -> None:
    """Measure, and print the table."""
    main()


if __name__ == "__main__":
    run()
