"""What drawing in software costs a pull on the live page: the scene is drawn and hidden in turn, all else is the same.

For each turn: the time between two pictures, and the cores that each kind of process takes.

usage: python -m benchmarks.drawing_cost [tets ...]      (Linux, with Chromium and the packages of the tests)
"""

from __future__ import annotations

import os
import shutil
import sys
import time
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np
from playwright.sync_api import sync_playwright

from benchmarks.live_page import FLAGS, source, wait
from supple.app.viewer.app import Address, opened_page
from supple.app.viewer.protocol.commands import Play

ROUNDS, SECONDS = 3, 3.0
# Of a process, by what its command line has.
KINDS = {b"type=gpu": "drawing", b"type=renderer": "page in the browser", b"spawn_main": "simulation"}
PICTURES = """(longest) => new Promise((resolve) => {
  const gaps = [], end = performance.now() + longest; let last = performance.now();
  const next = () => {
    const now = performance.now(); gaps.push(now - last); last = now;
    now < end ? requestAnimationFrame(next) : resolve(gaps); };
  requestAnimationFrame(next); })"""
HIDE = """() => {
  window.hidden = suppleViewer.mutable.current.scene.children.filter((each) => each.visible);
  window.hidden.forEach((each) => { each.visible = false; }); }"""
SHOW = "() => window.hidden.forEach((each) => { each.visible = true; })"


def processor_seconds() -> dict[str, float]:
    """Of this process and all that it started, so far, by kind."""
    parents: dict[int, int] = {}
    found: dict[int, tuple[str, float]] = {}
    for folder in Path("/proc").iterdir():
        if not folder.name.isdigit():
            continue
        try:
            fields = (folder / "stat").read_text().rpartition(")")[2].split()
            command = (folder / "cmdline").read_bytes()
        except OSError:
            continue  # it has ended
        kind = next((name for sign, name in KINDS.items() if sign in command), "other")
        parents[int(folder.name)] = int(fields[1])
        found[int(folder.name)] = kind, (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    seconds: dict[str, float] = defaultdict(float)
    for pid, (kind, used) in found.items():
        ancestor = pid
        while ancestor not in (0, 1, os.getpid()):
            ancestor = parents.get(ancestor, 0)
        if ancestor == os.getpid():
            seconds["server" if pid == ancestor else kind] += used
    return seconds


def turn(tab: Any, name: str) -> None:
    """Measure and print one turn."""
    before, began = processor_seconds(), time.perf_counter()
    gaps = tab.evaluate(PICTURES, 1e3 * SECONDS)[2:]
    after, passed = processor_seconds(), time.perf_counter() - began
    cores = ", ".join(f"{kind} {(after[kind] - before[kind]) / passed:.2f}" for kind in sorted(after))
    print(
        f"  {name}: a picture every {np.median(gaps):.1f} ms, {np.quantile(gaps, 0.95):.1f} at 95 %; cores: {cores} "
        f"(load {os.getloadavg()[0]:.1f})",
        flush=True,
    )


def measure(tets: int) -> None:
    """Pull a ball of about this many tets, with the scene drawn and hidden in turn."""
    with opened_page(source(tets), Address(port=0)) as page, sync_playwright() as playwright:
        content: Any = page.content
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=FLAGS.split())
        tab = browser.new_page(viewport={"width": 800, "height": 500})
        tab.goto(page.url + "&fixedDpr=0.2")
        tab.wait_for_selector("canvas")
        tab.wait_for_timeout(3000)
        tab.locator(".mantine-Notification-closeButton").first.dispatch_event("click")
        content.controller.simulation.send(Play())
        tab.wait_for_timeout(1500)
        box: Any = tab.locator("canvas").first.bounding_box()
        x, y = box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"]
        tab.mouse.move(x, y)
        tab.wait_for_timeout(100)
        tab.mouse.down()
        tab.mouse.move(x + 6, y - 6)
        wait(tab, lambda: content.controller.snapshot.grabs, "the grab")
        tab.mouse.move(x + 30, y - 30)
        tab.wait_for_timeout(3000)
        print(f"{content.controller.snapshot.description.n_tets} tets", flush=True)
        for _ in range(ROUNDS):
            turn(tab, "drawn")
            tab.evaluate(HIDE)
            turn(tab, "hidden")
            tab.evaluate(SHOW)
        browser.close()


if __name__ == "__main__":
    for number in sys.argv[1:] or ("5000", "60000"):
        measure(int(number))
