"""The live page in a browser: from a move of the mouse to the moved mesh, and the cost while nothing moves.

A ball at rest in free space is pulled. The clock starts when the browser gets the first move of a drag, and stops at
the first drawn picture in which the vertices of the ball are elsewhere; `benchmarks.latency` tells where the time
between goes, and how much of it is the browser's drawing. Chromium draws in software with few pixels, so
that the time to draw, which a graphics card would not need, has little effect. Then the processor time of page and
simulation is measured at rest: paused with a browser, and playing without one. Last, without a page, the frames per
second of implicit steps with contact.

Each part runs in a process of its own, which is ended where it takes too long; the other parts are then written
without it. Without arguments, the figures of docs/reference/live_page.md are written: about three minutes.

usage: python -m benchmarks.live_page [tets ...]      (Linux, with Chromium and the packages of the tests)
"""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from playwright.sync_api import sync_playwright

import supple as sp
from benchmarks.latency import MOTION, MOVED, WATCH, noted, printed, stages_of, summary
from benchmarks.measuring import ROOT
from benchmarks.published import publish
from supple.app.viewer.app import Address, OpenPage, opened_page
from supple.app.viewer.engine.scene.live_scene import LiveScene
from supple.app.viewer.engine.scene.solvers import SOLVERS
from supple.app.viewer.protocol.commands import Pause, Play, Reset
from supple.app.viewer.protocol.live_source import LiveSource

# A part that takes longer is ended [s]: compiling kernels, once, may take minutes. Usually a size takes 80 s.
LONGEST_PART = 400.0
LONGEST_WAIT = 30.0  # for one event [s]
FIRST_WAIT = 300.0  # for the first one, which may compile kernels, and is not counted [s]
FLAGS = "--headless --no-sandbox --disable-gpu --use-angle=swiftshader --enable-unsafe-swiftshader"


def source(tets: int) -> LiveSource:
    """A ball of about this many tets."""
    edge = 0.5 * (37.0 / tets) ** (1.0 / 3.0)
    rubber = sp.StableNeoHookean(youngs=1e5, poisson=0.4, density=1000.0, damping=0.01)
    ball = sp.Body("ball", sp.shapes.sphere(radius=0.5, edge_length=edge), rubber)
    return LiveSource("ball", sp.Scene([ball], gravity=(0.0, 0.0, 0.0)), sp.XPBD(substeps=4), 1 / 60)


def processor_seconds() -> float:
    """Of this process and its simulation, so far."""
    total = 0.0
    for pid in (os.getpid(), *_children(os.getpid())):
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
        total += (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    return total


def _children(pid: int) -> list[int]:
    """The processes of this program's kind: not the browser's."""
    found = []
    for task in Path(f"/proc/{pid}/task").iterdir():
        found += [int(each) for each in (task / "children").read_text().split()]
    return [each for each in found if b"spawn_main" in Path(f"/proc/{each}/cmdline").read_bytes()]


def share(seconds: float) -> float:
    """The share of one core [%] that page and simulation use within the next seconds."""
    before, began = processor_seconds(), time.perf_counter()
    time.sleep(seconds)
    return 100.0 * (processor_seconds() - before) / (time.perf_counter() - began)


def wait(tab: Any, done: Any, what: str, pause: float = 20.0) -> None:
    """Wait until `done`; look every `pause` [ms]. Raises `TimeoutError`, which names what did not come."""
    end = time.monotonic() + LONGEST_WAIT
    while not done():
        if time.monotonic() > end:
            raise TimeoutError(f"{what} did not come within {LONGEST_WAIT:g} s")
        tab.wait_for_timeout(pause)


def to_rest(tab: Any, page: OpenPage) -> None:
    """Return to the start, and wait until the browser shows the mesh at rest."""
    controller: Any = page.content.controller  # pyright: ignore[reportAttributeAccessIssue]
    number = controller.simulation.send(Reset())
    wait(tab, lambda: controller.snapshot.applied >= number and not controller.snapshot.grabs, "the start")
    wait(tab, lambda: tab.evaluate(MOTION) <= MOVED, "a picture at rest", 200.0)


def one_event(tab: Any, page: OpenPage, longest: float = LONGEST_WAIT) -> dict[str, float]:
    """From a move of the mouse to the moved mesh: the duration of each stage [ms]."""
    content: Any = page.content
    box = tab.locator("canvas").first.bounding_box()
    x, y = box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"]
    tab.mouse.move(x, y)
    tab.wait_for_timeout(100)
    tab.mouse.down()
    tab.mouse.move(x + 6, y - 6)  # the first move begins the drag, and the second one pulls
    wait(tab, lambda: content.controller.snapshot.grabs, "the grab")
    tab.wait_for_timeout(200)
    tab.evaluate(WATCH)
    with noted(content) as stamps:
        tab.mouse.move(x + 40, y - 40)
        found = tab.evaluate(f"Promise.race([waited, new Promise((no) => setTimeout(no, {1e3 * longest}, null))])")
    if found is None:
        raise TimeoutError(f"no moved mesh within {longest:g} s; notices: {content.controller.snapshot.notices}")
    tab.mouse.up()
    to_rest(tab, page)
    return stages_of(found, stamps.by_name)


def measure_events(tab: Any, page: OpenPage, rounds: int, longest: float) -> list[dict[str, float]]:
    """So many events, or as many as the time allows [s]."""
    one_event(tab, page, FIRST_WAIT)
    events, end = [], time.monotonic() + longest
    while len(events) < rounds and time.monotonic() < end:
        events.append(one_event(tab, page))
    if len(events) < rounds:
        print(f"{len(events)} of {rounds} events were measured: {longest:g} s were over", flush=True)
    return events


def measure(tets: int, rounds: int = 40, longest: float = 45.0, seconds: float = 10.0) -> dict[str, Any]:
    """All figures of one size, by name."""
    with opened_page(source(tets), Address(port=0)) as page, sync_playwright() as playwright:
        content: Any = page.content
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=FLAGS.split())
        tab = browser.new_page(viewport={"width": 800, "height": 500})
        tab.set_default_timeout(60_000)
        tab.goto(page.url + "&fixedDpr=0.2")
        tab.wait_for_selector("canvas")
        tab.wait_for_timeout(3000)
        tab.locator(".mantine-Notification-closeButton").first.dispatch_event("click")
        send = content.controller.simulation.send
        send(Play())
        tab.wait_for_timeout(1500)
        events = measure_events(tab, page, rounds, longest)
        tab.wait_for_timeout(2500)  # until the slow first step after the last reset is not in the mean
        step = content.controller.snapshot.timing.step_ms
        send(Pause())
        tab.wait_for_timeout(1500)
        paused = share(seconds)
        send(Play())
        tab.close()
        time.sleep(4.0)
        unwatched = share(seconds)
        browser.close()
        return {
            "tets": content.controller.snapshot.description.n_tets,
            "step_ms": step,
            **summary(events),
            "paused_percent": paused,
            "unwatched_percent": unwatched,
        }


def implicit_frames(divisions: tuple[int, int, int] = (5, 5, 7), frames: int = 60) -> dict[str, float]:
    """Frames per second of two blocks that fall on a floor and onto each other, with the page's implicit solver."""
    rubber = sp.StableNeoHookean(youngs=1e5, poisson=0.4, density=1000.0, damping=0.01)
    block = sp.shapes.box((0.4, 0.4, 0.4), divisions)
    places = {"lower": (0.0, 0.22, 0.0), "upper": (0.05, 0.65, 0.05)}
    bodies = [sp.Body(name, block, rubber, position=place) for name, place in places.items()]
    live = LiveScene(
        LiveSource("blocks", sp.Scene(bodies, [sp.HalfSpace(friction=0.5)]), SOLVERS["implicit"](), 1 / 60)
    )
    live.warm_up()
    seconds, contacts = [], []
    for _ in range(frames):
        began = time.perf_counter()
        live.step()
        seconds.append(time.perf_counter() - began)
        contacts.append(live.report.details.contacts)
    touching = np.array(seconds)[np.array(contacts) > 0]
    return {
        "tets": len(live.system.tets),
        "contacts": float(np.mean(contacts)),
        "median_fps": float(1.0 / np.median(touching)),
        "mean_fps": float(len(touching) / touching.sum()),
    }


def of_size(tets: int) -> dict[str, Any]:
    """Measure and print one size."""
    one = measure(tets)
    print(
        f"{one['tets']:.0f} tets: a step {one['step_ms']:.1f} ms; mouse to moved mesh {one['median_ms']:.0f} ms in "
        f"the median, {one['p95_ms']:.0f} ms at 95 %; paused {one['paused_percent']:.2f} %, "
        f"unwatched {one['unwatched_percent']:.2f} % of a core (load {os.getloadavg()[0]:.1f})\n{printed(one)}",
        flush=True,
    )
    return one


def of_implicit() -> dict[str, float]:
    """Measure and print the implicit steps."""
    blocks = implicit_frames()
    print(
        f"implicit, {blocks['tets']:.0f} tets, {blocks['contacts']:.0f} contacts: {blocks['median_fps']:.1f} frames/s "
        f"in the median, {blocks['mean_fps']:.1f} in the mean (load {os.getloadavg()[0]:.1f})",
        flush=True,
    )
    return blocks


def part(name: str) -> dict[str, Any] | None:
    """The figures of one part, measured in a process of its own; None, with a message, where there are none."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "figures.json"
        command = [sys.executable, "-m", "benchmarks.live_page", "--part", name, str(file)]
        # A session of its own, so that the browser ends with it.
        child = subprocess.Popen(command, cwd=ROOT, start_new_session=True)
        try:
            child.wait(LONGEST_PART)
        except subprocess.TimeoutExpired:
            print(f"live_page: {name} is left out, it takes more than {LONGEST_PART:g} s", flush=True)
        finally:
            if child.poll() is None:
                os.killpg(child.pid, signal.SIGKILL)
                child.wait()
        if file.exists():
            return json.loads(file.read_text(encoding="utf-8"))
    if child.returncode > 0:
        print(f"live_page: {name} is left out, it failed; see above", flush=True)
    return None


def main(sizes: tuple[int, ...] = (5_000, 60_000)) -> dict[str, Any]:
    """Measure and print all sizes."""
    load = os.getloadavg()[0]
    made = [part(str(tets)) for tets in sizes]
    implicit = part("implicit")
    return {
        "load": load,
        "load_after": os.getloadavg()[0],
        "date": time.strftime("%Y-%m-%d"),
        "sizes": [one for one in made if one],
        "implicit": implicit,
    }


def run() -> None:
    """Measure the two sizes of docs/reference/live_page.md, and write the page's figures."""
    if shutil.which("chromium") is None:
        print("live_page: left out, Chromium is not on the path")
        return
    began = time.monotonic()
    figures = main()
    if figures["sizes"]:
        publish("live_page", figures)
    else:
        print("live_page: nothing is written, no size was measured")
    print(f"live_page: {time.monotonic() - began:.0f} s in all")


def run_part(name: str, file: Path) -> None:
    """Measure one part, and write its figures."""
    found = of_implicit() if name == "implicit" else of_size(int(name))
    file.write_text(json.dumps(found), encoding="utf-8")


if __name__ == "__main__":
    if sys.argv[1:2] == ["--part"]:
        run_part(sys.argv[2], Path(sys.argv[3]))
    elif sys.argv[1:]:
        main(tuple(int(each) for each in sys.argv[1:]))
    else:
        run()
