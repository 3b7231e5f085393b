"""Where the time from a move of the mouse to the moved mesh goes: the stages of one event, and what slows the slowest.

Each stage ends with a time stamp; those of the browser and those of this process are times since 1970, of one clock.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from itertools import pairwise
from typing import Any

import numpy as np
from websockets.asyncio.server import ServerConnection

from supple.app.viewer.drawing.layers.skin import drawn_points

# What ends at each time stamp after the first, which is that of the event in the browser.
STAGES = {
    "sent": "browser to server",
    "simulated": "command, wait for the next step, step, snapshot",
    "taken": "wait of the page for its turn to draw",
    "drawn": "messages of the picture made",
    "written": "viser's window, and its messages written to the browser",
    "received": "network, and decoding in the browser",
    "displayed": "browser: geometry, normals, drawing",
}
# What is ours, and what belongs to the browser: with a graphics card, the second part is short.
PARTS = {
    "ours": ("ours: event at the server to mesh written to the browser", ("simulated", "taken", "drawn", "written")),
    "browser": ("the browser: event to server, decoding, drawing in software", ("sent", "received", "displayed")),
}
MOVED = 1e-4  # [m]; what moves less is round-off
# How far the drawn mesh has moved since the last call [m].
MOTION = """() => {
  let found; suppleViewer.mutable.current.nodeRefFromName["/bodies/0 ball"].traverse((each) => {
    if (!found && each.geometry) found = each.geometry.attributes.position.array; });
  const before = window.meshBefore ?? [];
  window.meshBefore = found.slice();
  return found.reduce((most, value, k) => Math.max(most, Math.abs(value - (before[k] ?? 1e9))), 0);
}"""
# Notes the first move, the first message with other vertices, and the first drawn picture with them.
WATCH = """() => {
  const client = suppleViewer.mutable.current, epoch = () => performance.timeOrigin + performance.now();
  const mesh = () => {
    let found; client.nodeRefFromName["/bodies/0 ball"].traverse((each) => {
      if (!found && each.geometry) found = each.geometry.attributes.position.array; });
    return found; };
  const before = mesh().slice(), differs = (now) => now.some((value, k) => Math.abs(value - before[k]) > 1e-4);
  const stamps = {};
  addEventListener("pointermove", () => { stamps.moved ??= epoch(); }, { capture: true, once: true });
  const queue = client.messageQueue;
  queue.push = (message) => {
    const vertices = message.updates?.vertices;
    if (stamps.moved && !stamps.received && vertices && differs(vertices)) stamps.received = epoch();
    return Array.prototype.push.call(queue, message);
  };
  window.waited = new Promise((resolve) => {
    const look = () => {
      if (stamps.received && differs(mesh()))
        requestAnimationFrame(() => { delete queue.push; resolve({ ...stamps, displayed: epoch() }); });
      else requestAnimationFrame(look);
    };
    look();
  });
}"""


class Stamps:
    """The time stamps of one event in the process of the page [s since 1970]."""

    def __init__(self) -> None:
        self.by_name: dict[str, float] = {}

    def note(self, name: str, at: float | None = None) -> None:
        """Keep the first time stamp of this name."""
        self.by_name.setdefault(name, time.time() if at is None else at)


@contextmanager
def noted(content: Any) -> Iterator[Stamps]:
    """A block in which the page notes the first command of the mouse, and the first picture with another mesh."""
    stamps, controller, stage = Stamps(), content.controller, content.stage
    send, show, before = controller.send, stage.show, stage.moment.positions
    smallest = 12 * drawn_points(stage.model)  # of a message with the mesh [bytes]
    write = ServerConnection.send

    async def noted_write(connection: Any, data: Any, *more: Any, **named: Any) -> None:
        await write(connection, data, *more, **named)
        if "taken" in stamps.by_name and len(data) >= smallest:
            stamps.note("written")

    def noted_send(client: Any, make: Any) -> int:
        if client is not None:
            stamps.note("sent")
        return send(client, make)

    def noted_show(moment: Any) -> None:
        moved = "sent" in stamps.by_name and np.abs(moment.positions - before).max() > MOVED
        if moved:
            heard = controller.simulation.heard_at + time.time() - time.monotonic()
            stamps.note("simulated", heard)
            stamps.note("taken")
        show(moment)
        if moved:
            stamps.note("drawn")

    controller.send, stage.show = noted_send, noted_show
    ServerConnection.send = noted_write  # pyright: ignore[reportAttributeAccessIssue]
    try:
        yield stamps
    finally:
        del controller.send, stage.show
        ServerConnection.send = write


def stages_of(browser: dict[str, float], page: dict[str, float]) -> dict[str, float]:
    """The duration of each stage of an event [ms]; `browser` in ms, `page` in s since 1970."""
    at = {name: 1e3 * value for name, value in page.items()} | browser
    names = ["moved", *STAGES]
    return {name: at[name] - at[before] for before, name in pairwise(names)}


def summary(events: list[dict[str, float]]) -> dict[str, Any]:
    """Median and 95 % of the whole and of every stage [ms], and what made the slowest tenth of the events slow.

    `slow` counts, over the slowest tenth, the stage that exceeds its own median the most.
    """
    totals = [sum(event.values()) for event in events]
    stages = {name: _quantiles([event[name] for event in events]) for name in STAGES}
    slowest = [events[k] for k in np.argsort(totals)[-max(1, len(events) // 10) :]]
    slow = Counter(max(STAGES, key=lambda name: event[name] - stages[name]["median_ms"]) for event in slowest)
    return {
        "events": len(events),
        **_quantiles(totals),
        "stages": stages,
        "parts": {
            part: _quantiles([sum(event[name] for name in names) for event in events])
            for part, (_, names) in PARTS.items()
        },
        "slow": dict(slow.most_common()),
    }


def _quantiles(values: list[float]) -> dict[str, float]:
    return {"median_ms": float(np.median(values)), "p95_ms": float(np.quantile(values, 0.95))}


def printed(found: dict[str, Any]) -> str:
    """The stages as lines of text."""
    rows = [(STAGES[name], stage) for name, stage in found["stages"].items()]
    rows += [(PARTS[name][0], part) for name, part in found["parts"].items()]
    lines = [
        f"  {text:<52} {stage['median_ms']:7.1f} ms in the median, {stage['p95_ms']:7.1f} at 95 %"
        for text, stage in rows
    ]
    slow = ", ".join(f"{STAGES[name]} ({count})" for name, count in found["slow"].items())
    return "\n".join([*lines, f"  the slowest tenth is slow by: {slow}"])


def live_page_text(figures: dict[str, Any]) -> str:
    """The table of docs/reference/live_page.md."""
    sizes, implicit = figures["sizes"], figures["implicit"]

    def both(found: dict[str, float]) -> str:
        return f"{found['median_ms']:.1f} / {found['p95_ms']:.1f}"

    def row(text: str, cells: Iterable[str]) -> str:
        return "| " + " | ".join([text, *cells]) + " |"

    events = " and ".join(str(one["events"]) for one in sizes)
    lines = [
        f"From a move of the mouse to the moved mesh: {events} drags of a ball at rest, XPBD with 4 "
        f"substeps. Chromium draws in software, 160 x 100 pixels; {figures['date']}, load {figures['load']:.1f} "
        f"before and {figures['load_after']:.1f} after (the browser included), on two cores.",
        "",
        row("", (f"{one['tets']:,} tets" for one in sizes)),
        "|---|" + "---|" * len(sizes),
        row("a step", (f"{one['step_ms']:.1f} ms" for one in sizes)),
        row("**move to moved mesh: median / 95 % [ms]**", (both(one) for one in sizes)),
        *(row(text, (both(one["parts"][name]) for one in sizes)) for name, (text, _) in PARTS.items()),
        row("paused, of a core", (f"{one['paused_percent']:.1f} %" for one in sizes)),
        row("without a browser, of a core", (f"{one['unwatched_percent']:.1f} %" for one in sizes)),
    ]
    if implicit:
        text = f"`Implicit`, {implicit['tets']:,} tets with {implicit['contacts']:.0f} contacts: steps a second"
        lines.append(row(text, [f"{implicit['median_fps']:.0f}", *[""] * (len(sizes) - 1)]))
    return "\n".join(lines)
