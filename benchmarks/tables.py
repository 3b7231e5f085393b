"""Tables of pages, from the figures that benchmarks write."""

from __future__ import annotations

from typing import Any

from benchmarks.table import measured_on

_WAYS = {
    "headless": "`simulate`, no page",
    "engine": "in the live page's simulation process, snapshots read at 60 Hz",
    "page": "the same, with the page served and a websocket that receives everything",
}


def live_text(figures: dict[str, Any]) -> str:
    """The table of `benchmarks.live`."""
    lines = [
        f"{figures['frames']} frames without pauses of {figures['tets']:,} tets, {figures['rounds']} alternating "
        f"rounds. {measured_on(figures)}",
        "",
        "| | ms/frame, best | median | ratio |",
        "|---|---|---|---|",
    ]
    for way, text in _WAYS.items():
        one = figures["ways"][way]
        lines.append(f"| {text} | {one['best']:.1f} | {one['median']:.1f} | {one['ratio']:.2f} |")
    lines.append(f"| speed in real time, with the page served | | | {figures['real_time']:.3f} |")
    return "\n".join(lines)
