"""Tables of pages, from the figures that benchmarks write."""

from __future__ import annotations

from typing import Any

from benchmarks.table import measured_on

_PLATES = {
    "obstacles": "obstacles of triangles, the upper one moved as the free plate",
    "scripted bodies": "rigid bodies, moved in the same way",
    "free bodies": "rigid bodies, the lower one held, the upper one free",
}
_WAYS = {
    "headless": "`simulate`, no page",
    "engine": "in the live page's simulation process, snapshots read at 60 Hz",
    "page": "the same, with the page served and a websocket that receives everything",
}


def rigid_bodies_text(figures: dict[str, Any]) -> str:
    """The table of `benchmarks.rigid_bodies`."""
    lines = [
        f"The ball has {figures['tets']:,} tets. {measured_on(figures)}",
        "",
        "| solver | plates | ms/step | Newton iterations or substeps | ratio |",
        "|---|---|---|---|---|",
    ]
    for solver, plates in figures["solvers"].items():
        for kind, text in _PLATES.items():
            one = plates[kind]
            ratio = one["ms_per_step"] / plates["obstacles"]["ms_per_step"]
            lines.append(f"| `{solver}` | {text} | {one['ms_per_step']:.1f} | {one['iterations']:.1f} | {ratio:.2f} |")
    return "\n".join(lines)


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


def reading_text(figures: dict[str, Any]) -> str:
    """The table of `benchmarks.reading_fields`."""
    lines = [
        f"A finger of {figures['tets']:,} tets with cavity and cable; times of the processor on one thread. "
        f"{measured_on(figures)}",
        "",
        "| | ms |",
        "|---|---|",
        f"| a step of XPBD with {figures['substeps']:.0f} substeps | {figures['ms_per_step']:.1f} |",
        f"| reading all fields | {figures['ms_of_reading']:.1f} |",
    ]
    slowest = sorted(figures["fields"], key=figures["fields"].__getitem__, reverse=True)[:3]
    lines += [f"| reading `{name}` | {figures['fields'][name]:.1f} |" for name in slowest]
    return "\n".join(lines)
