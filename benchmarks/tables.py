"""Tables of docs/benchmarks.md, from the figures that benchmarks write."""

from __future__ import annotations

from typing import Any

_PLATES = {
    "obstacles": "obstacles of triangles, moved by a script",
    "scripted bodies": "rigid bodies, moved by the same script",
    "free bodies": "rigid bodies, the lower one held, the upper one free",
}
_WAYS = {
    "headless": "`simulate`, no page",
    "engine": "in the live page's simulation process, snapshots read at 60 Hz",
    "page": "the same, with the page served and a websocket that receives everything",
}


def measured_on(figures: dict[str, Any]) -> str:
    """When the figures were measured, and what else the machine did."""
    return f"Measured on {figures['date']}, on a machine of load {figures['load']} on {figures['cores']} cores."


def rigid_bodies_text(figures: dict[str, Any]) -> str:
    """The table of `benchmarks.rigid_bodies`."""
    plates = figures["plates"]
    lines = [
        f"The ball has {figures['tets']:,} tets. {measured_on(figures)}",
        "",
        "| plates | ms/step | Newton/step | ratio |",
        "|---|---|---|---|",
    ]
    for kind, text in _PLATES.items():
        one = plates[kind]
        ratio = one["ms_per_step"] / plates["obstacles"]["ms_per_step"]
        lines.append(f"| {text} | {one['ms_per_step']:.1f} | {one['iterations']:.1f} | {ratio:.2f} |")
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
    lines += ["", f"In real time, with the page served, it ran at {figures['real_time']:.3f} of real time."]
    return "\n".join(lines)


def reading_text(figures: dict[str, Any]) -> str:
    """The sentences of `benchmarks.reading_fields`."""
    slowest = sorted(figures["fields"], key=figures["fields"].__getitem__, reverse=True)[:3]
    parts = ", ".join(f"`{name}` {figures['fields'][name]:.1f} ms" for name in slowest)
    return "\n".join(
        [
            f"Reading all fields of the tables takes {figures['ms_of_reading']:.1f} ms of processor time on one thread "
            f"for a finger of {figures['tets']:,} tets",
            f"with cavity and cable in `XPBD`: {100.0 * figures['share']:.0f} % of a step, which takes "
            f"{figures['ms_per_step']:.0f} ms with {figures['substeps']:.0f} substeps. Most of it: {parts}.",
            measured_on(figures),
        ]
    )
