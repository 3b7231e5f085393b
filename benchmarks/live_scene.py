"""A ball of 5k tets that falls on a floor, simulated in one of several ways; prints one JSON line.

usage: live_scene.py headless|engine|page FRAMES [EDGE_LENGTH]

headless : `simulate`, in this process
engine : in the process behind a live page; this one reads the newest snapshot 60 times a second, as a page does
page : the same with the page served, and a websocket that takes all that a browser would get

All three simulate the same frames as fast as they can; the last two then play for some seconds against the clock.
"""

from __future__ import annotations

import contextlib
import json
import subprocess
import sys
import time
from collections.abc import Iterator

import supple as sp
from supple.viewer.app import Address, opened_page
from supple.viewer.engine import Engine
from supple.viewer.live_source import LiveSource
from supple.viewer.messages import Play, Reset, Step

LISTEN = """
import sys, viser
from websockets.sync.client import connect
with connect(sys.argv[1], subprotocols=["viser-v" + viser.__version__], max_size=None) as page:
    print("connected", flush=True)
    for _ in page:
        pass
"""


def source(edge_length: float) -> LiveSource:
    """A ball half a metre above the floor."""
    ball = sp.Body(
        "ball",
        sp.shapes.sphere(radius=0.5, edge_length=edge_length),
        sp.EdgesAndVolume(edge_compliance=1e-4, density=1000.0, damping=0.003),
        position=(0.0, 1.0, 0.0),
    )
    return LiveSource("ball", sp.Scene([ball], [sp.HalfSpace(friction=0.5)]), sp.XPBD(), 1 / 60)


def headless(live: LiveSource, frames: int) -> dict:
    """Wall-clock time per frame of `simulate`, kernels loaded before."""
    list(sp.simulate(live.scene, live.solver, live.dt, 2))
    began = time.perf_counter()
    for frame in sp.simulate(live.scene, live.solver, live.dt, frames):
        last = frame
    wall = time.perf_counter() - began
    return {"ms_per_frame": 1e3 * wall / frames, "tets": len(last.det_F)}


def behind(engine: Engine, frames: int, seconds: float, reads: bool) -> dict:
    """The same in the engine's process, from its start to its last frame as this process sees it."""
    engine.wait_for(engine.send(Reset()))
    began = time.perf_counter()
    engine.send(Step(frames))
    while True:
        snapshot = engine.latest()
        if snapshot is not None and snapshot.frame >= frames:
            break
        time.sleep(1 / 60 if reads else 0.005)
    wall = time.perf_counter() - began
    engine.wait_for(engine.send(Reset()))
    engine.send(Play())
    end = time.perf_counter() + seconds
    while time.perf_counter() < end:
        engine.latest()
        time.sleep(1 / 60)
    snapshot = engine.latest()
    assert snapshot is not None
    return {
        "ms_per_frame": 1e3 * wall / frames,
        "tets": snapshot.description.n_tets,
        "real_time_ratio": snapshot.timing.real_time_ratio,
        "played_ms": snapshot.timing.step_ms,
    }


@contextlib.contextmanager
def listening(url: str) -> Iterator[None]:
    """A process with a websocket that takes what a browser would get."""
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


def main() -> None:
    way, frames = sys.argv[1], int(sys.argv[2])
    live = source(float(sys.argv[3]) if len(sys.argv) > 3 else 0.1)
    seconds = frames / 60
    if way == "headless":
        result = headless(live, frames)
    elif way == "engine":
        with Engine(live) as engine:
            result = behind(engine, frames, seconds, reads=True)
    else:
        with opened_page(live, Address(port=0)) as page, listening(page.url):
            engine = page.shown.desk.simulation
            assert isinstance(engine, Engine)
            result = behind(engine, frames, seconds, reads=False)
    print(json.dumps(result))


if __name__ == "__main__":
    main()
